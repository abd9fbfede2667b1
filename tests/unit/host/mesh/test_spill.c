/* Spilled faces come back in order, brick by brick, from memory and from the
 * temporary file alike; against a plain model of lists. */

#include "host/mesh/spill.h"
#include "tests/unit/test.h"

enum { NODES = 3, BRICKS = 40, FACES_MAX = 4000 };

struct model {
    struct incode_face faces[NODES][BRICKS][FACES_MAX];
    uint32_t count[NODES][BRICKS];
};

static uint64_t state = 88172645463325252u;

static uint32_t draw(uint32_t below) {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (uint32_t)(state >> 32) % below;
}

static void put_some(struct host_spill *spill, struct model *model,
                     struct host_error *error) {
    struct incode_face faces[128];
    uint32_t node = draw(NODES), count = draw(129), kept = 0;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t brick = draw(BRICKS);
        uint32_t *n = &model->count[node][brick];
        if (*n < FACES_MAX) {
            struct incode_face face = {
                {64 * brick + draw(64), draw(1000), draw(1000)}};
            model->faces[node][brick][(*n)++] = face;
            faces[kept++] = face;
        }
    }
    assert_int_equal(host_spill_put(spill, node, faces, kept, error), 0);
}

static void take_some(struct host_spill *spill, struct model *model,
                      struct host_error *error) {
    struct incode_face faces[100];
    uint32_t node = draw(NODES), brick = draw(BRICKS), seen = 0, count;
    struct host_spill_list list = host_spill_detach(spill, node, brick);
    assert_int_equal(list.faces, model->count[node][brick]);
    do {
        uint32_t max = 1 + draw(100);
        assert_int_equal(
            host_spill_take(spill, &list, faces, max, &count, error), 0);
        assert_memory_equal(faces, &model->faces[node][brick][seen],
                            count * sizeof faces[0]);
        seen += count;
    } while (list.faces > 0);
    assert_int_equal(seen, model->count[node][brick]);
    model->count[node][brick] = 0;
}

static void run(uint32_t blocks_memory) {
    static struct model model;
    struct host_spill spill;
    struct host_error error = {0};
    memset(&model, 0, sizeof model);
    assert_int_equal(host_spill_init(&spill, blocks_memory, &error), 0);
    for (uint32_t round = 0; round < 3000; round++)
        if (draw(4) != 0)
            put_some(&spill, &model, &error);
        else
            take_some(&spill, &model, &error);
    for (uint32_t round = 0; round < 3000; round++)
        take_some(&spill, &model, &error);
    host_spill_free(&spill);
}

TEST(test_in_memory) {
    run(0);
}

TEST(test_in_file) {
    run(1);
    run(300);
}

/* A list taken out is apart from what is put afterwards. */
TEST(test_detached) {
    struct host_spill spill;
    struct host_error error = {0};
    struct incode_face first = {{64, 1, 2}}, second = {{65, 3, 4}}, got;
    uint32_t count;
    assert_int_equal(host_spill_init(&spill, 0, &error), 0);
    assert_int_equal(host_spill_put(&spill, 0, &first, 1, &error), 0);
    struct host_spill_list list = host_spill_detach(&spill, 0, 1);
    assert_int_equal(host_spill_put(&spill, 0, &second, 1, &error), 0);
    assert_int_equal(host_spill_take(&spill, &list, &got, 1, &count, &error),
                     0);
    assert_int_equal(count, 1);
    assert_memory_equal(&got, &first, sizeof got);
    assert_int_equal(list.faces, 0);
    list = host_spill_detach(&spill, 0, 1);
    assert_int_equal(list.faces, 1);
    assert_int_equal(host_spill_take(&spill, &list, &got, 1, &count, &error),
                     0);
    assert_memory_equal(&got, &second, sizeof got);
    assert_int_equal(host_spill_detach(&spill, 1, 1).faces, 0);
    assert_int_equal(host_spill_detach(&spill, 0, 77).faces, 0);
    host_spill_free(&spill);
}

/* Marks of a vertex that come many times over are one; they come back before
 * the faces, and the faces of one node can be seen without taking them. */
TEST(test_marks) {
    struct host_spill spill;
    struct host_error error = {0};
    struct host_tetrahedra faces = {0};
    struct incode_face got[8];
    const struct incode_face face = {{64, 1, 2}},
                             low = {{64, INCODE_NONE, INCODE_NONE}},
                             high = {{127, INCODE_NONE, INCODE_NONE}};
    uint32_t count;
    assert_int_equal(host_spill_init(&spill, 0, &error), 0);
    for (int i = 0; i < 1000; i++) {
        assert_int_equal(host_spill_put(&spill, 3, &high, 1, &error), 0);
        assert_int_equal(host_spill_put(&spill, 3, &low, 1, &error), 0);
    }
    assert_int_equal(host_spill_put(&spill, 3, &face, 1, &error), 0);
    assert_int_equal(host_spill_put(&spill, 4, &face, 1, &error), 0);
    assert_int_equal(spill.faces, 4);
    assert_int_equal(spill.blocks_used, 2);
    assert_int_equal(host_spill_copy(&spill, 3, &faces, &error), 0);
    assert_int_equal(faces.count, 1);
    assert_memory_equal(faces.v[0], &face, sizeof face);
    assert_int_equal(faces.v[0][3], INCODE_NONE);
    host_tetrahedra_free(&faces);
    struct host_spill_list list = host_spill_detach(&spill, 3, 1);
    assert_int_equal(list.faces, 3);
    assert_int_equal(host_spill_take(&spill, &list, got, 1, &count, &error), 0);
    assert_memory_equal(got, &low, sizeof low);
    assert_int_equal(host_spill_take(&spill, &list, got, 8, &count, &error), 0);
    assert_int_equal(count, 2);
    assert_memory_equal(&got[0], &high, sizeof high);
    assert_memory_equal(&got[1], &face, sizeof face);
    assert_int_equal(list.faces, 0);
    assert_int_equal(spill.faces, 1);
    host_spill_free(&spill);
}
