/* What the strategy exchange tells all nodes, once they have their role: whose
 * bricks are whose, and the pages that each has room for. */
#include "begun_strategy.h"
#include "node/page_check.h"

enum { PAGE_KEY = 0x5eed };

/* What all nodes have been told: regions, then pages from the last one down. */
static struct {
    uint32_t first[NODES + 1], known;
    uint32_t to_all, page;
    bool refuse;
} told;

static bool write_to_all(void *context, uint8_t type, const void *data,
                         size_t size) {
    struct node_regions_message head;
    struct node_page_message page;
    (void)context;
    if (told.refuse)
        return false;
    if (type == NODE_PAGE_TO_ALL) {
        assert_int_equal(told.known, NODES + 1);
        memcpy(&told.page, data, sizeof told.page);
        page.head.page = told.page;
        assert_int_equal(
            size, node_page_seal(&page, PAGE_KEY,
                                 host_page(&order, told.page, page.data)));
        assert_memory_equal(data, &page, size);
        return true;
    }
    assert_int_equal(type, NODE_REGIONS);
    assert_true(size >= sizeof head);
    memcpy(&head, data, sizeof head);
    assert_int_equal(size, sizeof head + 4 * (size_t)head.count);
    assert_int_equal(head.first, told.known);
    assert_true(told.known + head.count <= NODES + 1);
    memcpy(told.first + head.first, (const uint8_t *)data + sizeof head,
           4 * (size_t)head.count);
    told.known += head.count;
    told.to_all = told.page = head.to_all;
    return true;
}

/* Pages that go to all where each node has room for so many. */
static void goes_to_all(uint32_t frames, uint32_t first) {
    const struct host_strategy *s = &host_exchange;
    struct incode_job job;
    uint32_t pages = order.tree.pages;
    s->lose(&work);
    memset(&told, 0, sizeof told);
    work.frames = frames;
    assert_false(s->send(&work, 1)); /* not before all have their role */
    assert_true(s->first(&work, 0, &job));
    told.refuse = true;
    assert_false(s->send(&work, 2));
    told.refuse = false;
    assert_true(s->send(&work, 3));
    assert_int_equal(told.to_all, first);
    while (pages > first) {
        assert_true(s->send(&work, pages % NODES));
        assert_int_equal(told.page, --pages);
    }
    assert_false(s->send(&work, 0));
    assert_int_equal(told.known, NODES + 1);
    for (unsigned k = 0; k < NODES; k++)
        assert_int_equal(told.first[k], order.region[k].first);
    assert_int_equal(told.first[NODES], order.bricks);
}

/* All exchange, and are told all regions and what pages each has room for,
 * once; after a loss they work by themselves, and hear nothing of them. */
TEST(test_exchange) {
    const struct host_strategy *s = &host_exchange;
    struct incode_job job;
    struct node_setup_message setup = {.setup.build = INCODE_BUILD_AUTO};
    struct host_error error = {0};
    begin(s);
    assert_int_equal(s->check(NODES, &work.sharing, INCODE_FACE_OWN, &error),
                     0);
    assert_int_equal(s->check(NODES, &work.sharing, INCODE_FACE_PAPER, &error),
                     HOST_USAGE);
    work.write_to_all = write_to_all;
    work.page_key = PAGE_KEY;
    work.goes_round = true; /* dead links */
    assert_string_equal(roles(s), "wwww");
    work.goes_round = false;
    assert_string_equal(roles(s), "eeee");
    s->set_up(&work, 1, &setup);
    assert_int_equal(s->owner_rule, INCODE_OWNER_LOWEST);
    assert_int_equal(setup.setup.build, INCODE_BUILD_FACES);
    const struct incode_tree *tree = &order.tree;
    assert_int_equal(tree->levels, 3);
    goes_to_all(tree->pages, 0);
    goes_to_all(tree->pages - 1, tree->base[1]);
    goes_to_all(2 * (tree->pages - tree->base[1]), tree->base[1]);
    goes_to_all(2 * (tree->pages - tree->base[1]) - 1, tree->base[2]);
    goes_to_all(1, tree->pages);
    /* All start again, and nothing is done: once more.  What is to be sent to
     * all still is when bricks are committed. */
    s->lose(&work);
    memset(&told, 0, sizeof told);
    work.frames = tree->pages;
    assert_string_equal(roles(s), "eeee");
    for (unsigned i = 0; i < NODES; i++) {
        assert_true(s->first(&work, i, &job));
        (void)give(i, &job);
    }
    assert_int_equal(s->commit(&work, 3, order.region[3].first), 0);
    assert_true(s->send(&work, 1));
    assert_true(s->send(&work, 1));
    assert_int_equal(told.page, tree->pages - 1);
    lose(s, 0);
    assert_string_equal(roles(s), "wwww");
    assert_false(s->send(&work, 1));
    assert_false(s->first(&work, 1, &job));
    assert_false(s->send(&work, 1));
    assert_true(s->next(&work, 1, &job));
    end();
}

TEST_GROUP(set_up, tear_down)
