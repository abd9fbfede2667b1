/* Whose images this board's loader takes: the public half of a pair, which the
 * Makefile writes into a source of its own.
 *
 * Memory: 32 bytes, of code.  Work: none.
 *
 *     bool ours = memcmp(image.key, bare_sign_key, SIGN_PUBLIC_BYTES) == 0;
 */
#ifndef BOARDS_BARE_SIGN_KEY_H
#define BOARDS_BARE_SIGN_KEY_H

#include "transport/sign_suite.h"

extern const uint8_t bare_sign_key[SIGN_PUBLIC_BYTES];

#endif
