/* Tables of the checks: see frame.h.  CRC-32C by slices (Kounavis and Berry,
 * 2005): table k holds the CRC of a byte that k zero bytes follow.
 *
 * Memory: constant.  Work: none.
 *
 *     crc = frame_crc32c_slice[0][(crc ^ byte) & 255] ^ crc >> 8;
 */
#ifndef TRANSPORT_FRAME_TABLES_H
#define TRANSPORT_FRAME_TABLES_H

#include <stdint.h>

/* Slices at once: a large machine affords 8 KB, a small one 4. */
#if defined(__arm__)
enum { FRAME_SLICES = 4 };
#else
enum { FRAME_SLICES = 8 };
#endif

extern const uint32_t frame_crc32c_slice[FRAME_SLICES][256];
extern const uint16_t frame_crc16_table[256];

#endif
