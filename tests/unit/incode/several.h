/* Several triangulators that share one active face list, on no cube: each a
 * solo.h of its own, and what they tell each other arrives in any order, drawn
 * from a seed.  When all are quiet they try first tetrahedra, once. */
#ifndef TESTS_UNIT_SEVERAL_H
#define TESTS_UNIT_SEVERAL_H

#include "incode/lending.h"
#include "solo.h"

enum {
    SEVERAL_NODES = 128,
    SEVERAL_STEPS = 100000000,
    SEVERAL_LOANS = 4 /* at a time */
};

struct several_node {
    struct solo solo;
    struct several *all;
    bool has_work; /* a region with points */
    bool finished;
};

struct several_share {
    uint32_t to, v[4];
};

struct several {
    struct solo solo; /* as all are; the digest and the tetrahedra of all */
    uint64_t seed;    /* of the order in which things happen */
    bool one_by_one;  /* room for little to share at a time */
    bool lends;       /* they close stars for each other, whoever is quiet */

    uint64_t lent, late, hulls_found, elsewhere_found; /* answers to loans */
    uint64_t built, kept, foreign, seeds, sent, spilled;

    struct several_node *node; /* [solo.regions] */
    struct several_share *share;
    size_t share_count, share_room;
    struct several_loan {
        bool open;
        uint32_t lender, helper, used;
        struct incode_loan loan;
        struct incode_borrower borrower;
    } loan[SEVERAL_LOANS];
};

static inline uint32_t several_draw(struct several *all, uint32_t below) {
    all->seed ^= all->seed << 13;
    all->seed ^= all->seed >> 7;
    all->seed ^= all->seed << 17;
    return (uint32_t)((all->seed >> 32) % below);
}

static inline size_t several_room(void *context) {
    struct several_node *node = context;
    return node->all->one_by_one ? several_draw(node->all, 60) : 4096;
}

static inline void several_put(struct several *all, uint32_t to,
                               const uint32_t v[4]) {
    if (all->share_count == all->share_room) {
        all->share_room = 2 * all->share_room + 1024;
        all->share = realloc(all->share, all->share_room * sizeof *all->share);
        assert_non_null(all->share);
    }
    struct several_share *share = &all->share[all->share_count++];
    share->to = to;
    memcpy(share->v, v, sizeof share->v);
    all->sent++;
}

static inline uint32_t several_region(const struct several *all, uint32_t v) {
    const struct host_order *order = &all->solo.order;
    uint32_t r = 0;
    while (v / INCODE_BRICK_POINTS >= order->region[r].last)
        r++;
    return r;
}

static inline void several_share(void *context, const uint32_t v[4]) {
    struct several_node *node = context;
    struct several *all = node->all;
    uint32_t self = (uint32_t)(node - all->node), to[4];
    for (unsigned i = 0; i < (v[3] == INCODE_NONE ? 3 : 4); i++) {
        to[i] = several_region(all, v[i]);
        bool told = to[i] == self;
        for (unsigned k = 0; k < i; k++)
            told = told || to[k] == to[i];
        if (!told)
            several_put(all, to[i], v);
    }
}

static inline void several_open(struct several *all, const double *xyz,
                                uint64_t n) {
    assert_in_range(all->solo.regions, 1, SEVERAL_NODES);
    all->solo.owner_rule = INCODE_OWNER_LOWEST;
    solo_order(&all->solo, xyz, n);
    all->node = calloc(all->solo.regions, sizeof *all->node);
    assert_non_null(all->node);
    for (uint32_t i = 0; i < all->solo.regions; i++) {
        struct several_node *node = &all->node[i];
        const struct incode_front_peers peers = {node, several_room,
                                                 several_share};
        node->all = all;
        memcpy(&node->solo, &all->solo, offsetof(struct solo, pages));
        node->solo.chance =
            all->solo.chance == 0 ? 0 : all->solo.chance + i + 1;
        solo_make(&node->solo, &peers);
        const struct host_region *r = &all->solo.order.region[i];
        node->has_work = r->first < r->last;
        node->finished = !node->has_work;
        node->solo.wanted = INCODE_NONE;
        if (node->has_work)
            solo_start(&node->solo, i);
    }
}

/* One of those under way arrives. */
static inline void several_deliver(struct several *all) {
    uint32_t i = several_draw(all, (uint32_t)all->share_count);
    struct several_share share = all->share[i];
    if (!incode_triangulator_may_take(all->node[share.to].solo.t, 1))
        return;
    all->share[i] = all->share[--all->share_count];
    assert_int_equal(
        incode_triangulator_take(all->node[share.to].solo.t, share.v), 0);
}

/* What is found of a loan: some of it is of the hull, some another's. */
static inline void several_count_found(struct several *all,
                                       const struct several_loan *loan) {
    const struct incode_found *found = &loan->borrower.found;
    for (uint32_t i = 0; i < found->count; i++) {
        const uint32_t *v = found->v[i];
        uint32_t brick = v[incode_lowest(v, 4)] / INCODE_BRICK_POINTS;
        all->hulls_found += v[3] == INCODE_NONE;
        all->elsewhere_found +=
            brick < loan->loan.first || brick >= loan->loan.last;
    }
}

/* Whoever is drawn lends to another, unless that has borrowed already. */
static inline void several_lend(struct several *all,
                                struct several_loan *loan) {
    uint32_t n = all->solo.regions;
    loan->lender = several_draw(all, n);
    loan->helper = several_draw(all, n);
    for (uint32_t i = 0; i < SEVERAL_LOANS; i++)
        if (all->loan[i].open && all->loan[i].helper == loan->helper)
            return;
    struct incode_triangulator *helper = all->node[loan->helper].solo.t;
    if (loan->lender == loan->helper ||
        !incode_triangulator_lend(all->node[loan->lender].solo.t, &loan->loan))
        return;
    assert_true(incode_loan_is_sound(&loan->loan, all->solo.order.bricks));
    loan->open = true;
    loan->used = 0;
    incode_borrower_begin(&loan->borrower, helper, &loan->loan);
}

/* A step of what is lent, here or there. */
static inline void several_go_on(struct several *all,
                                 struct several_loan *loan) {
    struct solo *helper = &all->node[loan->helper].solo;
    struct incode_triangulator *lender = all->node[loan->lender].solo.t;
    struct incode_borrower *b = &loan->borrower;
    enum incode_step r;
    if (!b->done) {
        r = incode_borrower_step(b, helper->t, several_draw(all, 30));
        if (r == INCODE_WAITING)
            (void)solo_deliver(helper);
        assert_int_not_equal(r, INCODE_BROKEN);
        return;
    }
    if (several_draw(all, 8) != 0)
        return;
    assert_true(incode_found_is_sound(&b->found, all->solo.order.bricks));
    r = incode_triangulator_use(lender, &loan->loan, &b->found, &loan->used,
                                several_draw(all, 30));
    assert_int_not_equal(r, INCODE_BROKEN);
    loan->open = r != INCODE_FINISHED;
    if (!loan->open)
        several_count_found(all, loan);
}

static inline bool several_is_quiet(const struct several *all) {
    if (all->share_count > 0)
        return false;
    for (uint32_t i = 0; i < all->solo.regions; i++)
        if (all->node[i].has_work &&
            !incode_triangulator_is_quiet(all->node[i].solo.t))
            return false;
    return true;
}

static inline void several_finish(struct several *all, uint32_t i) {
    struct several_node *node = &all->node[i];
    node->finished = true;
    for (uint32_t b = 0; b < all->solo.order.bricks; b++) {
        bool own = b >= node->solo.job.first && b < node->solo.job.last;
        assert_int_equal(node->solo.committed[b], own);
    }
    assert_int_equal(node->solo.t->front.afl.count, 0);
    assert_int_equal(node->solo.face_count, 0);
}

/* Until all are finished. */
static inline void several_work(struct several *all) {
    uint32_t left = 0, n = all->solo.regions;
    bool seeded = false;
    for (uint32_t i = 0; i < n; i++)
        left += !all->node[i].finished;
    for (uint64_t steps = 0; left > 0; steps++) {
        assert_in_range(steps, 0, SEVERAL_STEPS);
        if (all->share_count > 0 && several_draw(all, 3) == 0)
            several_deliver(all);
        struct several_loan *loan = &all->loan[steps % SEVERAL_LOANS];
        if (loan->open)
            several_go_on(all, loan);
        else if (all->lends)
            several_lend(all, loan);
        uint32_t i = several_draw(all, n);
        if (!all->node[i].finished && solo_step(&all->node[i].solo, 1)) {
            several_finish(all, i);
            left--;
        }
        if (left > 0 && steps % 64 == 0 && several_is_quiet(all)) {
            assert_false(seeded); /* or it is stuck */
            seeded = true;
            for (i = 0; i < n; i++)
                if (!all->node[i].finished)
                    incode_triangulator_seed(all->node[i].solo.t);
        }
    }
    assert_int_equal(all->share_count, 0);
    for (uint32_t i = 0; i < SEVERAL_LOANS; i++)
        assert_false(all->loan[i].open);
}

static inline void several_gather(struct several *all) {
    struct host_error error = {0};
    for (uint32_t i = 0; i < all->solo.regions; i++) {
        struct solo *s = &all->node[i].solo;
        uint32_t(*v)[4] =
            host_tetrahedra_room(&all->solo.tets, s->tets.count + 1, &error);
        assert_non_null(v);
        if (s->tets.count > 0)
            memcpy(v, s->tets.v, s->tets.count * sizeof *v);
        host_tetrahedra_keep(&all->solo.tets, s->tets.count);
        const struct incode_front_counts *counts = &s->t->front.counts;
        all->built += counts->built;
        all->kept += counts->kept;
        all->foreign += counts->foreign;
        all->lent += counts->lent;
        all->late += counts->late;
        all->seeds += counts->seeds;
        all->spilled += counts->spilled;
    }
    assert_int_equal(all->kept, all->solo.tets.count);
    assert_int_equal(all->built, all->kept + all->foreign + all->late);
    host_tetrahedra_map(&all->solo.tets, all->solo.order.row);
    host_tetrahedra_sort(&all->solo.tets);
    host_digest(&all->solo.tets, &all->solo.digest);
}

static inline void several_run(struct several *all, const double *xyz,
                               uint64_t n) {
    several_open(all, xyz, n);
    several_work(all);
    several_gather(all);
}

static inline void several_close(struct several *all) {
    for (uint32_t i = 0; i < all->solo.regions; i++) {
        struct solo *s = &all->node[i].solo;
        for (size_t k = 0; k < SOLO_GUARD; k++)
            assert_int_equal(s->arena[s->memory + k], 0xa5);
        free(s->arena);
        free(s->committed);
        free(s->face);
        host_tetrahedra_free(&s->tets);
    }
    free(all->node);
    free(all->share);
    host_order_free(&all->solo.order);
    host_tetrahedra_free(&all->solo.tets);
}

#endif
