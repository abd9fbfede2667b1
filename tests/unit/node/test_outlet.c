/* Results that wait for more. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "node/setup.h"
#include "node/roles/outlet.h"

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

static void test_few_wait(void **unused) {
    (void)unused;
    struct node_outlet outlet;
    begin(&outlet);
    assert_true(node_outlet_few(&outlet));
    emit(&outlet, SLOTS / 4 - 1);
    assert_true(node_outlet_few(&outlet));
    emit(&outlet, SLOTS / 4);
    assert_false(node_outlet_few(&outlet));
    assert_true(node_outlet_has_room(&outlet));
}

static void test_last_does_not(void **unused) {
    (void)unused;
    struct node_outlet outlet;
    begin(&outlet);
    emit(&outlet, 1);
    assert_true(node_outlet_few(&outlet));
    node_outlet_close(&outlet);
    assert_false(node_outlet_few(&outlet));
}

static void test_spilled_do_not(void **unused) {
    (void)unused;
    struct node_outlet outlet;
    const struct incode_face face = {{1, 2, 3}};
    begin(&outlet);
    struct incode_front_outside outside = node_outlet_outside(&outlet);
    assert_true(outside.spill(outside.context, &face, 1));
    assert_false(node_outlet_few(&outlet));
}

/* As many as it has room for, of the largest records, each found by another
 * node than the one before. */
static void test_finders_fit(void **unused) {
    (void)unused;
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

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_few_wait),
        cmocka_unit_test(test_last_does_not),
        cmocka_unit_test(test_spilled_do_not),
        cmocka_unit_test(test_finders_fit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
