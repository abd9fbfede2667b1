/* Texts of faults: what a node tells its user. */

#include "node/common.h"
#include "node/message.h"
#include "tests/unit/test.h"

/* A text that is too long is cut, and the first fault stays. */
TEST(fault_texts) {
    static struct node_fault fault;
    char words[NODE_FAULT_TEXT_MAX + 11];
    assert_false(node_fault_is_set(&fault));
    node_fault_set(&fault, "#, # and #", 0, UINT32_MAX);
    assert_string_equal(fault.text, "0, 4294967295 and 4294967295");
    assert_int_equal(fault.size, strlen(fault.text));
    node_fault_set(&fault, "later", 0, 0);
    assert_int_equal(fault.text[0], '0');
    fault.size = 0;
    memset(words, 'x', sizeof words - 1);
    words[sizeof words - 1] = '\0';
    words[NODE_FAULT_TEXT_MAX - 2] = '#';
    node_fault_set(&fault, words, 123, 0);
    assert_int_equal(fault.size, NODE_FAULT_TEXT_MAX);
    assert_string_equal(fault.text + NODE_FAULT_TEXT_MAX - 3, "x12");
}
