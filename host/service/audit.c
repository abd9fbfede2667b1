#include "audit.h"

#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "host/base/memory.h"
#include "host/base/progress.h"
#include "host/verify/judge.h"
#include "host/service/strategies/strategies.h"
#include "parts.h"
#include "service.h"

enum {
    SMALL = 1 << 19,   /* tetrahedra that are checked in a few ms */
    FAULTS_MAX = 4096, /* that the check locates */
    BRICK_TOUCHES = 4  /* bytes of what the ledger and the audit know of it */
};

/* --- the check, on a thread of its own ------------------------------------ */

/* What one analysis needs. */
struct inquiry {
    struct host_service *s;
    struct host_audit *audit;
    struct host_judge judge;
    unsigned named; /* nodes */
};

static void note_place(void *context, const uint64_t *tets, int tet_count,
                       const uint32_t *vertices, int count, const char *what) {
    struct host_audit *a = context;
    (void)what;
    /* Points without a tetrahedron prove nothing against a node: facets do. */
    unsigned most = HOST_AUDIT_PLACES / (tet_count == 0 ? 2u : 1u);
    if (a->places >= most)
        return;
    struct host_audit_place *place = &a->place[a->places++];
    memset(place, 0, sizeof *place);
    for (int i = 0; i < tet_count && i < 2; i++)
        place->tet[place->tets++] = tets[i];
    for (int i = 0; i < count && i < 5; i++)
        place->vertex[place->vertices++] = vertices[i];
}

static bool is_point(const struct host_order *order, uint32_t vertex) {
    uint32_t brick = vertex / INCODE_BRICK_POINTS;
    return brick < order->bricks &&
           vertex % INCODE_BRICK_POINTS < order->fill[brick];
}

static void redo(struct inquiry *q, uint32_t vertex) {
    if (is_point(q->s->order, vertex))
        q->audit->redo[vertex / INCODE_BRICK_POINTS] = 1;
}

/* The node is at fault; the reason is as of printf. */
__attribute__((format(printf, 3, 4))) static void
accuse_of(struct inquiry *q, uint32_t node, const char *format, ...) {
    struct host_audit *a = q->audit;
    if (a->guilty[node] != 0)
        return;
    a->guilty[node] = 1;
    if (q->named++ == 0) {
        va_list arguments;
        a->first = node;
        va_start(arguments, format);
        (void)vsnprintf(a->why, sizeof a->why, format, arguments);
        va_end(arguments);
    }
}

/* what: about a tetrahedron of these vertices. */
static void accuse(struct inquiry *q, uint32_t node, const char *what,
                   const uint32_t v[4]) {
    const uint32_t *row = q->s->order->row;
    accuse_of(q, node, "%s the tetrahedron of rows %u, %u, %u and %u", what,
              row[v[0]], row[v[1]], row[v[2]], row[v[3]]);
}

static uint32_t owner(const struct inquiry *q, const uint32_t v[4]) {
    return host_ledger_owner(&q->s->ledger, q->s->order, v);
}

/* The work on a brick is wrong.  If the node that committed the brick worked
 * alone, that node is at fault. */
static void doubt_brick(struct inquiry *q, uint32_t brick, const char *what,
                        const uint32_t v[4]) {
    uint16_t by = q->s->ledger.by[brick];
    if ((by & HOST_LEDGER_ALONE) != 0)
        accuse(q, host_ledger_by(&q->s->ledger, brick), what, v);
    q->audit->redo[brick] = 1;
}

static int compare_tets(const void *p, const void *q) {
    uint64_t a = *(const uint64_t *)p, b = *(const uint64_t *)q;
    return a < b ? -1 : a > b;
}

/* The tetrahedra of all places, each once, ascending; returns how many. */
static unsigned collect(const struct host_audit *a,
                        uint64_t tets[2 * HOST_AUDIT_PLACES]) {
    unsigned count = 0, kept = 0;
    for (unsigned i = 0; i < a->places; i++)
        for (unsigned k = 0; k < a->place[i].tets; k++)
            tets[count++] = a->place[i].tet[k];
    qsort(tets, count, sizeof tets[0], compare_tets);
    for (unsigned i = 0; i < count; i++)
        if (kept == 0 || tets[kept - 1] != tets[i])
            tets[kept++] = tets[i];
    return kept;
}

static bool has_vertex(const uint32_t v[4], uint32_t vertex) {
    return v[0] == vertex || v[1] == vertex || v[2] == vertex || v[3] == vertex;
}

static bool same_vertices(const uint32_t v[4], const uint32_t w[4]) {
    return has_vertex(v, w[0]) && has_vertex(v, w[1]) && has_vertex(v, w[2]) &&
           has_vertex(v, w[3]);
}

/* --- what is missing ------------------------------------------------------ */

/* Tetrahedra of the triangulation that may be missing in the result: they share
 * a facet with a right tetrahedron at a fault.  A hash table, so that one pass
 * over the result finds which of them it has. */
enum { MISSING_MAX = 8 * HOST_AUDIT_PLACES, TABLE = 4 * MISSING_MAX };

struct missing {
    uint32_t v[MISSING_MAX][4];
    bool there[MISSING_MAX];
    unsigned count;
    uint16_t next[MISSING_MAX], head[TABLE]; /* chains; MISSING_MAX: the end */
};

/* The same for every order of the vertices. */
static uint32_t hash_of(const uint32_t v[4]) {
    uint32_t sum = 0;
    for (int i = 0; i < 4; i++) {
        uint32_t mixed = (v[i] + 1) * UINT32_C(2654435761);
        sum += mixed ^ mixed >> 15;
    }
    return (sum ^ sum >> 15) % TABLE;
}

static void add_missing(struct missing *m, const uint32_t v[4]) {
    uint32_t at = hash_of(v);
    for (unsigned i = m->head[at]; i < MISSING_MAX; i = m->next[i])
        if (same_vertices(m->v[i], v))
            return;
    if (m->count < MISSING_MAX) {
        memcpy(m->v[m->count], v, sizeof m->v[0]);
        m->there[m->count] = false;
        m->next[m->count] = m->head[at];
        m->head[at] = (uint16_t)m->count++;
    }
}

static void look_beyond(const struct inquiry *q, struct missing *m,
                        const uint32_t t[4]) {
    static const uint8_t outward[4][3] = {
        {1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
    for (int i = 0; i < 4; i++) {
        uint32_t beyond[4] = {t[outward[i][0]], t[outward[i][1]],
                              t[outward[i][2]], 0};
        beyond[3] = host_judge_apex(&q->judge, beyond);
        if (beyond[3] != INCODE_NONE &&
            host_judge_tetrahedron(&q->judge, beyond))
            add_missing(m, beyond);
    }
}

/* A tetrahedron that is missing in the result was left out by the node that
 * committed its brick. */
static void judge_missing(struct inquiry *q, struct missing *m) {
    const struct host_tetrahedra *all = q->s->tets;
    for (uint64_t k = 0; m->count > 0 && k < all->count; k++) {
        host_call_trim(sizeof *all->v);
        for (unsigned i = m->head[hash_of(all->v[k])]; i < MISSING_MAX;
             i = m->next[i])
            m->there[i] |= same_vertices(m->v[i], all->v[k]);
    }
    for (unsigned i = 0; i < m->count; i++)
        if (!m->there[i])
            doubt_brick(q, owner(q, m->v[i]), "it left out", m->v[i]);
}

/* --- what is there -------------------------------------------------------- */

static bool is_judged(const struct inquiry *q, const uint32_t t[4]) {
    bool points = true;
    for (int i = 0; i < 4; i++)
        points = points && is_point(q->s->order, t[i]);
    return points && host_judge_tetrahedron(&q->judge, t);
}

/* A tetrahedron that is not Delaunay proves its sender at fault if the sender
 * worked alone.  Else the node that found it, or the node that passed it on, is
 * at fault. */
static void judge_wrong(struct inquiry *q, uint64_t tet) {
    const struct host_service *s = q->s;
    struct host_audit *a = q->audit;
    const uint32_t *t = s->tets->v[tet];
    uint32_t brick = owner(q, t), finder = host_ledger_finder(&s->ledger, tet);
    doubt_brick(q, brick, "it sent, and that is not Delaunay,", t);
    if (a->suspects[0] == '\0' &&
        (s->ledger.by[brick] & HOST_LEDGER_ALONE) == 0) {
        uint32_t sender = host_ledger_by(&s->ledger, brick);
        (void)snprintf(a->suspects, sizeof a->suspects,
                       sender == finder ? "node %u" : "node %u or node %u",
                       finder, sender);
    }
}

/* Tetrahedron i of those at faults. */
static void judge_tet(struct inquiry *q, struct missing *m,
                      const uint64_t *tets, unsigned i) {
    const uint32_t *t = q->s->tets->v[tets[i]];
    if (!is_judged(q, t)) {
        judge_wrong(q, tets[i]);
        return;
    }
    for (unsigned k = 0; k < i; k++)
        if (same_vertices(q->s->tets->v[tets[k]], t))
            doubt_brick(q, owner(q, t), "it sent twice", t);
    look_beyond(q, m, t);
}

/* If points have no tetrahedron at all, and one node has committed all of their
 * bricks, that node has left out their tetrahedra, or those around them. */
static void judge_points(struct inquiry *q) {
    const struct host_ledger *ledger = &q->s->ledger;
    uint32_t by = UINT32_MAX, vertex = 0;
    bool one = true;
    for (unsigned p = 0; p < q->audit->places; p++) {
        const struct host_audit_place *place = &q->audit->place[p];
        if (place->tets > 0 || place->vertices != 1)
            continue;
        vertex = place->vertex[0];
        uint32_t brick = vertex / INCODE_BRICK_POINTS;
        one = one && (ledger->by[brick] & HOST_LEDGER_ALONE) != 0 &&
              (by == UINT32_MAX || by == host_ledger_by(ledger, brick));
        by = host_ledger_by(ledger, brick);
    }
    if (one && by != UINT32_MAX && q->named == 0) {
        accuse_of(q, by, "it left out all tetrahedra of row %u",
                  q->s->order->row[vertex]);
    }
}

static void judge_places(struct inquiry *q, struct missing *m) {
    uint64_t tets[2 * HOST_AUDIT_PLACES];
    unsigned count = collect(q->audit, tets);
    for (unsigned i = 0; i < count; i++) {
        judge_tet(q, m, tets, i);
        for (int k = 0; k < 4; k++)
            redo(q, q->s->tets->v[tets[i]][k]);
    }
    for (unsigned p = 0; p < q->audit->places; p++)
        for (unsigned i = 0; i < q->audit->place[p].vertices; i++)
            redo(q, q->audit->place[p].vertex[i]);
    judge_missing(q, m);
    judge_points(q);
}

/* --- what is to be done again --------------------------------------------- */

/* Nothing from nodes at fault is trusted. */
static void redo_guilty(struct inquiry *q) {
    const struct host_service *s = q->s;
    const struct host_ledger *ledger = &s->ledger;
    for (uint32_t b = 0; b < ledger->bricks; b++) {
        host_call_trim(BRICK_TOUCHES);
        q->audit->redo[b] |= q->audit->guilty[host_ledger_by(ledger, b)];
    }
    uint64_t i = 0;
    for (size_t r = 0; r < ledger->runs; r++) {
        bool guilty = q->audit->guilty[ledger->found[r].node] != 0;
        for (; i < ledger->found[r].end; i++)
            if (guilty)
                q->audit->redo[owner(q, s->tets->v[i])] = 1;
    }
}

/* No node could be named.  The first time the bricks near the faults are done
 * again; the second time, all bricks that nodes did together as well; from the
 * third time on, or if no brick is near, all bricks. */
static void redo_unclear(struct inquiry *q) {
    const struct host_ledger *ledger = &q->s->ledger;
    struct host_audit *a = q->audit;
    bool together = a->unclear++ > 0, all = a->unclear > 2;
    uint32_t marked = 0;
    for (uint32_t b = 0; b < ledger->bricks; b++) {
        host_call_trim(BRICK_TOUCHES);
        a->redo[b] |=
            all || (together && (ledger->by[b] & HOST_LEDGER_ALONE) == 0);
        marked += a->redo[b];
    }
    for (uint32_t b = 0; b < ledger->bricks && marked == 0; b++) {
        host_call_trim(BRICK_TOUCHES);
        a->redo[b] = 1;
    }
}

static void analyse(struct host_service *s, struct host_audit *a) {
    struct inquiry q = {.s = s, .audit = a};
    const struct host_sites sites = host_sites_of_order(s->order);
    struct missing *missing = malloc(sizeof *missing);
    a->bricks = s->ledger.bricks;
    a->redo = host_map(a->bricks);
    a->guilty = calloc(s->machine->nodes + 1u, 1); /* host_kept_by */
    if (a->redo == NULL || a->guilty == NULL || missing == NULL) {
        host_fail_memory(&a->error, "the search for the faulty node");
    } else if (host_judge_make(&q.judge, &sites, &a->error) == 0) {
        missing->count = 0;
        for (unsigned i = 0; i < TABLE; i++)
            missing->head[i] = MISSING_MAX;
        judge_places(&q, missing);
        host_judge_free(&q.judge);
        if (q.named > 0)
            redo_guilty(&q);
        else
            redo_unclear(&q);
    }
    free(missing);
}

static void check(void *argument) {
    struct host_service *s = argument;
    struct host_audit *a = &s->audit;
    const struct host_sites sites = host_sites_of_order(s->order);
    const struct host_check_listener listener = {a, FAULTS_MAX, note_place};
    struct host_error failed = {0};
    (void)host_check(&sites, s->tets,
                     a->exact ? HOST_CHECK_DELAUNAY : HOST_CHECK_TILING,
                     &listener, &a->report, &failed);
    a->error = failed;
    if (failed.code == HOST_UNVERIFIED) {
        a->error.code = 0;
        analyse(s, a);
        a->error.code = a->error.code == 0 ? HOST_UNVERIFIED : a->error.code;
    }
    __atomic_store_n(&a->ended, true, __ATOMIC_RELEASE);
}

/* --- what follows --------------------------------------------------------- */

static bool is_exact_due(const struct host_service *s) {
    return s->verifying == HOST_VERIFY_ALWAYS ||
           (s->verifying == HOST_VERIFY_WHERE_DUE &&
            (s->foreign || s->audit.lost_work));
}

static void begin(struct host_service *s) {
    struct host_audit *a = &s->audit;
    a->exact = is_exact_due(s);
    a->places = 0;
    a->suspects[0] = '\0';
    a->ended = false;
    a->why[0] = '\0';
    a->state = HOST_AUDIT_RUNS;
    a->begun_us = s->machine->now_us(s->machine->context);
    host_progress_phase("checking", "Mtet");
    if (s->machine->virtual_time || (!a->exact && s->tets->count < SMALL))
        check(s);
    else
        host_fork_beside(&a->fork, check, s);
}

void host_audit_alone(struct host_service *service) {
    service->strategy = &host_redo;
    service->ledger.alone = true;
}

void host_audit_exclude(struct host_service *service, unsigned node,
                        const char *what) {
    struct host_service *s = service;
    s->excluded += !s->node[node].aside;
    s->node[node].left = s->node[node].aside = true;
    s->audit.lost_work = true;
    s->blamed = node;
    s->loss = true;
    host_notice(s, node,
                "%s; it is excluded, and other nodes do its work again; look "
                "after that node",
                what);
}

bool host_audit_is_other(const struct host_service *service, unsigned node) {
    const struct host_service *s = service;
    const uint8_t *guilty = s->audit.guilty;
    bool other = false;
    for (unsigned i = 0; i < s->machine->nodes && !other; i++) {
        other = i != node && !s->work.lost[i] && !s->node[i].aside &&
                !s->node[i].given_up && (guilty == NULL || guilty[i] == 0);
    }
    return other;
}

static int give_up(struct host_service *s, struct host_error *error) {
    const struct host_audit *a = &s->audit;
    if (a->why[0] != '\0') {
        return host_fail(error, HOST_UNVERIFIED,
                         "node %u: its result is wrong: %s; no other node is "
                         "left to do its bricks again; look after that node, "
                         "and run again",
                         a->first, a->why);
    }
    return host_fail(error, HOST_UNVERIFIED,
                     "check: %.*s; doing it again did not help, and no node "
                     "could be found at fault; please report this with the "
                     "points",
                     (int)strcspn(a->report.text, "\n"), a->report.text);
}

static int begin_again(struct host_service *s, struct host_error *error) {
    struct host_audit *a = &s->audit;
    char what[HOST_AUDIT_WHY_BYTES + 40];
    a->failed++;
    if (!host_audit_is_other(s, UINT_MAX) || a->failed > s->machine->nodes + 4u)
        return give_up(s, error);
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        if (a->guilty[i] != 0) {
            snprintf(what, sizeof what, "its result is wrong%s%s",
                     i == a->first ? ": " : "", i == a->first ? a->why : "");
            host_audit_exclude(s, i, what);
        }
    }
    if (a->guilty[s->machine->nodes] != 0) {
        host_notice_line(s, "the check of the result failed at work of an "
                            "earlier run; that work is done again");
    }
    if (a->why[0] == '\0') {
        char line[HOST_AUDIT_WHY_BYTES];
        snprintf(line, sizeof line,
                 "the check of the result failed%s%s; the bricks concerned are "
                 "done again, each by one node",
                 a->suspects[0] == '\0' ? "" : " at work of ", a->suspects);
        host_notice_line(s, line);
    }
    a->report.text[0] = '\0'; /* the bricks are done again */
    for (unsigned i = 0; i < s->machine->nodes; i++)
        s->ledger.job[i].epoch = 0; /* results under way do not count */
    host_progress_phase("triangulating", "Mtet");
    for (uint32_t b = 0; b < s->ledger.bricks; b++) {
        host_call_trim(BRICK_TOUCHES);
        if (a->redo[b] == 0)
            continue;
        host_ledger_reopen(&s->ledger, b);
        if (host_kept_brick(s->kept, &s->ledger, b, error) != 0)
            return error->code;
    }
    host_audit_alone(s);
    a->lost_work = true;
    a->state = HOST_AUDIT_DUE;
    s->loss = true;
    return 0;
}

static void free_verdict(struct host_audit *a) {
    host_unmap(a->redo, a->bricks);
    free(a->guilty);
    a->redo = a->guilty = NULL;
}

int host_audit_step(struct host_service *service, bool *passed,
                    struct host_error *error) {
    struct host_service *s = service;
    struct host_audit *a = &s->audit;
    int status = 0;
    *passed = a->state == HOST_AUDIT_PASSED;
    if (a->state == HOST_AUDIT_DUE)
        begin(s);
    if (a->state != HOST_AUDIT_RUNS ||
        !__atomic_load_n(&a->ended, __ATOMIC_ACQUIRE))
        return 0;
    host_fork_join(&a->fork);
    a->spent_us += s->machine->now_us(s->machine->context) - a->begun_us;
    if (a->error.code == 0 && is_exact_due(s) && !a->exact) {
        a->state = HOST_AUDIT_DUE; /* a node was lost meanwhile */
    } else if (a->error.code == 0) {
        a->state = HOST_AUDIT_PASSED;
        *passed = true;
    } else if (a->error.code == HOST_UNVERIFIED) {
        status = begin_again(s, error);
    } else {
        *error = a->error;
        status = error->code;
    }
    free_verdict(a);
    return status;
}

void host_audit_free(struct host_audit *audit) {
    host_fork_join(&audit->fork);
    free_verdict(audit);
}

/* --- faults --------------------------------------------------------------- */

void host_faults_begin(struct host_service *service) {
    service->fault.told = false;
    for (unsigned i = 0; i < service->machine->nodes; i++)
        service->node[i].vouches = HOST_VOUCHES;
}

/* What to do about a fault that a node reports, by a word of its text; NULL: a
 * loss may explain it. */
static const char *advice(const char *text) {
    static const char *const known[][2] = {
        {"takes no record", "mend that, then reset the board"},
        {"memory", "give the nodes more memory"},
        {"protocol version", "run the same version of the program everywhere"},
        {"role", "run the same version of the program everywhere"}};
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++)
        if (strstr(text, known[i][0]) != NULL)
            return known[i][1];
    return NULL;
}

static int fail(const struct host_service *s, struct host_error *error) {
    const char *next = advice(s->fault.text);
    if (strstr(s->fault.text, "no program is running") != NULL) {
        return host_fail(error, HOST_CUBE,
                         "node %u: %s; bring one with: incode flash %s IMAGE, "
                         "where make firmware has made IMAGE, "
                         "build/firmware/BOARD.img",
                         s->fault.node, s->fault.text, host_where(s->machine));
    }
    next = next != NULL ? next : "please report this with the points";
    bool told = strstr(s->fault.text, next) != NULL;
    return host_fail(error, HOST_CUBE, "node %u: %s%s%s", s->fault.node,
                     s->fault.text, told ? "" : "; ", told ? "" : next);
}

/* A list that nodes share may be too small for what they send each other, where
 * the one of a node that works alone is not. */
static bool may_go_on(const struct host_service *s) {
    return !s->ledger.alone &&
           strstr(s->fault.text, "active face list") != NULL;
}

int host_faults_take(struct host_service *service,
                     const struct cube_message *message,
                     struct host_error *error) {
    struct host_service *s = service;
    size_t size = message->size < NODE_FAULT_TEXT_MAX ? message->size
                                                      : NODE_FAULT_TEXT_MAX;
    if (s->fault.told)
        return 0; /* the first is enough */
    memcpy(s->fault.text, message->data, size);
    s->fault.text[size] = '\0';
    s->fault.node = message->source;
    if (!s->started || (advice(s->fault.text) != NULL && !may_go_on(s)))
        return fail(s, error);
    s->fault.told = true;
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        if (!s->work.lost[i]) {
            s->node[i].vouches = HOST_DOUBTED;
            s->node[i].ping_due = true;
        }
    }
    return 0;
}

void host_faults_pinged(struct host_service *service, unsigned node,
                        uint32_t count) {
    struct host_node *n = &service->node[node];
    if (n->vouches == HOST_DOUBTED) {
        n->vouches = HOST_ASKED;
        n->asked = count;
    }
}

/* Nodes that have left are not asked. */
static bool all_vouch(const struct host_service *s) {
    for (unsigned i = 0; i < s->machine->nodes; i++)
        if (s->node[i].vouches != HOST_VOUCHES && !s->node[i].left)
            return false;
    return true;
}

/* If nodes work together, another node's message may have caused the fault; a
 * node that works alone is itself at fault.  The run goes on as long as another
 * node is left. */
static int believe(struct host_service *s, struct host_error *error) {
    char why[NODE_FAULT_TEXT_MAX + 40];
    unsigned node = s->fault.node;
    s->fault.told = false;
    if (!s->ledger.alone) {
        host_notice(s, node, "reports: %s; from now on each node works alone",
                    s->fault.text);
        host_audit_alone(s);
        s->loss = true;
        return 0;
    }
    if (!host_audit_is_other(s, node))
        return fail(s, error);
    snprintf(why, sizeof why, "reports: %s", s->fault.text);
    host_audit_exclude(s, node, why);
    return 0;
}

int host_faults_answered(struct host_service *service, unsigned node,
                         uint32_t count, struct host_error *error) {
    struct host_node *n = &service->node[node];
    if (n->vouches == HOST_ASKED && (int32_t)(count - n->asked) >= 0)
        n->vouches = HOST_VOUCHES;
    return service->fault.told && all_vouch(service) ? believe(service, error)
                                                     : 0;
}
