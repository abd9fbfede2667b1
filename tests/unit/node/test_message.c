/* Messages have one layout on every processor, and fit what carries them. */

#include "node/message.h"
#include "node/result.h"
#include "tests/unit/test.h"

TEST(test_layouts) {
    assert_int_equal(offsetof(struct node_setup_message, role), 12);
    assert_int_equal(offsetof(struct node_setup_message, setup), 16);
    assert_int_equal(offsetof(struct node_setup_message, setup.shuffle_seed),
                     24);
    assert_int_equal(offsetof(struct node_setup_message, setup.lo), 32);
    assert_int_equal(offsetof(struct node_setup_message, setup.cells), 80);
    assert_int_equal(offsetof(struct node_setup_message, manager), 96);
    assert_int_equal(offsetof(struct node_setup_message, builders), 104);
    assert_int_equal(offsetof(struct node_setup_message, page_key), 232);
    assert_int_equal(sizeof(struct node_setup_message), 240);
    assert_int_equal(offsetof(struct node_page_message, data), 12);
    assert_int_equal(offsetof(struct node_page_head, tag), 4);
    assert_int_equal(sizeof(struct node_wrong_page_message), 8);
    assert_int_equal(offsetof(struct incode_answers, builder), 2);
    assert_int_equal(offsetof(struct incode_answers, v), 8);
    assert_int_equal(offsetof(struct node_job_message, job.lo), 16);
    assert_int_equal(sizeof(struct node_job_message), 64);
    assert_int_equal(sizeof(struct node_spill_header), 20);
    assert_int_equal(offsetof(struct node_finished_message, wall_us), 16);
    assert_int_equal(sizeof(struct node_finished_message) % 8, 0);
    assert_true(sizeof(struct node_ready_message) <= CUBE_PAYLOAD_MAX);
    assert_int_equal(sizeof(struct node_ready_message) % 4, 0);
}

TEST(test_outbox) {
    static struct node_outbox_slot slots[3];
    struct node_outbox box;
    uint32_t written = 0, read = 0;
    node_outbox_init(&box, slots, 3);
    assert_null(node_outbox_first(&box));
    for (uint32_t round = 0; round < 100; round++) {
        while (node_outbox_free(&box) > 0) {
            uint8_t *data = node_outbox_open(&box);
            assert_ptr_equal(data, node_outbox_open(&box));
            memcpy(data, &written, sizeof written);
            node_outbox_close(&box, (uint8_t)(1 + written % 9),
                              sizeof written + written % 7);
            written++;
        }
        for (uint32_t n = 1 + round % 3; n > 0; n--) {
            const struct node_outbox_slot *slot = node_outbox_first(&box);
            assert_non_null(slot);
            assert_memory_equal(slot->data, &read, sizeof read);
            assert_int_equal(slot->type, 1 + read % 9);
            assert_int_equal(slot->size, sizeof read + read % 7);
            node_outbox_drop(&box);
            read++;
        }
    }
    assert_int_equal(box.used_max, 3);
    assert_int_equal(written - read, box.used);
}
