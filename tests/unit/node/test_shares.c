/* Tetrahedra on their way from node to node: what room is told for them is
 * there, however they fall on the other nodes, and is enough for a whole star
 * where these are few. */

#include "incode/pages/bricks.h"
#include "node/roles/lending.h"
#include "tests/unit/test.h"

enum { NODES_MAX = 128 };

/* A link that takes nothing, in the place of transport/cube.c. */
int cube_write(struct cube *cube, uint16_t dest, uint8_t type, const void *data,
               size_t size) {
    (void)cube, (void)dest, (void)type, (void)data, (void)size;
    return CUBE_AGAIN;
}

struct scene {
    struct node_setup_message setup;
    struct node_counted counted;
    struct node_shares shares;
    struct incode_front_peers peers;
    void *memory;
};

/* Node 0 of so many, each with one brick, which all regions are known to. */
static void begin(struct scene *s, uint32_t nodes) {
    uint8_t message[sizeof(struct node_regions_message) +
                    (NODES_MAX + 1) * sizeof(uint32_t)];
    struct node_regions_message regions;
    memset(s, 0, sizeof *s);
    memset(&regions, 0, sizeof regions);
    s->setup.nodes = (uint16_t)nodes;
    size_t bytes = (node_shares_bytes(nodes) + 63) / 64 * 64;
    s->memory = aligned_alloc(64, bytes);
    assert_non_null(s->memory);
    node_shares_init(&s->shares, s->memory, &s->setup, &s->counted);
    s->peers = node_shares_peers(&s->shares);
    regions.count = (uint16_t)(nodes + 1);
    memcpy(message, &regions, sizeof regions);
    for (uint32_t i = 0; i <= nodes; i++)
        memcpy(message + sizeof regions + i * sizeof i, &i, sizeof i);
    assert_true(node_shares_regions(&s->shares, message,
                                    sizeof regions + (nodes + 1) * 4));
    assert_true(node_shares_ready(&s->shares));
}

static size_t room_of(const struct scene *s) {
    return s->peers.room(s->peers.context);
}

/* One with vertices of this node and of three that follow `at`, `step` apart.
 */
static void share(const struct scene *s, uint32_t at, uint32_t step) {
    uint32_t others = s->shares.nodes - 1, v[4] = {0};
    for (uint32_t i = 1; i < 4; i++) {
        uint32_t node = 1 + (at + (i - 1) * step) % others;
        v[i] = node * INCODE_BRICK_POINTS + i;
    }
    s->peers.share(s->peers.context, v);
}

/* What is told to be there is: it would break off in mid-share. */
TEST(test_honest) {
    static const uint32_t counts[] = {2, 3, 4, 8, 16, 32, 64, 128};
    for (size_t k = 0; k < sizeof counts / sizeof counts[0]; k++) {
        for (uint32_t step = 1; step < 6; step++) {
            for (uint32_t stride = 0; stride < 40; stride += 3) {
                struct scene s;
                uint32_t at = 0;
                begin(&s, counts[k]);
                for (size_t left; (left = room_of(&s)) > 0;) {
                    size_t now = step % 2 != 0 ? left : (left + 1) / 2;
                    for (; now > 0; now--) {
                        share(&s, at, step);
                        at += stride;
                    }
                }
                assert_true(s.shares.used > NODE_SHARE_BATCHES / 4);
                free(s.memory);
            }
        }
    }
}

/* A star, of up to INCODE_STAR_BUILT tetrahedra, is not cut short where it has
 * not to be. */
TEST(test_enough) {
    struct scene s;
    begin(&s, 1);
    assert_true(room_of(&s) >= 256);
    free(s.memory);
    begin(&s, 2);
    assert_true(room_of(&s) >= 256);
    for (int i = 0; i < 40 * NODE_SHARES_A_BATCH; i++)
        share(&s, 0, 0);
    assert_true(room_of(&s) >= 7 * NODE_SHARES_A_BATCH);
    free(s.memory);
    begin(&s, 8);
    assert_true(room_of(&s) >= 256);
    free(s.memory);
}
