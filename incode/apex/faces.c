#include <string.h>

#include "apex.h"

/* Faces and their answers, by the index `kd`: of a vertex whose local points
 * are at hand, face after face. */

/* Index of vertex `id` among the local points, fetched and appended if it is
 * far; INCODE_AGAIN: the room for far vertices is used up. */
static enum incode_outcome resolve(struct incode_maker *m, uint32_t id,
                                   uint16_t *index, uint32_t *page) {
    if (*index != INCODE_LOCAL_NONE)
        return INCODE_ANSWERED;
    uint32_t i = incode_local_find(&m->local, id);
    if (i == INCODE_LOCAL_NONE) {
        double p[3];
        if (!incode_fetch_point(m, id, p, page))
            return INCODE_WAIT;
        i = incode_local_append(&m->local, id, p);
        if (i == INCODE_LOCAL_NONE)
            return INCODE_AGAIN;
    }
    *index = (uint16_t)i;
    return INCODE_ANSWERED;
}

/* The answer at three local points. */
static void set_answer(struct incode_answer *a, const struct incode_maker *m,
                       uint16_t b, uint16_t c, uint16_t apex) {
    const struct incode_local_points *local = &m->local;
    const uint16_t near[3] = {b, c, apex};
    a->f[0] = local->vertex;
    a->near[0] = INCODE_LOCAL_NONE;
    memcpy(a->p[0], local->p0, sizeof a->p[0]);
    for (int i = 0; i < 3; i++) {
        a->f[i + 1] = local->id[near[i]];
        a->near[i + 1] = near[i];
        for (int d = 0; d < 3; d++)
            a->p[i + 1][d] = local->p[d][near[i]];
    }
}

static void set_hull(struct incode_answer *a, uint32_t v, uint32_t b,
                     uint32_t c) {
    const uint32_t f[4] = {v, b, c, INCODE_NONE};
    memcpy(a->f, f, sizeof a->f);
}

enum incode_outcome incode_maker_apex(struct incode_maker *m, unsigned slot,
                                      uint32_t b, uint32_t c, uint16_t near[2],
                                      struct incode_answer *a) {
    struct incode_search *s = &m->search[slot];
    uint32_t apex;
    enum incode_outcome r = resolve(m, b, &near[0], &s->page);
    if (r == INCODE_ANSWERED)
        r = resolve(m, c, &near[1], &s->page);
    if (r != INCODE_ANSWERED)
        return r;
    m->counts.calls++;
    switch (incode_apex_near(m, near[0], near[1], &apex, s)) {
    case INCODE_NEAR_FOUND:
        set_answer(a, m, near[0], near[1], (uint16_t)apex);
        return INCODE_ANSWERED;
    case INCODE_NEAR_HULL:
        set_hull(a, m->local.vertex, b, c);
        return INCODE_ANSWERED;
    case INCODE_NEAR_SEARCH:
    default:
        m->counts.tree_searches++;
        s->stage = INCODE_SEARCH_POINTS;
        return INCODE_MORE;
    }
}

enum incode_outcome incode_maker_resume(struct incode_maker *m, unsigned slot,
                                        struct incode_answer *a) {
    struct incode_search *s = &m->search[slot];
    const struct incode_query *q = &s->query;
    uint16_t near[2] = {INCODE_LOCAL_NONE, INCODE_LOCAL_NONE};
    uint32_t apex = INCODE_LOCAL_NONE;
    s->advanced = false;
    if (s->stage == INCODE_SEARCH_POINTS) {
        enum incode_outcome r = incode_search_run(m, s);
        if (r != INCODE_ANSWERED)
            return r;
        s->stage = INCODE_SEARCH_FOUND;
    }
    if (q->best != INCODE_NONE) {
        apex = incode_local_find(&m->local, q->best);
        if (apex == INCODE_LOCAL_NONE)
            apex = incode_local_append(&m->local, q->best, q->best_p);
        enum incode_outcome r = resolve(m, q->b, &near[0], &s->page);
        if (r == INCODE_ANSWERED)
            r = resolve(m, q->c, &near[1], &s->page);
        if (r != INCODE_ANSWERED || apex == INCODE_LOCAL_NONE)
            return r != INCODE_ANSWERED ? r : INCODE_AGAIN;
    }
    s->stage = INCODE_SEARCH_NONE;
    if (q->question == INCODE_QUERY_HALF_SPACE)
        return INCODE_MORE; /* the face is tried again with it */
    incode_search_learn(m, q, s->looked);
    if (q->best != INCODE_NONE)
        set_answer(a, m, near[0], near[1], (uint16_t)apex);
    else
        set_hull(a, q->v, q->b, q->c);
    return INCODE_ANSWERED;
}

/* ---- faces as they come ---- */

static bool is_at_hand(const struct incode_maker *m, uint32_t v) {
    return m->local.vertex == v && m->local.leaf == v / INCODE_LEAF_POINTS &&
           m->horizon.centre == v / INCODE_BRICK_POINTS;
}

static enum incode_outcome answer_near(struct incode_maker *m, unsigned slot,
                                       const uint32_t f[3],
                                       struct incode_answer *a) {
    enum incode_outcome r = is_at_hand(m, f[0]) ? INCODE_MORE : INCODE_AGAIN;
    uint16_t near[2] = {INCODE_LOCAL_NONE, INCODE_LOCAL_NONE};
    for (bool begun = false; r == INCODE_AGAIN || r == INCODE_MORE;
         begun = true) {
        if (begun && r == INCODE_MORE && m->walker.left == 0)
            return INCODE_MORE;
        if (r == INCODE_AGAIN) {
            near[0] = near[1] = INCODE_LOCAL_NONE;
            r = incode_maker_centre(m, slot, f[0]);
            if (r != INCODE_ANSWERED)
                return r;
        }
        r = m->search[slot].stage == INCODE_SEARCH_NONE
                ? incode_maker_apex(m, slot, f[1], f[2], near, a)
                : incode_maker_resume(m, slot, a);
    }
    return r;
}

enum incode_outcome incode_maker_apexes(struct incode_maker *m, unsigned slot,
                                        const uint32_t (*faces)[3],
                                        uint32_t count,
                                        struct incode_answer *answers,
                                        uint32_t *done) {
    while (*done < count) {
        const uint32_t *f = faces[*done];
        struct incode_answer *a = &answers[*done];
        enum incode_outcome r = m->index == INCODE_KD
                                    ? answer_near(m, slot, f, a)
                                    : incode_maker_face(m, slot, f, a);
        if (r != INCODE_ANSWERED)
            return r;
        ++*done;
    }
    return INCODE_ANSWERED;
}
