/* Single operations: + - * / and the square root on doubles and floats,
 * comparisons, conversions, and the sums and products without error that rest
 * on them.
 *
 * Work: some 60 operations. */
#ifndef TESTS_ARITHMETIC_SINGLE_H
#define TESTS_ARITHMETIC_SINGLE_H

#include <stdint.h>

#include "draw.h"
#include "record.h"

void single_case(struct draw *draw, uint32_t number, struct record *record);

#endif
