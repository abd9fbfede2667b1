#include "sphere.h"

#include <string.h>

/* The bounds below hold in double precision with this much to spare. */
#define SPARE 1e-9
/* Twice the precision, relative to its terms. */
#define HALF_SPACE_FINE 1e-29
/* Below this, what is left of a length or a product tells nothing. */
#define VANISHED 1e-250

static double length_of(const double a[3]) {
    return __builtin_sqrt(incode_dot(a, a));
}

struct incode_dd incode_half_space_height(const struct incode_half_space *s,
                                          const double x[3]) {
    struct incode_dd_vector r = incode_dd_relative(x, s->p, s->scale), n;
    for (int k = 0; k < 3; k++)
        n.d[k] = (struct incode_dd){s->n[k], 0};
    return incode_dd_dot(n.d, r.d);
}

enum { SLOPES = 1000000 }; /* one in so many is a direction of its own */

/* Sine of the angle between two directions; more than 1 if it is not acute. */
static double sine(const double a[3], const double b[3]) {
    double c[3], lengths = length_of(a) * length_of(b);
    incode_cross(c, a, b);
    return incode_dot(a, b) > 0 && lengths > 0 ? length_of(c) / lengths : 2;
}

bool incode_half_space_faces(const struct incode_half_space *half_space,
                             const double n[3]) {
    return sine(half_space->n, n) * SLOPES < 1;
}

/* How far above v, in the half-space's direction, a point can be; not a number
 * if that overflows. */
static double depth_of(const struct incode_half_space *half_space,
                       const double pv[3], double scale) {
    struct incode_dd height = incode_half_space_height(half_space, pv);
    struct incode_dd top = {half_space->most[0], half_space->most[1]};
    double ratio = scale / half_space->scale, far = 0;
    for (int k = 0; k < 3; k++)
        far += __builtin_fabs((pv[k] - half_space->p[k]) * half_space->scale);
    double depth = incode_dd_minus(top, height).hi * ratio /
                       length_of(half_space->n) * (1 + SPARE) +
                   HALF_SPACE_FINE * far * ratio;
    return depth < 0 ? 0 : depth;
}

/* Of an ill-conditioned or very large sphere through v with its centre outside
 * the half-space: a point x inside, h above v in the half-space's direction and
 * y along it, has
 *
 *     h^2 + y^2 <= 2 (h, y) . centre,  h <= depth,
 *
 * so y lies in a disc around the centre's foot, and |h| is next to nothing. */
static struct incode_ball ball_under(const struct incode_half_space *half_space,
                                     const struct incode_fine *sphere,
                                     const double pv[3], double scale) {
    struct incode_ball ball = {{0, 0, 0}, __builtin_inf()};
    double m[3] = {sphere->m[0].hi, sphere->m[1].hi, sphere->m[2].hi};
    if (!incode_half_space_faces(half_space, m))
        return ball;
    const double *n = half_space->n;
    const struct incode_dd direction[3] = {{n[0], 0}, {n[1], 0}, {n[2], 0}};
    struct incode_dd_vector tilt =
        incode_dd_vector_product(sphere->m, direction);
    const double across[3] = {tilt.d[0].hi, tilt.d[1].hi, tilt.d[2].hi};
    double foot[3], half = 0.5 / sphere->det.hi;
    incode_cross(foot, n, across);
    for (int k = 0; k < 3; k++)
        ball.centre[k] = foot[k] * half / incode_dot(n, n);
    double radius = length_of(m) * half * (1 + SPARE);
    double depth = depth_of(half_space, pv, scale);
    double off = length_of(ball.centre), doubt = off * SPARE;
    doubt += radius * HALF_SPACE_FINE * 1e9;
    off += doubt;
    double disc = __builtin_sqrt(off * off + 2 * radius * depth);
    /* The foot's own error, of 2e-9 of the sphere's face, is within 1e-6. */
    ball.radius = disc * (1 + 1e-6) + depth + 2 * doubt;
    return ball;
}

void incode_near_degenerate_sphere(struct incode_near_degenerate *degenerate,
                                   const double *const p[4], double scale) {
    double lengths = 1, longest = 1, r[3];
    incode_sphere_fine(&degenerate->sphere, p[0], p[1], p[2], p[3], scale);
    for (int i = 1; i < 4; i++) {
        for (int k = 0; k < 3; k++)
            r[k] = (p[i][k] - p[0][k]) * scale;
        double length = length_of(r);
        lengths *= length;
        longest = length > longest ? length : longest;
    }
    degenerate->lengths = lengths;
    degenerate->spread = lengths > VANISHED
                             ? HALF_SPACE_FINE * 1e2 * lengths * longest
                             : __builtin_inf();
}

/* The least ball that is known to hold what comes before p[3]. */
static struct incode_ball ball_of(struct incode_near_degenerate *degenerate,
                                  const double *const p[4], double scale) {
    double r[3];
    struct incode_ball ball = {{0, 0, 0}, __builtin_inf()};
    for (int k = 0; k < 3; k++)
        r[k] = (p[3][k] - p[0][k]) * scale;
    double far = length_of(r);
    degenerate->spread = 0;
    /* What comes before a place of zero or less in the pencil lies in the ball
     * over the face's circle. */
    if (degenerate->regular && far > VANISHED) {
        double circle = length_of(degenerate->c0) * (1 + 1e-8);
        double above = far * far - 2 * incode_dot(degenerate->c0, r) +
                       1e-8 * far * (far + 2 * circle);
        if (above <= 0) {
            memcpy(ball.centre, degenerate->c0, sizeof ball.centre);
            ball.radius = circle * (1 + 1e-8);
            return ball;
        }
    }
    const struct incode_fine *sphere = &degenerate->sphere;
    incode_near_degenerate_sphere(degenerate, p, scale);
    /* What is left of det and m after cancellation must be right to SPARE. */
    double far_off = HALF_SPACE_FINE * 1e9 * degenerate->lengths;
    double m[3] = {sphere->m[0].hi, sphere->m[1].hi, sphere->m[2].hi};
    if (!(sphere->det.hi > far_off) ||
        !(sphere->det.hi > INCODE_SPHERE_LEAST) ||
        !(incode_max_norm(m) > far_off * far))
        return ball;
    for (uint32_t i = 0; i < degenerate->count; i++) {
        struct incode_ball here =
            ball_under(&degenerate->half_spaces[i], sphere, p[0], scale);
        ball = here.radius < ball.radius ? here : ball;
    }
    return ball;
}

void incode_near_degenerate_lessen(struct incode_near_degenerate *degenerate,
                                   const double *const p[4], double scale) {
    struct incode_ball ball = ball_of(degenerate, p, scale);
    degenerate->ball =
        ball.radius < degenerate->ball.radius ? ball : degenerate->ball;
}

bool incode_near_degenerate_outside(
    const struct incode_near_degenerate *degenerate, const double pv[3],
    const double p[3], double scale) {
    if (degenerate->spread == 0)
        return false;
    struct incode_dd_vector r = incode_dd_relative(p, pv, scale);
    struct incode_dd square = incode_dd_dot(r.d, r.d);
    struct incode_dd value =
        incode_dd_minus(incode_dd_dot(degenerate->sphere.m, r.d),
                        incode_dd_times(degenerate->sphere.det, square));
    double far = __builtin_sqrt(square.hi);
    return value.hi <
           -degenerate->spread * (far + square.hi) - INCODE_SPHERE_TINY;
}
