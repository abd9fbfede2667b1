/* Records of one size in two sectors of a flash, one behind the other, in
 * turns, each with a number larger than all before: the newest one counts.  One
 * that was not written whole, as power was lost, is passed over, and its number
 * too, as it may be read as whole one day.
 *
 * Memory: the struct.  Work: reads both sectors; loader_records_append programs
 * one record, and once a sector is full, erases the other.
 *
 *     const struct loader_records records = {flash, 0, mark, 16};
 *     if (!loader_records_append(&records, body, &number))
 *         return -1; // the flash takes no record any more
 */
#ifndef NODE_LOADER_RECORDS_H
#define NODE_LOADER_RECORDS_H

#include "flash.h"

enum {
    LOADER_RECORD_OWN = 12, /* bytes of a record that are not its body */
    LOADER_RECORD_MAX = 32
};

struct loader_records {
    const struct loader_flash *flash;
    uint32_t first; /* of its two sectors */
    uint32_t mark;  /* with which a record of this kind begins */
    uint32_t bytes; /* of a record, at most LOADER_RECORD_MAX; it divides a
                       page */
};

/* The body of the newest, and its number; 0: there is none. */
uint32_t loader_records_newest(const struct loader_records *records,
                               void *body);

/* *number: of this one, 1 or more.  False: it could not be written. */
bool loader_records_append(const struct loader_records *records,
                           const void *body, uint32_t *number);

#endif
