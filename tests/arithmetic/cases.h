/* What a processor's arithmetic must give bit for bit as every other: cases of
 * the filters of orient3d and in_sphere with each of their roundings, of all
 * stages of the exact predicates, and of single operations.  A block is of
 * 1,000 cases of one kind; each case can be made alone.
 *
 * Memory: 8 KB of stack.  Work: bounded; a block of filters takes a Cortex-M3
 * some 10 million instructions, of the exact predicates some 300 million. */
#ifndef TESTS_ARITHMETIC_CASES_H
#define TESTS_ARITHMETIC_CASES_H

#include <stdint.h>

#include "record.h"

enum {
    CASES_PER_BLOCK = 1000,
    CASES_SINGLE_BLOCKS = 90,
    CASES_FILTER_BLOCKS = 1000,
    CASES_EXACT_BLOCKS = 10,
    /* In this order. */
    CASES_FILTERS = CASES_SINGLE_BLOCKS,
    CASES_EXACT = CASES_FILTERS + CASES_FILTER_BLOCKS,
    CASES_BLOCKS = CASES_EXACT + CASES_EXACT_BLOCKS
};

/* The digest of a block's cases' digests; block < CASES_BLOCKS. */
uint64_t cases_block(uint32_t block);

/* One case's results go into the record; number < CASES_PER_BLOCK. */
void cases_case(uint32_t block, uint32_t number, struct record *record);

/* What the block tries. */
const char *cases_kind(uint32_t block);

#endif
