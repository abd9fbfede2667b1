/* Results that wait for more. */

#include "node/common.h"
#include "node/roles/outlet.h"
#include "tests/unit/test.h"

enum { MEMORY = 1 << 20, SLOTS = MEMORY / 65536 };

static _Alignas(NODE_ALIGNMENT) uint8_t memory[MEMORY];

static void begin(struct node_outlet *outlet) {
    static struct node_setup_message setup;
    static struct node_counted counted;
    static struct node_fault fault;
    setup.credits = 100;
    assert_true(node_outlet_bytes(MEMORY) <= sizeof memory);
    node_outlet_init(outlet, memory, MEMORY, &setup, &counted, &fault);
    node_outlet_begin(outlet, 1);
}

/* Stars until so many batches are full. */
static void emit(struct node_outlet *outlet, uint32_t batches) {
    static const uint32_t apexes[2][3] = {{1, 2, 3}, {2, 3, 4}};
    struct incode_front_outside outside = node_outlet_outside(outlet);
    for (uint32_t v = 0; outlet->results.used < batches; v += 100000)
        outside.emit(outside.context, v, apexes, 2);
}

TEST(test_few_wait) {
    struct node_outlet outlet;
    begin(&outlet);
    assert_true(node_outlet_few(&outlet));
    emit(&outlet, SLOTS / 4 - 1);
    assert_true(node_outlet_few(&outlet));
    emit(&outlet, SLOTS / 4);
    assert_false(node_outlet_few(&outlet));
    assert_true(node_outlet_has_room(&outlet));
}

TEST(test_last_does_not) {
    struct node_outlet outlet;
    begin(&outlet);
    emit(&outlet, 1);
    assert_true(node_outlet_few(&outlet));
    node_outlet_close(&outlet);
    assert_false(node_outlet_few(&outlet));
}

TEST(test_spilled_do_not) {
    struct node_outlet outlet;
    const struct incode_face face = {{1, 2, 3}};
    begin(&outlet);
    struct incode_front_outside outside = node_outlet_outside(&outlet);
    assert_true(outside.spill(outside.context, &face, 1));
    assert_false(node_outlet_few(&outlet));
}

/* As many as it has room for, of the largest records, each found by another
 * node than the one before. */
TEST(test_finders_fit) {
    enum { FAR = INT32_MAX };
    static const uint32_t vertex[2] = {0, FAR};
    static const uint32_t apexes[2][1][3] = {{{FAR - 1, FAR - 2, FAR - 3}},
                                             {{1, 2, 3}}};
    struct node_outlet outlet;
    begin(&outlet);
    struct incode_front_outside outside = node_outlet_outside(&outlet);
    size_t room = outside.emit_room(outside.context);
    assert_true(room > 8);
    for (size_t i = 0; i < room; i++) {
        node_outlet_found_by(&outlet, (uint16_t)(UINT16_MAX - i % 2));
        outside.emit(outside.context, vertex[i % 2], apexes[i % 2], 1);
    }
    assert_false(node_fault_is_set(outlet.fault));
}
