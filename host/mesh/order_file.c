#include "order.h"

#include "host/base/journal.h"
#include "host/base/memory.h"

/* An order as one record of a journal: its numbers, and its arrays. */

enum { ORDER = 1, ARRAYS = 8 };

/* The arrays of an order whose sizes are known: `order` is used for those
 * alone, or the arrays as well. */
static unsigned parts_of(const struct host_order *order,
                         struct host_bytes part[ARRAYS]) {
    uint64_t bricks = order->bricks;
    uint64_t cells =
        (uint64_t)order->cells[0] * order->cells[1] * order->cells[2];
    unsigned n = 0;
    part[n++] = (struct host_bytes){order, sizeof *order};
    part[n++] =
        (struct host_bytes){order->brick, bricks * sizeof *order->brick};
    part[n++] = (struct host_bytes){order->fill, bricks};
    part[n++] = (struct host_bytes){order->row, bricks * INCODE_BRICK_POINTS *
                                                    sizeof *order->row};
    part[n++] = (struct host_bytes){
        order->boxes,
        (order->tree.base[order->tree.levels] - bricks) * sizeof *order->boxes};
    part[n++] = (struct host_bytes){order->region,
                                    order->regions * sizeof *order->region};
    if (cells == 0)
        return n;
    part[n++] = (struct host_bytes){order->first_of_cell,
                                    (cells + 1) * sizeof *order->first_of_cell};
    part[n++] = (struct host_bytes){order->by_cell,
                                    order->points * sizeof *order->by_cell};
    return n;
}

int host_order_append(const struct host_order *order,
                      struct host_journal *journal, uint64_t key,
                      struct host_error *error) {
    struct host_journal_head head = {.kind = ORDER, .key = key};
    struct host_bytes part[ARRAYS];
    unsigned parts = parts_of(order, part);
    return host_journal_append(journal, &head, part, parts, error);
}

/* Reads the order's numbers, makes room for its arrays, and reads them. */
static bool read_arrays(struct host_journal_reader *reader,
                        struct host_order *order, uint64_t bytes) {
    struct host_bytes part[ARRAYS];
    if (!host_journal_take(reader, order, sizeof *order))
        return false;
    order->brick = NULL, order->fill = NULL, order->row = NULL;
    order->boxes = NULL, order->region = NULL;
    order->first_of_cell = NULL, order->by_cell = NULL;
    incode_tree_init(&order->tree, order->bricks,
                     order->cells[0] * order->cells[1] * order->cells[2]);
    order->regions_made = order->regions;
    unsigned parts = parts_of(order, part);
    uint64_t sum = 0;
    for (unsigned i = 0; i < parts; i++)
        sum += part[i].bytes;
    if (sum != bytes) {
        *order = (struct host_order){0};
        return false;
    }
    void *array[ARRAYS] = {NULL};
    bool is_read = true;
    for (unsigned i = 1; i < parts; i++) {
        array[i] = host_map(part[i].bytes);
        is_read = is_read && array[i] != NULL &&
                  host_journal_take(reader, array[i], part[i].bytes);
    }
    order->brick = array[1], order->fill = array[2], order->row = array[3];
    order->boxes = array[4], order->region = array[5];
    order->first_of_cell = array[6], order->by_cell = array[7];
    return is_read;
}

bool host_order_take(struct host_order *order,
                     const struct host_journal *journal, uint64_t key) {
    struct host_journal_reader reader;
    const struct host_journal_record *record = journal->record;
    *order = (struct host_order){0};
    if (journal->records != 1 || record->head.kind != ORDER ||
        record->head.key != key)
        return false;
    host_journal_read(&reader, journal, record);
    if (read_arrays(&reader, order, record->head.bytes) &&
        host_journal_sound(&reader))
        return true;
    host_order_free(order);
    return false;
}
