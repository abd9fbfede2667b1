/* Routes of cubes of which links and nodes are dead, without any link: every
 * node that can be reached is, over live links, by paths that go up a tree and
 * then down; what is sent to all comes to each once. */

#include "transport/routes.h"
#include "tests/unit/test.h"

enum { NODES_MAX = 1 << CUBE_DIMENSION_MAX };

struct cut_cube {
    unsigned dimension, nodes;
    struct cube_wiring wiring;
    struct routes routes;
    struct routes_altered *memory;
    bool linked[NODES_MAX]; /* to the gateway, by a search of the graph */
    uint64_t random;
    unsigned path_max, altered_max;
};

static uint32_t draw(struct cut_cube *c) {
    c->random ^= c->random << 13;
    c->random ^= c->random >> 7;
    c->random ^= c->random << 17;
    return (uint32_t)(c->random >> 32);
}

static bool live(const struct cut_cube *c, unsigned node, unsigned d) {
    return !wiring_is_dead(&c->wiring, c->wiring.settled, node, d,
                           c->dimension);
}

static void search(struct cut_cube *c) {
    unsigned queue[NODES_MAX], first = 0, end = 0;
    memset(c->linked, 0, sizeof c->linked);
    queue[end++] = c->wiring.gateway;
    c->linked[c->wiring.gateway] = true;
    while (first < end) {
        unsigned node = queue[first++];
        for (unsigned d = 0; d < c->dimension; d++) {
            unsigned other = node ^ 1u << d;
            if (live(c, node, d) && !c->linked[other]) {
                c->linked[other] = true;
                queue[end++] = other;
            }
        }
    }
}

static void open_cube(struct cut_cube *c, unsigned dimension,
                      unsigned gateway) {
    memset(c, 0, sizeof *c);
    c->dimension = dimension;
    c->nodes = 1u << dimension;
    c->random = 88172645463325252u + dimension;
    c->wiring.gateway = (uint16_t)gateway;
    c->memory = malloc(routes_bytes(dimension));
    assert_non_null(c->memory);
    routes_init(&c->routes, c->memory, dimension);
}

static void cut(struct cut_cube *c, unsigned node, unsigned dimension) {
    struct cube_dead dead = {(uint16_t)node, (uint8_t)dimension};
    (void)wiring_add_dead(&c->wiring, dead, c->dimension);
    wiring_settle(&c->wiring, c->dimension);
}

static void mend(struct cut_cube *c) {
    c->wiring.settled = c->wiring.dead_count = 0;
}

/* Up the tree and then down, never up again: `up` and `down` are what one sees
 * of the direction on the way. */
static unsigned walk(const struct cut_cube *c, unsigned from, unsigned to) {
    unsigned node = from, steps = 0;
    bool down = false;
    while (node != to) {
        unsigned d = routes_way(&c->routes, node, to);
        assert_true(d < c->dimension);
        assert_true(live(c, node, d));
        unsigned next = node ^ 1u << d;
        /* A child's way to the gateway leads through its parent. */
        bool to_child = next != c->wiring.gateway &&
                        (next ^ 1u << routes_way(&c->routes, next,
                                                 c->wiring.gateway)) == node;
        assert_true(to_child || !down);
        down = to_child;
        node = next;
        assert_true(++steps < 255);
    }
    return steps;
}

static void check_to_all(struct cut_cube *c, unsigned root) {
    static unsigned queue[NODES_MAX], from[NODES_MAX];
    unsigned first = 0, end = 0;
    unsigned copies[NODES_MAX] = {0};
    queue[end] = root;
    from[end++] = c->dimension;
    while (first < end) {
        unsigned node = queue[first], came = from[first++];
        uint32_t ways = routes_to_all(&c->routes, node, root);
        for (unsigned d = 0; d < c->dimension; d++) {
            if ((ways >> d & 1) != 0 && d != came) {
                assert_true(live(c, node, d) && end < c->nodes);
                copies[node ^ 1u << d]++;
                queue[end] = node ^ 1u << d;
                from[end++] = d;
            }
        }
    }
    for (unsigned i = 0; i < c->nodes; i++)
        assert_int_equal(copies[i], c->linked[i] && i != root);
}

/* All pairs, or as many as `pairs` drawn. */
static void check(struct cut_cube *c, unsigned pairs) {
    unsigned all = c->nodes * c->nodes;
    routes_find(&c->routes, &c->wiring);
    search(c);
    if (c->routes.altered_count > c->altered_max)
        c->altered_max = c->routes.altered_count;
    for (unsigned i = 0; i < c->nodes; i++)
        assert_int_equal(routes_reach(&c->routes, i), c->linked[i]);
    for (unsigned i = 0; i < all && i < pairs; i++) {
        unsigned pair = all <= pairs ? i : draw(c) % all;
        unsigned from = pair & (c->nodes - 1);
        unsigned to = pair >> c->dimension;
        if (from == to)
            continue;
        if (c->linked[from] && c->linked[to]) {
            unsigned steps = walk(c, from, to);
            c->path_max = steps > c->path_max ? steps : c->path_max;
        } else {
            assert_int_equal(routes_way(&c->routes, from, to), ROUTES_NONE);
        }
    }
    unsigned root = draw(c) & (c->nodes - 1);
    if (c->linked[root])
        check_to_all(c, root);
    check_to_all(c, c->wiring.gateway);
}

TEST(while_nothing_is_dead_e_cube) {
    struct cut_cube c;
    open_cube(&c, 6, 0);
    routes_find(&c.routes, &c.wiring);
    search(&c);
    for (unsigned from = 0; from < 64; from++) {
        for (unsigned to = 0; to < 64; to++) {
            if (from != to) {
                unsigned d = routes_way(&c.routes, from, to);
                assert_int_equal((from ^ to) & ((2u << d) - 1), 1u << d);
            }
        }
        check_to_all(&c, from);
    }
    /* A dead wire of the host changes nothing of that. */
    cut(&c, 5, 6);
    routes_find(&c.routes, &c.wiring);
    assert_false(c.routes.tree);
    free(c.memory);
}

TEST(each_single_dead_link_and_node) {
    struct cut_cube c;
    for (unsigned dimension = 1; dimension <= 6; dimension++) {
        for (unsigned gateway = 0; gateway < 1u << dimension;
             gateway += 1 + gateway * 2) {
            open_cube(&c, dimension, gateway);
            for (unsigned node = 0; node < c.nodes; node++) {
                for (unsigned d = 0; d <= dimension; d++) {
                    bool whole = d == dimension;
                    if (whole && node == gateway)
                        continue;
                    cut(&c, node, whole ? CUBE_WHOLE_NODE : d);
                    check(&c, UINT32_MAX);
                    assert_true(dimension == 1 || c.routes.tree);
                    for (unsigned i = 0; i < c.nodes && dimension > 1; i++)
                        assert_true(c.linked[i] || (whole && i == node));
                    mend(&c);
                }
            }
            free(c.memory);
        }
    }
}

TEST(random_sets_of_dead_links_and_nodes) {
    struct cut_cube c;
    for (unsigned dimension = 1; dimension <= CUBE_DIMENSION_MAX; dimension++) {
        open_cube(&c, dimension, 0);
        unsigned rounds = dimension < 7 ? 800 : 4000u >> (dimension - 4);
        for (unsigned round = 0; round < rounds; round++) {
            c.wiring.gateway = (uint16_t)(draw(&c) % c.nodes);
            unsigned count = 1 + draw(&c) % CUBE_DEAD_MAX;
            /* Near one node, or anywhere: the former cut more apart. */
            unsigned centre = draw(&c), mask = draw(&c);
            mask &= draw(&c);
            unsigned nodes = draw(&c) % 4;
            for (unsigned i = 0; i < count; i++) {
                unsigned node = (centre ^ (draw(&c) & mask)) % c.nodes;
                bool whole = draw(&c) % 4 < nodes && node != c.wiring.gateway;
                cut(&c, node, whole ? CUBE_WHOLE_NODE : draw(&c) % dimension);
            }
            check(&c, 300);
            mend(&c);
        }
        assert_true(c.path_max < 64);
        free(c.memory);
    }
}

/* The nodes with the largest subtrees are dead: no set alters more parents. */
TEST(the_table_holds_the_worst) {
    struct cut_cube c;
    for (unsigned dimension = 1; dimension <= CUBE_DIMENSION_MAX; dimension++) {
        unsigned left = CUBE_DEAD_MAX;
        open_cube(&c, dimension, 0);
        for (unsigned size = c.nodes / 2; size > 0; size /= 2)
            for (unsigned node = size; node < c.nodes && left > 0;
                 node += 2 * size, left--)
                cut(&c, node, CUBE_WHOLE_NODE);
        check(&c, 2000);
        assert_true(c.altered_max * sizeof *c.memory <=
                    routes_bytes(dimension));
        free(c.memory);
    }
    assert_true(routes_bytes(CUBE_DIMENSION_MAX) <= 2048);
}
