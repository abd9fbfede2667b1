#include "totals.h"

#include <string.h>

enum { WORDS = sizeof(struct incode_statistics) / sizeof(uint64_t) };

static_assert(sizeof(struct incode_statistics) == WORDS * sizeof(uint64_t),
              "statistics are counters of 64 bits");

static uint64_t higher(uint64_t a, uint64_t b) {
    return a > b ? a : b;
}

static uint32_t most(uint32_t a, uint32_t b) {
    return a > b ? a : b;
}

static void add_statistics(struct incode_statistics *sum,
                           const struct incode_statistics *more) {
    uint64_t a[WORDS], b[WORDS];
    uint64_t afl_max = higher(sum->afl_max, more->afl_max);
    uint64_t high_water =
        higher(sum->memory_high_water, more->memory_high_water);
    memcpy(a, sum, sizeof a);
    memcpy(b, more, sizeof b);
    for (unsigned i = 0; i < WORDS; i++) {
        a[i] += b[i];
    }
    memcpy(sum, a, sizeof a);
    sum->afl_max = afl_max;
    sum->memory_high_water = high_water;
}

void node_totals_add(struct node_finished_message *sum,
                     const struct node_finished_message *more) {
    sum->wall_us += more->wall_us;
    sum->busy_us += more->busy_us;
    sum->bytes_in += more->bytes_in;
    sum->bytes_out += more->bytes_out;
    sum->pages_held += more->pages_held;
    sum->pages_forwarded += more->pages_forwarded;
    sum->retransmitted += more->retransmitted;
    sum->memory_high_water =
        higher(sum->memory_high_water, more->memory_high_water);
    sum->stack_bytes = most(sum->stack_bytes, more->stack_bytes);
    sum->stack_high_water = most(sum->stack_high_water, more->stack_high_water);
    sum->overruns += more->overruns;
    sum->look_us_max = most(sum->look_us_max, more->look_us_max);
    add_statistics(&sum->statistics, &more->statistics);
}
