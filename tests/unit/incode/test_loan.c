/* Stars that are lent: the triangulation is the same whoever finds their
 * tetrahedra and whenever these come, and each is built once. */

#include "host/mesh/gen.h"
#include "several.h"
#include "tests/unit/test.h"

/* One region, or more, of points of that kind. */
static void open_set(struct several *all, const char *kind, uint64_t points,
                     uint32_t regions) {
    struct host_points p = {0};
    struct host_error error = {0};
    *all = (struct several){.seed = 11,
                            .solo = {.index = INCODE_KD, .regions = regions}};
    if (host_gen(kind, points, 5, &p, &error) != 0)
        fail_msg("%s", error.text);
    several_open(all, p.xyz, p.count);
    host_points_free(&p);
}

/* Steps of the first one, until it can lend. */
static struct incode_triangulator *until_lent(struct several *all,
                                              struct incode_loan *loan) {
    struct incode_triangulator *t = all->node[0].solo.t;
    while (!incode_triangulator_lend(t, loan))
        assert_false(solo_step(&all->node[0].solo, 1));
    return t;
}

/* Whoever has the points finds what is asked, by a triangulator that has no
 * part in it otherwise. */
static void find(struct several *all, uint32_t helper,
                 const struct incode_loan *loan, struct incode_borrower *b) {
    struct solo *solo = &all->node[helper].solo;
    enum incode_step r = INCODE_WORKED;
    incode_borrower_begin(b, solo->t, loan);
    while (r != INCODE_FINISHED) {
        r = incode_borrower_step(b, solo->t, 5);
        assert_int_not_equal(r, INCODE_BROKEN);
        if (r == INCODE_WAITING)
            assert_true(solo_deliver(solo));
    }
    assert_true(incode_found_is_sound(&b->found, all->solo.order.bricks));
}

/* All kinds of answers come, most of them in time. */
TEST(all_kinds) {
    static struct several with, without;
    static const char *const kinds[] = {"uniform", "sphere", "bluntfin"};
    uint64_t hulls = 0, elsewhere = 0, late = 0;
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        open_set(&without, kinds[i], 3000, 4);
        several_work(&without);
        several_gather(&without);
        open_set(&with, kinds[i], 3000, 4);
        with.lends = true;
        several_work(&with);
        several_gather(&with);
        assert_string_equal(with.solo.digest.text, without.solo.digest.text);
        assert_int_equal(without.lent + without.late, 0);
        assert_true(with.lent > 0);
        assert_in_range(with.late, 0, with.kept / 5);
        hulls += with.hulls_found;
        elsewhere += with.elsewhere_found;
        late += with.late;
        several_close(&with);
        several_close(&without);
    }
    assert_true(hulls > 0 && elsewhere > 0 && late > 0);
}

/* What comes a second time builds nothing. */
TEST(too_late) {
    static struct several all;
    static struct incode_borrower b;
    struct incode_loan loan;
    open_set(&all, "uniform", 2000, 2);
    struct incode_triangulator *t = until_lent(&all, &loan);
    const struct incode_front_counts *counts = &t->front.counts;
    find(&all, 1, &loan, &b);
    assert_true(b.found.count > 0);
    assert_int_equal(incode_front_use_found(&t->front, &b.found, 0, 64),
                     b.found.count);
    uint64_t kept = counts->kept, late = counts->late;
    assert_int_equal(late, 0);
    assert_int_equal(counts->hull_facets + kept + counts->foreign > 0, 1);
    (void)incode_front_use_found(&t->front, &b.found, 0, 64);
    assert_int_equal(counts->kept, kept);
    assert_int_equal(counts->late, b.found.count);
    incode_front_return(&t->front, &loan);
    several_work(&all);
    several_gather(&all);
    several_close(&all);
}

/* The faces of the loan's vertices that are open now. */
static void ask_again(const struct incode_triangulator *t,
                      struct incode_loan *loan) {
    uint32_t v[INCODE_LOAN_VERTICES], n = 0;
    for (uint32_t i = 0; i < loan->count; i++)
        if (i == 0 || loan->v[i][0] != v[n - 1])
            v[n++] = loan->v[i][0];
    loan->count = 0;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t pairs[INCODE_LOAN_FACES][2];
        uint32_t faces = incode_afl_tell(&t->front.afl, v[i], pairs,
                                         INCODE_LOAN_FACES - loan->count);
        for (uint32_t k = 0; k < faces; k++) {
            loan->v[loan->count][0] = v[i];
            memcpy(loan->v[loan->count++] + 1, pairs[k], sizeof pairs[k]);
        }
    }
}

/* As far as it goes. */
static void work_on(struct solo *solo) {
    for (int i = 0; i < 4; i++)
        assert_false(solo_step(solo, 600));
}

/* Vertices that are lent hold their bricks up, and no longer than they are: not
 * even if nothing is left to do when they come back. */
TEST(held_up) {
    static struct several all;
    static struct incode_borrower b;
    struct incode_loan loan, again;
    open_set(&all, "uniform", 60, 1);
    struct solo *lender = &all.node[0].solo;
    struct incode_triangulator *t = until_lent(&all, &loan);
    assert_in_range(loan.count, 1, INCODE_LOAN_FACES);
    for (again = loan; again.count > 0; ask_again(t, &again)) {
        work_on(lender);
        assert_false(incode_triangulator_is_quiet(t));
        ask_again(t, &again);
        if (again.count == 0)
            break;
        find(&all, 0, &again, &b);
        (void)incode_front_use_found(&t->front, &b.found, 0, 64);
    }
    work_on(lender);
    assert_int_equal(t->front.afl.count, 0);
    assert_int_equal(lender->committed[0], 0);
    t->front.exchange.changes = 0; /* a sweep has met it while it was lent */
    incode_front_return(&t->front, &loan);
    assert_true(solo_step(lender, 600));
    several_finish(&all, 0);
    several_close(&all);
}

/* A star with more faces than a loan holds: as many as fit are lent, and the
 * rest is closed at home. */
TEST(large_star) {
    static struct several all, plain;
    open_set(&plain, "hub", 3000, 2);
    several_work(&plain);
    several_gather(&plain);
    open_set(&all, "hub", 3000, 2);
    all.lends = true;
    several_work(&all);
    several_gather(&all);
    assert_string_equal(all.solo.digest.text, plain.solo.digest.text);
    several_close(&all);
    several_close(&plain);
}

/* What is no loan, and no answer to one. */
TEST(unsound) {
    struct incode_loan loan = {4, 8, 1, {{256, 300, 9}}};
    assert_true(incode_loan_is_sound(&loan, 8));
    assert_false(incode_loan_is_sound(&loan, 7));
    loan.v[0][0] = 255; /* another's */
    assert_false(incode_loan_is_sound(&loan, 8));
    loan.v[0][0] = loan.v[0][1];
    assert_false(incode_loan_is_sound(&loan, 8));
    loan.v[0][0] = 256;
    loan.count = 0;
    assert_false(incode_loan_is_sound(&loan, 8));
    loan.count = INCODE_LOAN_FACES + 1;
    assert_false(incode_loan_is_sound(&loan, 8));
    loan.count = INCODE_LOAN_VERTICES + 1;
    for (uint32_t i = 0; i < loan.count; i++)
        memcpy(loan.v[i], (uint32_t[3]){256 + i, 400, 401}, 12);
    assert_false(incode_loan_is_sound(&loan, 8));
    loan.count--;
    assert_true(incode_loan_is_sound(&loan, 8));
    struct incode_found found = {1, {{1, 2, 3, INCODE_NONE}}};
    assert_true(incode_found_is_sound(&found, 1));
    found.v[0][3] = 2;
    assert_false(incode_found_is_sound(&found, 1));
    found.v[0][3] = 64;
    assert_false(incode_found_is_sound(&found, 1));
    assert_true(incode_found_is_sound(&found, 2));
    found.v[0][2] = INCODE_NONE;
    assert_false(incode_found_is_sound(&found, 2));
    found.count = INCODE_LOAN_FACES + 1;
    assert_false(incode_found_is_sound(&found, 2));
}
