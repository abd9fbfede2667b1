#include "cases.h"

#include <stdbool.h>

#include "draw.h"
#include "incode/predicates/exact.h"
#include "incode/predicates/predicates.h"
#include "single.h"
#include "steps.h"

static const char *const point_names[5][3] = {{"a.x", "a.y", "a.z"},
                                              {"b.x", "b.y", "b.z"},
                                              {"c.x", "c.y", "c.z"},
                                              {"d.x", "d.y", "d.z"},
                                              {"e.x", "e.y", "e.z"}};
static const char *const difference_names[4][3] = {{"ax", "ay", "az"},
                                                   {"bx", "by", "bz"},
                                                   {"cx", "cy", "cz"},
                                                   {"dx", "dy", "dz"}};

static void record_sign(struct record *record, const char *name, int sign) {
    record_word(record, name, (uint64_t)(int64_t)sign);
}

static void record_tally(struct record *record,
                         const struct incode_tally *tally) {
    record_word(record, "orient3d that the filter left", tally->exact_orient3d);
    record_word(record, "in_sphere that the filter left",
                tally->exact_in_sphere);
}

static double larger(double a, double b) {
    return a > b ? a : b;
}

/* The largest difference in each coordinate. */
static void largest(const double d[][3], int count, double most[3]) {
    for (int k = 0; k < 3; k++) {
        most[k] = 0;
        for (int i = 0; i < count; i++)
            most[k] = larger(most[k], __builtin_fabs(d[i][k]));
    }
}

/* d[i] = p[i] - origin, as the filters have them; the first is called
 * difference_names[first]. */
static void differences(struct record *record, double d[][3],
                        const double (*p)[3], int count, const double *origin,
                        int first) {
    for (int i = 0; i < count; i++) {
        for (int k = 0; k < 3; k++)
            d[i][k] = step_minus(record, difference_names[first + i][k],
                                 p[i][k], origin[k]);
    }
}

/* The filter's determinant and its bound, from the points but for the first,
 * which is a. */
static void filter_orient3d(struct record *record, const double p[5][3]) {
    double d[3][3], most[3];
    differences(record, d, p + 1, 3, p[0], 1);
    const double *b = d[0], *c = d[1];
    double minor[3] = {
        step_cross(record, "bx cy - by cx", b[0], c[1], b[1], c[0]),
        step_cross(record, "by cz - bz cy", b[1], c[2], b[2], c[1]),
        step_cross(record, "bz cx - bx cz", b[2], c[0], b[0], c[2])};
    double with[3] = {d[2][2], d[2][0], d[2][1]};
    step_dot(record, "determinant", minor, with);
    largest((const double(*)[3])d, 3, most);
    double product = step_times(record, "mx my", most[0], most[1]);
    step_times(record, "mx my mz", product, most[2]);
}

/* The query is e. */
static void filter_in_sphere(struct record *record, const double p[5][3]) {
    static const char *const minor_names[6] = {
        "ab = ax by - bx ay", "ac = ax cy - cx ay", "ad = ax dy - dx ay",
        "bc = bx cy - cx by", "bd = bx dy - dx by", "cd = cx dy - dx cy"};
    static const char *const volume_names[4] = {"bcd", "acd", "abd", "abc"};
    static const char *const square_names[4] = {"a a", "b b", "c c", "d d"};
    /* The minors of each volume, and the point that each is multiplied with. */
    static const uint8_t of[4][3] = {
        {3, 4, 5}, {1, 2, 5}, {0, 2, 4}, {0, 1, 3}};
    static const uint8_t by[4][3] = {
        {3, 2, 1}, {3, 2, 0}, {3, 1, 0}, {2, 1, 0}};
    double d[4][3], minor[6], volume[4], square[4], most[3];
    int n = 0;
    differences(record, d, p, 4, p[4], 0);
    for (int i = 0; i < 4; i++) {
        for (int j = i + 1; j < 4; j++, n++)
            minor[n] = step_cross(record, minor_names[n], d[i][0], d[j][1],
                                  d[j][0], d[i][1]);
    }
    for (int i = 0; i < 4; i++) {
        double a[3] = {minor[of[i][0]], -minor[of[i][1]], minor[of[i][2]]};
        double b[3] = {d[by[i][0]][2], d[by[i][1]][2], d[by[i][2]][2]};
        volume[i] = step_dot(record, volume_names[i], a, b);
        square[i] = step_dot(record, square_names[i], d[i], d[i]);
    }
    double s = step_cross(record, "aa bcd - bb acd", square[0], volume[0],
                          square[1], volume[1]);
    double t = step_cross(record, "cc abd - dd abc", square[2], volume[2],
                          square[3], volume[3]);
    step_minus(record, "determinant", s, -t);
    largest((const double(*)[3])d, 4, most);
    double length = larger(most[0], larger(most[1], most[2]));
    double product = step_times(record, "mx my", most[0], most[1]);
    product = step_times(record, "mx my mz", product, most[2]);
    double area = step_times(record, "m m", length, length);
    step_times(record, "mx my mz m m", product, area);
}

static bool distinct(const double p[5][3]) {
    for (int i = 0; i < 5; i++) {
        for (int j = 0; j < i; j++)
            if (incode_lexicographic(p[i], p[j]) == 0)
                return false;
    }
    return true;
}

/* Draws five points, and where in_sphere asks for it, distinct ones of which
 * the first four are positively oriented: false where there are none among so
 * many. */
static bool draw_case(struct draw *draw, enum draw_family family, bool positive,
                      double p[5][3]) {
    enum { TRIES_MAX = 20 };
    struct incode_tally tally = {0};
    for (int tries = 0; tries < TRIES_MAX; tries++) {
        draw_points(draw, family, p);
        if (!positive)
            return true;
        int sign = incode_orient3d(&tally, p[0], p[1], p[2], p[3]);
        if (sign == 0 || !distinct((const double(*)[3])p))
            continue;
        for (int k = 0; k < 3 && sign < 0; k++) {
            double x = p[0][k];
            p[0][k] = p[1][k];
            p[1][k] = x;
        }
        return true;
    }
    return false;
}

static void record_points(struct record *record, const double p[5][3]) {
    for (int i = 0; i < 5; i++)
        for (int k = 0; k < 3; k++)
            record_double(record, point_names[i][k], p[i][k]);
}

/* Most cases are such that the filters can tell; a quarter is hard. */
static enum draw_family filter_family(uint32_t number) {
    uint32_t at = number / 2 % 32;
    if (at < 24)
        return at < 20 ? DRAW_UNIFORM : DRAW_SPREAD;
    return at < 31 ? (enum draw_family)(DRAW_PLANE + (at - 24) % 3)
                   : (enum draw_family)(number / 64 % DRAW_FAMILIES);
}

static void filter_case(struct draw *draw, uint32_t number,
                        struct record *record) {
    struct incode_tally tally = {0};
    double p[5][3];
    bool sphere = number % 2 != 0;
    if (!draw_case(draw, filter_family(number), sphere, p)) {
        record_word(record, "no such points", 0);
        return;
    }
    const double(*q)[3] = (const double(*)[3])p;
    record_points(record, q);
    if (sphere) {
        filter_in_sphere(record, q);
        record_sign(record, "in_sphere",
                    incode_in_sphere(&tally, q[0], q[1], q[2], q[3], q[4]));
    } else {
        filter_orient3d(record, q);
        record_sign(record, "orient3d",
                    incode_orient3d(&tally, q[0], q[1], q[2], q[3]));
    }
    record_tally(record, &tally);
}

/* The largest |p[i][k] - origin[k]|. */
static double reach(const double *const p[], int count, const double *origin) {
    double most = 0;
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 3; k++)
            most = larger(most, __builtin_fabs(p[i][k] - origin[k]));
    return most;
}

/* Whether the points are integers of one scale, and which. */
static bool record_integers(struct record *record, int64_t n[4][3],
                            const double *const p[], int count,
                            const double *origin, double most) {
    bool there = incode_fixed_differences(n, p, count, origin, most);
    record_word(record, "integers of one scale", there);
    for (int i = 0; i < count && there; i++)
        for (int k = 0; k < 3; k++)
            record_word(record, difference_names[i][k], (uint64_t)n[i][k]);
    return there;
}

static void stages_orient3d(struct record *record, const double *const p[5]) {
    int64_t n[4][3];
    double most = reach(p + 1, 3, p[0]);
    int exact = incode_exact_orient3d(p), sign;
    record_sign(record, "orient3d, exact", exact);
    /* How close to zero two doubles tell depends on the processor's products;
     * what they tell does not. */
    sign = incode_pair_orient3d(p, most, &sign) ? sign : exact;
    record_sign(record, "orient3d, in two doubles", sign);
    if (!record_integers(record, n, p + 1, 3, p[0], most))
        return;
    record_sign(record, "orient3d, integers",
                incode_fixed_orient3d((const int64_t(*)[3])n));
    record_sign(record, "orient3d, integers of 32 bits",
                incode_fixed_orient3d_portable((const int64_t(*)[3])n));
}

static void stages_in_sphere(struct record *record, const double *const p[5]) {
    int64_t n[4][3];
    double most = reach(p, 4, p[4]);
    struct incode_yield pause = {0};
    int exact = incode_exact_in_sphere(p, &pause), sign;
    record_sign(record, "in_sphere, exact", exact);
    sign = incode_pair_in_sphere(p, most, &sign) ? sign : exact;
    record_sign(record, "in_sphere, in two doubles", sign);
    if (!record_integers(record, n, p, 4, p[4], most))
        return;
    record_sign(record, "in_sphere, integers",
                incode_fixed_in_sphere((const int64_t(*)[3])n, false));
    record_sign(record, "in_sphere, integers of 32 bits",
                incode_fixed_in_sphere_portable((const int64_t(*)[3])n));
}

/* All families in turn; a quarter also where four points lie in a plane. */
static void exact_case(struct draw *draw, uint32_t number,
                       struct record *record) {
    struct incode_tally tally = {0};
    double p[5][3];
    bool sphere = number / DRAW_FAMILIES % 4 != 0;
    sphere = draw_case(draw, number % DRAW_FAMILIES, sphere, p) && sphere;
    const double *q[5] = {p[0], p[1], p[2], p[3], p[4]};
    record_points(record, (const double(*)[3])p);
    stages_orient3d(record, q);
    record_sign(record, "orient3d",
                incode_orient3d(&tally, q[0], q[1], q[2], q[3]));
    record_sign(record, "compare_distance",
                incode_compare_distance(q[0], q[1], q[2]));
    record_sign(record, "compare_distance, exact",
                incode_exact_compare_distance(q));
    record_sign(record, "collinear", incode_collinear(q[0], q[1], q[2]));
    record_sign(record, "collinear, exact", incode_exact_collinear(q));
    if (sphere) {
        stages_in_sphere(record, q);
        record_sign(record, "in_sphere",
                    incode_in_sphere(&tally, q[0], q[1], q[2], q[3], q[4]));
    }
    record_tally(record, &tally);
}

void cases_case(uint32_t block, uint32_t number, struct record *record) {
    struct draw draw = draw_begin((uint64_t)block * CASES_PER_BLOCK + number);
    if (block < CASES_FILTERS)
        single_case(&draw, number, record);
    else if (block < CASES_EXACT)
        filter_case(&draw, number, record);
    else
        exact_case(&draw, number, record);
}

uint64_t cases_block(uint32_t block) {
    uint64_t digest = record_begin().digest;
    for (uint32_t number = 0; number < CASES_PER_BLOCK; number++) {
        struct record record = record_begin();
        cases_case(block, number, &record);
        digest = record_fold(digest, record.digest);
    }
    return digest;
}

const char *cases_kind(uint32_t block) {
    if (block < CASES_FILTERS)
        return "single operations";
    return block < CASES_EXACT ? "filters" : "exact predicates";
}
