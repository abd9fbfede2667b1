/* Whose images this board's loader takes: the public half of a pair, which the
 * build writes into a source of its own. */
#ifndef BOARDS_BARE_SIGN_KEY_H
#define BOARDS_BARE_SIGN_KEY_H

#include "transport/sign_suite.h"

extern const uint8_t bare_sign_key[SIGN_PUBLIC_BYTES];

#endif
