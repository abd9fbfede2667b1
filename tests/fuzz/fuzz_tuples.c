/* Messages to a place of the tuple space, from anywhere: whatever comes, it
 * keeps its bounds, and a new generation begins with an empty space. */
#include <stdlib.h>
#include <string.h>

#include "transport/tuples/tuples.h"

enum { PLACES = 3 };

static uint64_t arena[2048];

static void demand(bool condition) {
    if (!condition)
        abort();
}

static int write_message(void *context, uint16_t place, const void *data,
                         size_t size) {
    (void)context, (void)data;
    demand(place > 0 && place < PLACES && size >= TUPLES_HEADER_BYTES);
    return 0;
}

static bool run(void *context, struct tuple *tuple) {
    (void)context;
    return tuple->count > 1;
}

static tuples_function *const functions[] = {run};

/* Calls of this place, by chance: of one number and some bytes. */
static void call(struct tuples *space, unsigned which) {
    struct tuple t = {.count = 2, .keyed = which & 8};
    t.field[0] = TUPLE_UINT32(which >> 4 & 1);
    t.field[1] = which & 32 ? TUPLE_FORMAL(TUPLE_TYPE_BYTES)
                            : TUPLE_BYTES(&t, which >> 6);
    int number = (which & 7) == 0   ? tuples_out(space, &t)
                 : (which & 7) == 1 ? tuples_in(space, &t)
                 : (which & 7) == 2 ? tuples_rd(space, &t)
                 : (which & 7) == 3 ? tuples_inp(space, &t)
                 : (which & 7) == 4 ? tuples_eval(space, 0, &t)
                                    : TUPLES_BUSY;
    if (number >= 0 && (which & 64))
        tuples_close(space, number);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* A byte that says how many follow, and from whom; 0: a call. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    struct tuples_config config = {.places = PLACES,
                                   .operations = 4,
                                   .processes = 1,
                                   .tuple_bytes = TUPLES_PATTERN_MAX,
                                   .store_bytes = 160,
                                   .functions = functions,
                                   .function_count = 1,
                                   .write = write_message};
    demand(tuples_arena_bytes(&config) <= sizeof arena);
    struct tuples *space = tuples_init(arena, sizeof arena, &config, 0);
    while (size > 1) {
        size_t part = data[0] & 127;
        uint16_t source = 1 + (data[0] >> 7);
        if (part == 0) {
            call(space, data[1]);
            part = 1;
        } else {
            part = part < size ? part : size - 1;
            (void)tuples_take(space, source, data + 1, part);
        }
        data += 1 + part;
        size -= 1 + part;
        tuples_step(space);
        demand(tuples_statistics(space)->store_high_water <= 160);
    }
    struct tuple t;
    tuples_renew(space, 1);
    for (int i = 0; i < 4; i++) {
        if (tuples_is_open(space, i)) {
            demand(tuples_poll(space, i, &t) != TUPLES_PENDING);
            tuples_close(space, i);
        }
    }
    demand(tuples_held(space) == 0);
    return 0;
}
