/* The check of a whole result at both depths, in the order of a run: right
 * results pass in any order of tetrahedra, each kind of damage is found at each
 * kind of place, and whoever listens hears of the vertices where true
 * tetrahedra are missing. */
#include "tests/unit/host/verify/check_world.h"

/* --- Checking ------------------------------------------------------------- */

/* Whether no point is beyond a facet, by trying all. */
static bool is_of_hull(const struct fixture *f, const uint32_t p[3]) {
    for (uint32_t v = 0; v < f->sites.count; v++) {
        const uint32_t t[4] = {p[0], p[1], p[2], v};
        if (host_site_is_vertex(&f->sites, v) && orientation(f, t) > 0)
            return false;
    }
    return true;
}

/* Whether tetrahedra are all around v, as far as the hull goes. */
static bool is_whole(const struct fixture *f, uint32_t v) {
    bool used = false;
    for (uint64_t i = 0; i < f->tets.count; i++) {
        const uint32_t *t = f->tets.v[i];
        if (!is_row(f, t) || (t[0] != v && t[1] != v && t[2] != v && t[3] != v))
            continue;
        used = true;
        for (uint32_t c = 0; c < 4; c++) {
            uint32_t p[3];
            host_facet_outward(t, c, p);
            const uint32_t twin[3] = {p[0], p[2], p[1]};
            if (t[c] != v && !has_facet(f, twin) && !is_of_hull(f, p))
                return false;
        }
    }
    return used;
}

/* What the interface promises of a tetrahedron that is missing. */
static void expect_named(const struct fixture *f, const uint32_t t[4]) {
    for (int k = 0; k < 4; k++)
        if (!f->named[t[k]] && !is_whole(f, t[k]))
            fail_msg("vertex %u of a missing tetrahedron is not named", t[k]);
}

/* Both depths find a fault and name the place of what is missing. */
static void expect_found(struct fixture *f, const char *damage,
                         const uint32_t (*missing)[4], uint64_t count) {
    for (int depth = 0; depth < 2; depth++) {
        struct host_check_report r;
        if (check(f, (enum host_check_depth)depth, &r) != HOST_UNVERIFIED)
            fail_msg("depth %d: not found: %s", depth, damage);
        for (uint64_t i = 0; i < count; i++)
            expect_named(f, missing[i]);
    }
    restore(f);
}

/* --- The sets ------------------------------------------------------------- */

static void passes(struct fixture *f) {
    for (int round = 0; round < 4; round++) {
        struct host_check_report r;
        assert_int_equal(check(f, (enum host_check_depth)(round % 2), &r), 0);
        assert_int_equal(r.tetrahedra, f->right.count);
        assert_int_equal(r.distinct, f->order.points);
        assert_int_equal(r.hull_facets, 2 * r.hull_vertices - 4);
        assert_string_equal(r.text, "");
        restore(f);
    }
}

TEST(right_results_pass) {
    for_each_set(passes);
}

/* The kinds of place: at the hull, across bricks, inside one brick. */
static int kind_of(const struct fixture *f, const uint32_t t[4]) {
    for (uint32_t c = 0; c < 4; c++) {
        uint32_t p[3];
        host_facet_outward(t, c, p);
        if (is_of_hull(f, p))
            return 0;
    }
    uint32_t brick = t[0] / INCODE_BRICK_POINTS;
    return t[1] / INCODE_BRICK_POINTS == brick &&
                   t[2] / INCODE_BRICK_POINTS == brick &&
                   t[3] / INCODE_BRICK_POINTS == brick
               ? 2
               : 1;
}

/* Calls for a few tetrahedra of each kind; indices into `tets`. */
static void at_each_place(struct fixture *f,
                          void (*function)(struct fixture *f, uint64_t i)) {
    enum { EACH = 6 };
    int left[3] = {EACH, EACH, EACH};
    for (int tries = 0; tries < 400 && left[0] + left[1] + left[2] > 0;
         tries++) {
        uint64_t i = draw(f, f->tets.count);
        int kind = kind_of(f, f->tets.v[i]);
        if (left[kind] > 0) {
            left[kind]--;
            function(f, i);
        }
    }
}

/* --- Damage to one tetrahedron -------------------------------------------- */

static void drop(struct fixture *f, uint64_t i) {
    uint32_t t[1][4];
    memcpy(t, f->tets.v[i], sizeof t);
    cut(&f->tets, i);
    expect_found(f, "dropped", (const uint32_t(*)[4])t, 1);
}

static void repeat(struct fixture *f, uint64_t i) {
    uint32_t t[4];
    memcpy(t, f->tets.v[i], sizeof t);
    append(&f->tets, t);
    expect_found(f, "repeated", NULL, 0);
}

static void repeat_often(struct fixture *f, uint64_t i) {
    uint32_t t[4];
    memcpy(t, f->tets.v[i], sizeof t);
    for (int k = 0; k < 3; k++)
        append(&f->tets, t);
    expect_found(f, "four times", NULL, 0);
}

static void turn(struct fixture *f, uint64_t i) {
    uint32_t t[1][4];
    memcpy(t, f->tets.v[i], sizeof t);
    f->tets.v[i][2] = t[0][3];
    f->tets.v[i][3] = t[0][2];
    expect_found(f, "turned", (const uint32_t(*)[4])t, 1);
}

static void exchange(struct fixture *f, uint64_t i) {
    for (int k = 0; k < 4; k++) {
        uint32_t t[1][4], wrong = (uint32_t)draw(f, f->sites.count);
        memcpy(t, f->tets.v[i], sizeof t);
        if (wrong == t[0][0] || wrong == t[0][1] || wrong == t[0][2] ||
            wrong == t[0][3])
            continue;
        f->tets.v[i][k] = wrong;
        expect_found(f, "exchanged", (const uint32_t(*)[4])t, 1);
    }
}

/* A positive tetrahedron that does not belong there. */
static void invent(struct fixture *f, uint64_t i) {
    uint32_t t[4];
    (void)i;
    for (int tries = 0; tries < 100; tries++) {
        for (int k = 0; k < 4; k++)
            t[k] = (uint32_t)draw(f, f->sites.count);
        if (is_row(f, t)) {
            append(&f->tets, t);
            expect_found(f, "invented", NULL, 0);
            return;
        }
    }
}

static void out_of_range(struct fixture *f, uint64_t i) {
    for (int k = 0; k < 4; k++) {
        uint32_t t[1][4];
        memcpy(t, f->tets.v[i], sizeof t);
        f->tets.v[i][k] = (uint32_t)(f->sites.count + draw(f, 1u << 20));
        expect_found(f, "out of range", (const uint32_t(*)[4])t, 1);
    }
}

/* The last point of a brick that is not full stands in all slots beyond. */
static void unused_slot(struct fixture *f, uint64_t i) {
    uint32_t t[1][4];
    memcpy(t, f->tets.v[i], sizeof t);
    for (int k = 0; k < 4; k++) {
        uint32_t fill = f->order.fill[t[0][k] / INCODE_BRICK_POINTS];
        if (t[0][k] % INCODE_BRICK_POINTS + 1 == fill &&
            fill < INCODE_BRICK_POINTS) {
            struct host_check_report r;
            f->tets.v[i][k]++;
            assert_int_equal(check(f, HOST_CHECK_TILING, &r), HOST_UNVERIFIED);
            assert_non_null(strstr(r.text, "has a vertex that is no point"));
            expect_found(f, "unused slot", (const uint32_t(*)[4])t, 1);
            return;
        }
    }
}

static void single(struct fixture *f) {
    void (*const damage[])(struct fixture *, uint64_t) = {
        drop,   repeat,       repeat_often, turn,
        invent, out_of_range, exchange,     unused_slot};
    for (size_t i = 0; i < sizeof damage / sizeof *damage; i++)
        at_each_place(f, damage[i]);
}

TEST(damage_is_found) {
    for_each_set(single);
}

/* --- Damage to more ------------------------------------------------------- */

static void drop_all_at(struct fixture *f, uint32_t first, uint32_t last) {
    struct host_tetrahedra missing = {0};
    for (uint64_t i = f->tets.count; i-- > 0;) {
        const uint32_t *t = f->tets.v[i];
        bool gone = false;
        for (int k = 0; k < 4; k++)
            gone = gone || (t[k] >= first && t[k] < last);
        if (gone) {
            append(&missing, t);
            cut(&f->tets, i);
        }
    }
    if (missing.count > 0) {
        expect_found(f, "many dropped", (const uint32_t(*)[4])missing.v,
                     missing.count);
    }
    host_tetrahedra_free(&missing);
}

static void drop_bricks(struct fixture *f) {
    for (uint32_t b = 0; b < f->order.bricks; b += 3)
        drop_all_at(f, b * INCODE_BRICK_POINTS, (b + 1) * INCODE_BRICK_POINTS);
    for (uint32_t i = 0; i < 8; i++) {
        uint32_t v = (uint32_t)draw(f, f->sites.count);
        drop_all_at(f, v, v + 1);
    }
}

TEST(missing_bricks_are_found) {
    for_each_set(drop_bricks);
}

/* Without all tetrahedra that a vertex owns (its lowest), as a node commits
 * them. */
static void drop_owned(struct fixture *f) {
    for (int round = 0; round < 8; round++) {
        struct host_tetrahedra missing = {0};
        uint32_t owner = f->tets.v[draw(f, f->tets.count)][0];
        for (uint64_t i = f->tets.count; i-- > 0;) {
            const uint32_t *t = f->tets.v[i];
            if ((t[0] == owner || t[1] == owner || t[2] == owner ||
                 t[3] == owner) &&
                t[0] >= owner && t[1] >= owner && t[2] >= owner &&
                t[3] >= owner) {
                append(&missing, t);
                cut(&f->tets, i);
            }
        }
        if (missing.count > 0) {
            expect_found(f, "owned dropped", (const uint32_t(*)[4])missing.v,
                         missing.count);
        }
        host_tetrahedra_free(&missing);
    }
}

TEST(missing_stars_are_found) {
    for_each_set(drop_owned);
}

/* All of it twice: every sum is twice what it was. */
static void twice(struct fixture *f) {
    for (uint64_t i = 0; i < f->right.count; i++)
        append(&f->tets, f->right.v[i]);
    expect_found(f, "everything twice", NULL, 0);
}

TEST(whole_repeats_are_found) {
    for_each_set(twice);
}

TEST(nothing_is_found) {
    struct fixture f;
    struct host_check_report r;
    open_set(&f, "uniform", 100, 1);
    host_tetrahedra_cut(&f.tets, 0);
    assert_int_equal(check(&f, HOST_CHECK_TILING, &r), HOST_UNVERIFIED);
    assert_int_equal(r.faults, 101); /* and no hull */
    close_set(&f);
}

/* --- Garbage -------------------------------------------------------------- */

TEST(garbage_is_refused) {
    struct fixture f;
    open_set(&f, "grid", 125, 3);
    for (int round = 0; round < 500; round++) {
        struct host_check_report r;
        host_tetrahedra_cut(&f.tets, 0);
        for (int i = 0; i < 1 + round % 100; i++) {
            uint32_t t[4];
            for (int k = 0; k < 4; k++)
                t[k] = (uint32_t)draw(&f, f.sites.count + 1);
            append(&f.tets, t);
        }
        assert_int_equal(check(&f, (enum host_check_depth)(round % 2), &r),
                         HOST_UNVERIFIED);
    }
    close_set(&f);
}

/* The listener hears of no more than it asked for, and the report counts
 * all. */
static void hear_few(void *context, const uint64_t *tets, int tet_count,
                     const uint32_t *vertices, int count, const char *what) {
    (void)tets, (void)tet_count, (void)vertices, (void)count, (void)what;
    ++*(int *)context;
}

TEST(faults_are_bounded) {
    struct fixture f;
    struct host_check_report r;
    open_set(&f, "uniform", 300, 2);
    for (uint64_t most = 0; most < 40; most += 13) {
        struct host_error error = {0};
        int heard = 0;
        struct host_check_listener listener = {&heard, most, hear_few};
        host_tetrahedra_cut(&f.tets, 5);
        assert_int_equal(host_check(&f.sites, &f.tets, HOST_CHECK_TILING,
                                    &listener, &r, &error),
                         HOST_UNVERIFIED);
        assert_int_equal(heard, most);
        assert_true(r.faults > 100);
        int lines = 0;
        for (const char *at = r.text; *at != 0; at++)
            lines += *at == '\n';
        assert_int_equal(lines, 8);
    }
    close_set(&f);
}
