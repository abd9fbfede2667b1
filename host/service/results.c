#include "results.h"

#include <stdio.h>

#include "idle_nodes.h"
#include "node/result.h"

enum { WHY_BYTES = 120 };

static bool is_point(const struct host_order *order, uint32_t vertex)
{
    uint32_t brick = vertex / INCODE_BRICK_POINTS;
    return brick < order->bricks &&
           vertex % INCODE_BRICK_POINTS < order->fill[brick];
}

/* Whether the vertex, below the number of all, is a point of a brick of the job
 * that is not committed. */
static bool is_open(const struct host_service *s, const struct host_job *job,
                    uint32_t vertex)
{
    uint32_t brick = vertex / INCODE_BRICK_POINTS;
    uint32_t points = s->order->fill[brick] & s->ledger.open[brick];
    return (vertex % INCODE_BRICK_POINTS < points) &
           (brick - job->first < job->last - job->first);
}

static bool is_different(const uint32_t v[4])
{
    return (v[0] != v[1]) & (v[0] != v[2]) & (v[0] != v[3]) & (v[1] != v[2]) &
           (v[1] != v[3]) & (v[2] != v[3]);
}

/* Who owns a tetrahedron is looked up only where it is not all the same: as
 * long as none of its bricks is committed, that is at the job's borders. */
static bool is_sound(const struct host_service *s, const struct host_job *job,
                     const uint32_t v[4])
{
    bool different = is_different(v), open = different;
    for (int i = 0; i < 4; i++) {
        open &= is_open(s, job, v[i]);
    }
    if (open) {
        return true;
    }
    if (!different || !is_point(s->order, v[0]) || !is_point(s->order, v[1]) ||
        !is_point(s->order, v[2]) || !is_point(s->order, v[3])) {
        return false;
    }
    uint32_t brick = host_ledger_owner(&s->ledger, s->order, v);
    return brick >= job->first && brick < job->last &&
           !host_ledger_committed(&s->ledger, brick);
}

/* What is_sound found. */
static void describe(const struct host_service *s, const struct host_job *job,
                     const uint32_t v[4], char why[WHY_BYTES])
{
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

int host_results_refuse(struct host_service *service, unsigned node,
                        const char *why, struct host_error *error)
{
    return host_idle_leave(service, node, why)
               ? 0
               : host_fail(error, HOST_CUBE,
                           "node %u: %s, and had its new start before; are "
                           "host and node of one version? run make",
                           node, why);
}

static bool is_spilled(const struct host_service *s, const struct host_job *job,
                       const uint32_t f[3])
{
    uint32_t brick = f[0] / INCODE_BRICK_POINTS;
    bool mark = f[1] == INCODE_NONE && f[2] == INCODE_NONE &&
                brick >= job->first && brick < job->last;
    bool face = is_point(s->order, f[1]) && is_point(s->order, f[2]) &&
                f[0] != f[1] && f[0] != f[2] && f[1] != f[2];
    return is_point(s->order, f[0]) && (mark || face);
}

int host_results_spill(struct host_service *service, unsigned node,
                       const struct incode_face *faces, uint32_t count,
                       struct host_error *error)
{
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t *f = faces[i].v;
        if (!is_spilled(service, &service->ledger.job[node], f)) {
            char why[WHY_BYTES];
            snprintf(why, sizeof why,
                     "spilled vertices %u, %u and %u, which are no face", f[0],
                     f[1], f[2]);
            return host_results_refuse(service, node, why, error);
        }
    }
    return host_spill_put(&service->spill, node, faces, count, error);
}

/* Rows go straight to their place; a commit may follow any of them. */
int host_results_take(struct host_service *service,
                      const struct cube_message *message,
                      struct host_error *error)
{
    struct host_service *s = service;
    const size_t header = sizeof(struct node_result_header);
    const struct host_job *job = &s->ledger.job[message->source];
    struct node_result_reader reader;
    enum node_result_event event;
    char why[WHY_BYTES];
    /* Four bytes are the least that a tetrahedron takes. */
    size_t room = message->size / 4u + 1, count;
    node_result_open(&reader, message->data + header, message->size - header,
                     s->order->bricks * INCODE_BRICK_POINTS, message->source,
                     s->machine->nodes);
    do {
        uint32_t(*rows)[4] = host_tetrahedra_room(s->tets, room, error);
        if (rows == NULL) {
            return error->code;
        }
        event = node_result_read(&reader, rows, room, &count);
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
        host_tetrahedra_keep(s->tets, count);
        s->node[message->source].unreported += count;
        if (event == NODE_RESULT_COMMIT &&
            s->strategy->commit(&s->work, message->source, reader.brick) != 0) {
            snprintf(why, sizeof why, "committed brick %u, not of its job",
                     reader.brick);
            return host_results_refuse(s, message->source, why, error);
        }
    } while (event != NODE_RESULT_END);
    return 0;
}
