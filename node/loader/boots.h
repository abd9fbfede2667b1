/* The number of a board's start, which never comes again: records in the first
 * two sectors of its flash, one behind the other, in turns.  A record that was
 * not written whole, as power was lost, is passed over, and its number too.
 *
 * Memory: the flash's.  Work: reads both sectors, programs one record; once a
 * sector is full, erases the other.
 *
 *     uint32_t boot;
 *     if (!loader_boots_next(flash, &boot))
 *         return -1; // the flash takes no record any more
 */
#ifndef NODE_LOADER_BOOTS_H
#define NODE_LOADER_BOOTS_H

#include "flash.h"

enum { LOADER_BOOT_BYTES = 16 /* of a record: it divides a page */ };

/* 1 at the first start, and larger than ever before at each: recorded before it
 * is told.  False: it could not be. */
bool loader_boots_next(const struct loader_flash *flash, uint32_t *boot);

#endif
