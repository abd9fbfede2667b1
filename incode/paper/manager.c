#include "manager.h"

#include <string.h>

#include "incode/predicates/check.h"

enum {
    WINDOW = 128, /* bricks: so far ahead faces are lent */
    AHEAD = 48,   /* bricks counted before they are passed, at least */
    USED = 32     /* answers a step, at most: a star's room suffices */
};

/* Coordinates are not looked at. */
static const double *const NOWHERE[4] = {NULL, NULL, NULL, NULL};

static const char *const UNSOUND = "answers that are none to what was asked";
static const char *const SHORT =
    "all lists are back, and not all that they asked has an answer";

/* ---- memory ---- */

/* A seventh for the bricks that are touched, as in a triangulator. */
static struct incode_front_share share_of(size_t bytes) {
    size_t face = sizeof(struct incode_afl_node) + sizeof(uint32_t);
    size_t brick = sizeof(struct incode_touched) + sizeof(uint32_t);
    size_t most = UINT32_MAX / 2;
    size_t entries = bytes / 7 / brick, faces = bytes / 7 * 6 / face;
    entries = entries < INCODE_ENTRIES_MIN ? INCODE_ENTRIES_MIN : entries;
    faces = faces < INCODE_FACES_MIN ? INCODE_FACES_MIN : faces;
    struct incode_front_share share = {
        (uint32_t)(faces < most ? faces : most),
        (uint32_t)(entries < most ? entries : most)};
    while (share.faces > INCODE_FACES_MIN && incode_front_bytes(&share) > bytes)
        share.faces--;
    while (share.faces < most) { /* hash heads are a power of two */
        const struct incode_front_share more = {share.faces + 1, share.entries};
        if (incode_front_bytes(&more) > bytes)
            break;
        share.faces++;
    }
    return share;
}

size_t incode_manager_min(void) {
    const struct incode_front_share share = {INCODE_FACES_MIN,
                                             INCODE_ENTRIES_MIN};
    return (incode_front_bytes(&share) + 63) / 64 * 64;
}

void incode_manager_init(struct incode_manager *m, void *memory, size_t bytes,
                         const struct incode_setup *setup,
                         const struct incode_front_outside *outside,
                         const struct incode_yield *yield) {
    struct incode_front_share share = share_of(bytes);
    INCODE_ASSERT(setup->face_rule == INCODE_FACE_OWN);
    INCODE_ASSERT(incode_front_bytes(&share) <= bytes);
    memset(m, 0, sizeof *m);
    m->yield = *yield;
    m->bytes = incode_front_bytes(&share);
    incode_front_init(&m->front, memory, &share, setup->bricks, INCODE_FACE_OWN,
                      outside, &m->yield);
    m->front.window = WINDOW;
    m->front.owner_rule = (enum incode_owner_rule)setup->owner_rule;
}

void incode_manager_start(struct incode_manager *m,
                          const struct incode_job *job) {
    INCODE_ASSERT(m->lists == 0 && incode_manager_is_free(m));
    incode_front_start(&m->front, job);
    m->asked = job->first;
    for (uint32_t i = 0; i < INCODE_COUNTS; i++)
        m->brick[i] = INCODE_NONE;
    memset(&m->seed, 0, sizeof m->seed);
    memset(m->due, 0, sizeof m->due);
    m->fault = NULL;
}

/* ---- what is lent ---- */

/* Bricks are counted before they are passed, so that none waits for it. */
static uint32_t lend_bricks(struct incode_manager *m,
                            struct incode_list *list) {
    uint32_t first, last, count = 0;
    incode_front_own_left(&m->front, &first, &last);
    if (first >= last || m->asked >= last || m->asked >= first + AHEAD)
        return 0;
    list->kind = INCODE_LIST_COUNT;
    for (; count < INCODE_LIST_COUNTED && m->asked < last; count++) {
        list->v[count][0] = m->asked++;
        list->v[count][1] = list->v[count][2] = 0;
    }
    return count;
}

static bool is_seed_open(const struct incode_manager *m) {
    return (incode_front_suspended(&m->front) >> m->seed.task & 1) != 0 &&
           incode_front_vertex(&m->front, m->seed.task) == m->seed.v;
}

static uint32_t lend_seed(struct incode_manager *m, struct incode_list *list) {
    if (!m->seed.wanted)
        return 0;
    m->seed.wanted = false;
    if (!is_seed_open(m)) /* its brick has been spilled */
        return 0;
    m->seed.asked = true;
    list->kind = INCODE_LIST_FIRST;
    list->v[0][0] = m->seed.v;
    list->v[0][1] = list->v[0][2] = 0;
    return 1;
}

uint32_t incode_manager_lend(struct incode_manager *m, uint32_t most,
                             struct incode_list *list) {
    INCODE_ASSERT(most >= 1 && most <= INCODE_LIST_MAX);
    list->count = 0;
    if (incode_manager_fault(m) != NULL || incode_front_is_finished(&m->front))
        return 0;
    list->count = lend_bricks(m, list);
    if (list->count == 0)
        list->count = lend_seed(m, list);
    if (list->count == 0) {
        list->kind = INCODE_LIST_FACES;
        list->count = incode_front_lend(&m->front, list->v, most);
    }
    if (list->count > 0) {
        m->lists++;
        m->due[list->kind] += list->count;
    }
    return list->count;
}

/* ---- what is answered ---- */

static bool is_vertex(const struct incode_manager *m, uint32_t v) {
    return v / INCODE_BRICK_POINTS < m->front.bricks;
}

static bool is_sound(const struct incode_manager *m, uint32_t kind,
                     const uint32_t v[4]) {
    if (kind == INCODE_LIST_COUNT)
        return v[1] >= 1 && v[1] <= INCODE_BRICK_POINTS;
    bool hull = kind == INCODE_LIST_FACES && v[3] == INCODE_NONE;
    return is_vertex(m, v[0]) && is_vertex(m, v[1]) && is_vertex(m, v[2]) &&
           (hull || is_vertex(m, v[3])) && v[0] != v[1] && v[0] != v[2] &&
           v[1] != v[2] && v[3] != v[0] && v[3] != v[1] && v[3] != v[2];
}

/* As many as some lists of their kind had, and, when the last list is back, as
 * all of them. */
static bool fits(const struct incode_manager *m,
                 const struct incode_answers *answers) {
    uint32_t left = 0;
    if (m->lists == 0 || answers->count < 1 ||
        answers->count > INCODE_LIST_MAX || answers->kind < INCODE_LIST_FACES ||
        answers->kind > INCODE_LIST_COUNT)
        return false;
    for (int kind = INCODE_LIST_FACES; kind <= INCODE_LIST_COUNT; kind++)
        left += m->due[kind];
    return answers->count <= m->due[answers->kind] &&
           left - answers->count >= m->lists - 1 &&
           (left == answers->count || m->lists > 1);
}

void incode_manager_take(struct incode_manager *m,
                         const struct incode_answers *answers) {
    INCODE_ASSERT(incode_manager_is_free(m));
    bool sound = fits(m, answers);
    for (uint32_t i = 0; sound && i < answers->count; i++)
        sound = is_sound(m, answers->kind, answers->v[i]);
    if (!sound) {
        m->fault = UNSOUND;
        return;
    }
    memcpy(&m->taken, answers, incode_answers_bytes(answers->count));
    m->used = 0;
    m->lists--;
    m->due[answers->kind] -= answers->count;
}

static void use_seed(struct incode_manager *m, const uint32_t v[4]) {
    bool open = is_seed_open(m);
    if (!m->seed.asked || v[0] != m->seed.v)
        m->fault = UNSOUND;
    m->seed.asked = false;
    if (!open || m->fault != NULL)
        return;
    incode_front_done(&m->front, m->seed.task);
    if (!incode_front_is_reached(&m->front, v[0]))
        incode_front_seed(&m->front, v, NOWHERE);
}

static void use(struct incode_manager *m, const uint32_t v[4]) {
    if (m->taken.kind == INCODE_LIST_COUNT) {
        m->brick[v[0] % INCODE_COUNTS] = v[0];
        m->points[v[0] % INCODE_COUNTS] = v[1];
    } else if (m->taken.kind == INCODE_LIST_FIRST) {
        use_seed(m, v);
    } else if (!incode_front_use(&m->front, v, NOWHERE)) {
#ifdef INCODE_PLANT_ANSWER /* a fault that the simulation has to find */
        if (v[3] != INCODE_NONE)
            incode_front_seed(&m->front, v, NOWHERE);
#endif
    }
}

static void use_some(struct incode_manager *m, uint32_t units) {
    const struct incode_front_outside *outside = &m->front.outside;
    uint32_t left = m->taken.count - m->used, most = USED;
    size_t room = outside->emit_room(outside->context);
    most = room < most ? (uint32_t)room : most;
    most = units < most ? units : most;
    most = left < most ? left : most;
    for (uint32_t i = 0; i < most && incode_manager_fault(m) == NULL; i++)
        use(m, m->taken.v[m->used++]);
    m->spent += most;
}

/* ---- steps ---- */

static enum incode_step want_seed(struct incode_manager *m, uint32_t task) {
    if (m->seed.asked) /* of a brick that has been spilled and came back */
        return INCODE_WAITING;
    m->seed.task = task;
    m->seed.v = incode_front_vertex(&m->front, task);
    m->seed.wanted = true;
    incode_front_suspend(&m->front, task, false, true);
    return INCODE_WORKED;
}

/* Passes a brick, if it is closed. */
static enum incode_step pass(struct incode_manager *m) {
    uint32_t which;
    enum incode_turn turn = incode_front_next(&m->front, &which);
    if (turn == INCODE_TURN_COUNT) {
        uint32_t at = which % INCODE_COUNTS;
        if (m->brick[at] != which)
            return INCODE_WAITING;
        turn = incode_front_count(&m->front, m->points[at], &which);
    }
    if (turn == INCODE_TURN_TASK && incode_front_is_seed(&m->front, which))
        return want_seed(m, which);
    return turn == INCODE_TURN_WORKED || turn == INCODE_TURN_END
               ? INCODE_WORKED
               : INCODE_WAITING;
}

static enum incode_step work(struct incode_manager *m, uint32_t units) {
    uint32_t task;
    if (incode_front_is_finished(&m->front)) {
        m->used = m->taken.count; /* they come too late to count */
        return m->lists == 0 ? INCODE_FINISHED : INCODE_WAITING;
    }
    enum incode_turn turn =
        incode_front_turn(&m->front, incode_front_suspended(&m->front), &task);
    if (turn != INCODE_TURN_NEXT)
        return turn == INCODE_TURN_WORKED ? INCODE_WORKED : INCODE_WAITING;
    if (incode_manager_is_free(m))
        return pass(m);
    use_some(m, units);
    return INCODE_WORKED;
}

/* Whether it waits for an answer that nobody owes: to a face, a vertex or a
 * brick. */
static bool is_left_alone(const struct incode_manager *m) {
    uint32_t first, last;
    if (m->lists > 0 || !incode_manager_is_free(m) ||
        incode_front_is_finished(&m->front))
        return false;
    incode_front_own_left(&m->front, &first, &last);
    return m->front.afl.held_count > 0 || m->seed.asked ||
           (first < last && first < m->asked &&
            m->brick[first % INCODE_COUNTS] != first);
}

enum incode_step incode_manager_step(struct incode_manager *m, uint32_t units) {
    if (is_left_alone(m) && m->fault == NULL)
        m->fault = SHORT;
    if (incode_manager_fault(m) != NULL)
        return INCODE_BROKEN;
    enum incode_step step = work(m, units > 0 ? units : 1);
    m->spent++;
    return incode_manager_fault(m) != NULL ? INCODE_BROKEN : step;
}

int incode_manager_unspill(struct incode_manager *m, uint32_t brick,
                           const struct incode_face *faces, size_t count,
                           bool last) {
    return incode_front_unspill(&m->front, brick, faces, count, last);
}

/* ---- reports ---- */

const char *incode_manager_fault(const struct incode_manager *m) {
    if (m->front.afl.fault != NULL)
        return m->front.afl.fault;
    return m->front.fault != NULL ? m->front.fault : m->fault;
}

void incode_manager_statistics(const struct incode_manager *m,
                               struct incode_statistics *s) {
    const struct incode_front *front = &m->front;
    *s = (struct incode_statistics){.tetrahedra_kept = front->counts.kept,
                                    .hull_facets = front->counts.hull_facets,
                                    .seeds = front->counts.seeds,
                                    .afl_max = front->afl.count_max,
                                    .afl_spilled = front->counts.spilled,
                                    .memory_high_water = m->bytes};
}
