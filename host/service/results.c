#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "parts.h"
#include "host/base/parallel.h"
#include "host/verify/judge.h"
#include "node/result.h"
#include "node/page_check.h"

enum { WHY_BYTES = 120 };

static bool is_point(const struct host_order *order, uint32_t vertex) {
    uint32_t brick = vertex / INCODE_BRICK_POINTS;
    return brick < order->bricks &&
           vertex % INCODE_BRICK_POINTS < order->fill[brick];
}

/* Whether the vertex, below the number of all, is a point of a brick of the job
 * that is not committed. */
static bool is_open(const struct host_service *s, const struct host_job *job,
                    uint32_t vertex) {
    uint32_t brick = vertex / INCODE_BRICK_POINTS;
    uint32_t points = s->order->fill[brick] & s->ledger.open[brick];
    return (vertex % INCODE_BRICK_POINTS < points) &
           (brick - job->first < job->last - job->first);
}

static bool is_different(const uint32_t v[4]) {
    return (v[0] != v[1]) & (v[0] != v[2]) & (v[0] != v[3]) & (v[1] != v[2]) &
           (v[1] != v[3]) & (v[2] != v[3]);
}

/* Which brick owns a tetrahedron is looked up only where it is not all the
 * same: as long as none of its bricks is committed, that is at the job's
 * borders. */
static bool is_sound(const struct host_service *s, const struct host_job *job,
                     const uint32_t v[4]) {
    bool different = is_different(v), open = different;
    for (int i = 0; i < 4; i++)
        open &= is_open(s, job, v[i]);
    if (open)
        return true;
    if (!different || !is_point(s->order, v[0]) || !is_point(s->order, v[1]) ||
        !is_point(s->order, v[2]) || !is_point(s->order, v[3]))
        return false;
    uint32_t brick = host_ledger_owner(&s->ledger, s->order, v);
    return brick >= job->first && brick < job->last &&
           !host_ledger_committed(&s->ledger, brick);
}

/* What is_sound found. */
static void describe(const struct host_service *s, const struct host_job *job,
                     const uint32_t v[4], char why[WHY_BYTES]) {
    for (int i = 0; i < 4; i++) {
        if (!is_point(s->order, v[i])) {
            snprintf(why, WHY_BYTES,
                     "a result with vertex %u, which is no point", v[i]);
            return;
        }
        for (int k = 0; k < i; k++) {
            if (v[i] == v[k]) {
                snprintf(why, WHY_BYTES, "a result with vertex %u twice", v[i]);
                return;
            }
        }
    }
    uint32_t brick = host_ledger_owner(&s->ledger, s->order, v);
    snprintf(why, WHY_BYTES, "a result of brick %u, %s", brick,
             brick >= job->first && brick < job->last
                 ? "which it has committed before"
                 : "which is not of its job");
}

/* The node is started again if the host can do that, once.  Else it is
 * excluded, and the run goes on; if it was the last node, the run ends. */
int host_results_refuse(struct host_service *service, unsigned node,
                        const char *why, struct host_error *error) {
    struct host_service *s = service;
    bool can_start = s->machine->kill != NULL && !s->node[node].started_anew;
    if (!can_start && !host_audit_is_other(s, node)) {
        s->node[node].left = true;
        return host_fail(
            error, HOST_UNVERIFIED,
            "node %u: %s%s; no other node is left to do its work; "
            "are host and node of one version? run make",
            node, why,
            s->node[node].started_anew ? ", and had its new start before" : "");
    }
    if (can_start && host_idle_leave(s, node, why))
        return 0;
    char again[WHY_BYTES + 20];
    snprintf(again, sizeof again, "%s%s", why,
             s->node[node].started_anew ? ", again" : "");
    host_audit_exclude(s, node, again);
    return 0;
}

/* --- bounds --------------------------------------------------------------- */

/* How many tetrahedra, or faces, are judged when a bound is passed.  If half of
 * all were wrong, a sample would have no wrong one once in 2^64 times. */
enum { SAMPLE = 64, SPILLED_A_BRICK = 1024, SPILLED_MIN = 65536 };

/* An index below count that no node can predict (xorshift: Marsaglia, Journal
 * of Statistical Software 8, 2003). */
static uint64_t draw(struct host_service *s, uint64_t count) {
    uint64_t x = s->audit.secret | 1;
    x ^= x << 13;
    x ^= x >> 7;
    x ^= x << 17;
    s->audit.secret = x;
    return (x >> 11) % count;
}

/* The tetrahedra that the node's job has, in a list of their own. */
static int rows_of_job(const struct host_service *s, const struct host_job *job,
                       struct host_tetrahedra *rows, struct host_error *error) {
    if (host_tetrahedra_room(rows, job->rows, error) == NULL)
        return error->code;
    for (uint64_t i = 0; i < s->tets->count; i++) {
        const uint32_t *v = s->tets->v[i];
        uint32_t brick = host_ledger_owner(&s->ledger, s->order, v);
        if (brick >= job->first && brick < job->last && rows->count < job->rows)
            memcpy(rows->v[rows->count++], v, sizeof *rows->v);
    }
    return 0;
}

/* Whether rows are there twice, which are sorted then: of tetrahedra, in
 * whatever order their vertices are, and of faces turned the same way. */
static bool are_twice(struct host_tetrahedra *rows) {
    bool twice = false;
    host_tetrahedra_sort(rows);
    for (uint64_t i = 1; i < rows->count && !twice; i++) {
        const uint32_t *v = rows->v[i], *w = rows->v[i - 1];
        bool mirrored = v[2] == w[3] && v[3] == w[2] && v[2] != INCODE_NONE &&
                        v[3] != INCODE_NONE;
        host_call_trim(sizeof *rows->v);
        twice = v[0] == w[0] && v[1] == w[1] &&
                ((v[2] == w[2] && v[3] == w[3]) || mirrored);
    }
    return twice;
}

/* Why rows are not all tetrahedra of the triangulation, each once; NULL: at
 * least most of them are. */
static const char *why_too_many(struct host_service *s,
                                const struct host_judge *judge,
                                struct host_tetrahedra *rows) {
    for (unsigned i = 0; i < SAMPLE && rows->count > 0; i++)
        if (!host_judge_tetrahedron(judge, rows->v[draw(s, rows->count)]))
            return "more results than its points allow, and wrong ones";
    return are_twice(rows)
               ? "more results than its points allow, and some twice"
               : NULL;
}

/* A job has more results than its bound.  They are judged.  If they are right,
 * as about a hub or on two skew lines, the bound is doubled.  So a node can
 * make the host keep at most twice the right results, and a constant. */
static int look_through_rows(struct host_service *s, unsigned node,
                             struct host_error *error) {
    struct host_job *job = &s->ledger.job[node];
    const struct host_sites sites = host_sites_of_order(s->order);
    struct host_judge judge;
    struct host_tetrahedra rows = {0};
    const char *why = NULL;
    if (host_judge_make(&judge, &sites, error) != 0)
        return error->code;
    if (rows_of_job(s, job, &rows, error) == 0)
        why = why_too_many(s, &judge, &rows);
    host_tetrahedra_free(&rows);
    host_judge_free(&judge);
    job->rows_max = 2 * job->rows;
    return error->code != 0 ? error->code
           : why != NULL    ? host_results_refuse(s, node, why, error)
                            : 0;
}

static bool is_spilled(const struct host_service *s, const struct host_job *job,
                       const uint32_t f[3]) {
    uint32_t brick = f[0] / INCODE_BRICK_POINTS;
    bool mark = f[1] == INCODE_NONE && f[2] == INCODE_NONE &&
                brick >= job->first && brick < job->last;
    bool face = is_point(s->order, f[1]) && is_point(s->order, f[2]) &&
                f[0] != f[1] && f[0] != f[2] && f[1] != f[2];
    return is_point(s->order, f[0]) && (mark || face);
}

/* Whether a face is a facet of the triangulation: whether a tetrahedron of the
 * triangulation lies on either side of it. */
static bool is_facet(const struct host_judge *judge, const uint32_t f[3]) {
    for (int side = 0; side < 2; side++) {
        uint32_t t[4] = {f[0], f[side == 0 ? 1 : 2], f[side == 0 ? 2 : 1], 0};
        t[3] = host_judge_apex(judge, t);
        if (t[3] != INCODE_NONE && host_judge_tetrahedron(judge, t))
            return true;
    }
    return false;
}

/* Why faces are not all open faces of the node's front, each once; NULL: at
 * least most of them are.  A face is open once in each direction. */
static const char *why_spilled(struct host_service *s,
                               const struct host_judge *judge,
                               struct host_tetrahedra *faces) {
    for (unsigned i = 0; i < SAMPLE && faces->count > 0; i++)
        if (!is_facet(judge, faces->v[draw(s, faces->count)]))
            return "more spilled faces than its points allow, and wrong ones";
    return are_twice(faces)
               ? "more spilled faces than its points allow, and some twice"
               : NULL;
}

/* As look_through_rows, for the faces that the host keeps for the node. */
static int look_through_faces(struct host_service *s, unsigned node,
                              struct host_error *error) {
    struct host_node *n = &s->node[node];
    const struct host_sites sites = host_sites_of_order(s->order);
    struct host_judge judge;
    struct host_tetrahedra faces = {0};
    if (host_judge_make(&judge, &sites, error) != 0)
        return error->code;
    if (host_spill_copy(&s->spill, node, &faces, error) == 0) {
        const char *why = why_spilled(s, &judge, &faces);
        /* Faces that are on their way back are not judged. */
        n->spilled_max = n->spilled + (faces.count > SPILLED_MIN ? faces.count
                                                                 : SPILLED_MIN);
        if (why != NULL)
            (void)host_results_refuse(s, node, why, error);
    }
    host_tetrahedra_free(&faces);
    host_judge_free(&judge);
    return error->code;
}

int host_results_spill(struct host_service *service, unsigned node,
                       const struct incode_face *faces, uint32_t count,
                       struct host_error *error) {
    struct host_node *n = &service->node[node];
    const struct host_job *job = &service->ledger.job[node];
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t *f = faces[i].v;
        if (!is_spilled(service, job, f)) {
            char why[WHY_BYTES];
            snprintf(why, sizeof why,
                     "spilled vertices %u, %u and %u, which are no face", f[0],
                     f[1], f[2]);
            return host_results_refuse(service, node, why, error);
        }
    }
    uint64_t least =
        SPILLED_MIN + (uint64_t)SPILLED_A_BRICK * (job->last - job->first);
    uint64_t before = service->spill.faces;
    if (host_spill_put(&service->spill, node, faces, count, error) != 0)
        return error->code;
    n->spilled += service->spill.faces - before;
    n->spilled_max = n->spilled_max < least ? least : n->spilled_max;
    return n->spilled <= n->spilled_max
               ? 0
               : look_through_faces(service, node, error);
}

/* Rows go straight to their place; a commit may follow any of them. */
int host_results_take(struct host_service *service,
                      const struct cube_message *message,
                      struct host_error *error) {
    struct host_service *s = service;
    const size_t header = sizeof(struct node_result_header);
    struct host_job *job = &s->ledger.job[message->source];
    struct node_result_reader reader;
    enum node_result_event event;
    char why[WHY_BYTES];
    if (s->ledger.committed == s->ledger.bricks) {
        return host_results_refuse(s, message->source,
                                   "results when all bricks were committed",
                                   error);
    }
    /* Four bytes are the least that a tetrahedron takes. */
    size_t room = message->size / 4u + 1, count;
    node_result_open(&reader, message->data + header, message->size - header,
                     s->order->bricks * INCODE_BRICK_POINTS, message->source,
                     s->machine->nodes);
    do {
        uint32_t(*rows)[4] = host_tetrahedra_room(s->tets, room, error);
        if (rows == NULL)
            return error->code;
        event = node_result_read(&reader, rows, room, &count);
        host_call_trim(count * sizeof *rows);
        if (event == NODE_RESULT_GARBAGE) {
            return host_results_refuse(s, message->source, "invalid results",
                                       error);
        }
        for (size_t i = 0; i < count; i++) {
            if (!is_sound(s, job, rows[i])) {
                describe(s, job, rows[i], why);
                return host_results_refuse(s, message->source, why, error);
            }
        }
        /* A node that works alone has found all its tetrahedra itself. */
        uint32_t finder =
            s->ledger.alone ? message->source : (uint32_t)reader.finder;
        if (host_ledger_found(&s->ledger, finder, count, error) != 0)
            return error->code;
        host_tetrahedra_keep(s->tets, count);
        host_kept_rows(s->kept, &s->ledger, s->order,
                       (const uint32_t(*)[4])rows, count);
        job->rows += count;
        s->node[message->source].unreported += count;
        if (event == NODE_RESULT_COMMIT &&
            s->strategy->commit(&s->work, message->source, reader.brick) != 0) {
            snprintf(why, sizeof why, "committed brick %u, not of its job",
                     reader.brick);
            return host_results_refuse(s, message->source, why, error);
        }
        if (event == NODE_RESULT_COMMIT &&
            host_kept_brick(s->kept, &s->ledger, reader.brick, error) != 0)
            return error->code;
    } while (event != NODE_RESULT_END);
    return job->rows <= job->rows_max
               ? 0
               : look_through_rows(s, message->source, error);
}

/* --- sending -------------------------------------------------------------- */

static bool send_counted(struct host_service *s, uint16_t to, uint8_t type,
                         const void *data, size_t size) {
    bool sent = cube_write(s->cube, to, type, data, size) == 0;
    s->node[to].sent += sent;
    return sent;
}

bool host_sending_write(void *service, unsigned node, uint8_t type,
                        const void *data, size_t size) {
    return send_counted(service, (uint16_t)node, type, data, size);
}

bool host_sending_write_to_all(void *service, uint8_t type, const void *data,
                               size_t size) {
    struct host_service *s = service;
    if (cube_write(s->cube, CUBE_ALL, type, data, size) != 0)
        return false;
    for (unsigned i = 0; i < s->machine->nodes; i++)
        s->node[i].sent++;
    if (type == NODE_PAGE_TO_ALL)
        s->page_bytes_to_all += size - sizeof(struct node_page_head);
    return true;
}

static bool send_page(struct host_service *s, uint16_t to) {
    struct node_page_message body;
    struct host_node *node = &s->node[to];
    if (cube_room(s->cube, to) == 0)
        return false;
    body.head.page = node->pages[node->pages_first];
    host_call_trim(HOST_CALL_AROUND);
    size_t size = host_page(s->order, body.head.page, body.data);
    if (!send_counted(s, to, NODE_PAGE, &body,
                      node_page_seal(&body, s->setup.page_key, size)))
        return false;
    node->pages_first = (node->pages_first + 1) % HOST_PAGES_QUEUED_MAX;
    node->pages_count--;
    s->report[to].pages++;
    s->report[to].page_bytes += size;
    host_paging_sent(s);
    return true;
}

static bool send_unspill(struct host_service *s, uint16_t to,
                         struct host_error *error) {
    struct {
        struct node_spill_header header;
        struct incode_face faces[NODE_FACES_A_MESSAGE];
    } body;
    struct host_node *node = &s->node[to];
    struct host_spill_list *list = &node->unspills[node->unspills_first].list;
    if (cube_room(s->cube, to) == 0)
        return false;
    body.header = node->unspills[node->unspills_first].header;
    if (host_spill_take(&s->spill, list, body.faces, NODE_FACES_A_MESSAGE,
                        &body.header.count, error) != 0)
        return false;
    assert(node->spilled >= body.header.count);
    node->spilled -= body.header.count;
    body.header.last = list->faces == 0;
    body.header.sent = node->sent - node->missed;
    if (body.header.last) {
        node->unspills_first = (node->unspills_first + 1) % HOST_UNSPILLS_MAX;
        node->unspills_count--;
    }
    return send_counted(s, to, NODE_UNSPILL, &body,
                        sizeof body.header +
                            body.header.count * sizeof body.faces[0]);
}

static void give_job(struct host_service *s, unsigned to,
                     const struct incode_job *job) {
    struct host_node *node = &s->node[to];
    node->job.job = *job;
    node->job.epoch = host_ledger_open(&s->ledger, to, job->first, job->last);
    node->job_due = true;
    node->working = true;
    node->reported = false;
    s->working++;
}

void host_sending_deal(struct host_service *service) {
    struct host_service *s = service;
    struct incode_job job;
    s->dealt = true;
    s->work.frames = UINT32_MAX;
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        uint32_t frames = s->report[i].map.map.pages;
        if (!s->work.lost[i] && frames < s->work.frames)
            s->work.frames = frames;
    }
    for (unsigned i = 0; i < s->machine->nodes; i++)
        if (!s->work.lost[i] && s->strategy->first(&s->work, i, &job))
            give_job(s, i, &job);
}

void host_sending_begin(struct host_service *service) {
    struct host_service *s = service;
    s->dealt = false;
    s->working = 0;
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        struct host_node *node = &s->node[i];
        node->pages_first = node->pages_count = 0;
        node->unspills_first = node->unspills_count = 0;
        node->results = 0;
        node->credit = s->setup.credits;
        node->setup_due = true;
        node->job_due = node->report_due = false;
        node->working = node->reported = false;
        node->spilled = node->spilled_max = 0;
    }
}

/* What the strategy has, and what the node has asked for, in turn: a strategy
 * that always has something would leave no room for pages. */
static bool serve_data(struct host_service *s, uint16_t to,
                       struct host_error *error) {
    struct host_node *node = &s->node[to];
    bool asked = node->unspills_count > 0 || node->pages_count > 0;
    if (s->strategy->send != NULL && !(asked && node->strategy_last) &&
        s->strategy->send(&s->work, to)) {
        node->strategy_last = true;
        return true;
    }
    if (asked && (node->unspills_count > 0 ? send_unspill(s, to, error)
                                           : send_page(s, to))) {
        node->strategy_last = false;
        return true;
    }
    return false;
}

/* The next message that is due to this node, pings apart; false: none, or no
 * room. */
static bool serve_work(struct host_service *s, uint16_t to,
                       struct host_error *error) {
    struct host_node *node = &s->node[to];
    if (!s->started || !s->report[to].up)
        return false; /* what goes before the first answer may get lost */
    if (node->setup_due) {
        struct node_setup_message setup = s->setup;
        s->strategy->set_up(&s->work, to, &setup);
        node->setup_due =
            !send_counted(s, to, NODE_SETUP, &setup, sizeof setup);
        host_idle_progress(s, to);
        return !node->setup_due;
    }
    struct incode_job job;
    if (s->dealt && !node->working && s->strategy->next(&s->work, to, &job))
        give_job(s, to, &job);
    if (node->job_due) {
        node->job_due =
            !send_counted(s, to, NODE_JOB, &node->job, sizeof node->job);
        host_idle_progress(s, to);
        return !node->job_due;
    }
    if (node->report_due) {
        node->report_due = !send_counted(s, to, NODE_REPORT, NULL, 0);
        host_idle_progress(s, to);
        return !node->report_due;
    }
    /* Half of the credit back at a time. */
    uint32_t credit = node->results + s->setup.credits;
    if (credit - node->credit >= s->setup.credits / 2) {
        if (!send_counted(s, to, NODE_CREDIT, &credit, sizeof credit))
            return false;
        node->credit = credit;
        return true;
    }
    return serve_data(s, to, error);
}

/* What goes before the first answer may get lost. */
static bool serve_watchers(struct host_service *s, uint16_t to) {
    struct node_question_message question;
    if (!host_watching_due(&s->watching, to, &question) || !s->report[to].up ||
        !send_counted(s, to, NODE_QUESTION, &question, sizeof question))
        return false;
    host_watching_sent(&s->watching, to);
    return true;
}

/* A ping and a message of work in turn: on a slow wire the pings of many nodes
 * would leave no room for anything else. */
static bool serve_node(struct host_service *s, uint16_t to,
                       struct host_error *error) {
    struct host_node *node = &s->node[to];
    if (s->work.lost[to])
        return false;
    if (node->ping_due && !node->ping_last) {
        node->ping_last = host_detector_ping(s, to);
        return node->ping_last;
    }
    if (serve_watchers(s, to))
        return true;
    if (serve_work(s, to, error)) {
        node->ping_last = false;
        return true;
    }
    return node->ping_due && host_detector_ping(s, to);
}

/* Whether the node whose turn it was has another: for pages, of which the
 * strategy has some sent in a row. */
static bool goes_on(struct host_service *s, struct host_node *node) {
    bool more = node->pages_count > 0 &&
                node->pages_in_a_row + 1 < s->strategy->pages_in_a_row;
    node->pages_in_a_row = more ? node->pages_in_a_row + 1 : 0;
    return more;
}

unsigned host_sending_serve(struct host_service *service,
                            struct host_error *error) {
    struct host_service *s = service;
    unsigned sent = 0, idle = 0;
    while (idle < s->machine->nodes && error->code == 0) {
        if (serve_node(s, (uint16_t)s->turn, error)) {
            sent++;
            idle = 0;
            if (goes_on(s, &s->node[s->turn]))
                continue;
        } else {
            idle++;
        }
        s->turn = (s->turn + 1) % s->machine->nodes;
    }
    return sent;
}

bool host_sending_pages_wait(const struct host_service *service) {
    for (unsigned i = 0; i < service->machine->nodes; i++)
        if (service->node[i].pages_count > 0)
            return true;
    return false;
}
