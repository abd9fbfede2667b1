#include "results.h"

#include <stdio.h>

#include "idle_nodes.h"
#include "incode/front/owner.h"
#include "node/result.h"

enum { WHY_BYTES = 120 };

static bool is_point(const struct host_order *order, uint32_t vertex)
{
    uint32_t brick = vertex / INCODE_BRICK_POINTS;
    return brick < order->bricks &&
           vertex % INCODE_BRICK_POINTS < order->fill[brick];
}

static uint32_t owner_of(const struct host_order *order, const uint32_t v[4])
{
    double at[4][3];
    for (int i = 0; i < 4; i++) {
        host_vertex(order, v[i], at[i]);
    }
    const double *const p[4] = {at[0], at[1], at[2], at[3]};
    return v[incode_owner(p)] / INCODE_BRICK_POINTS;
}

static bool is_sound(const struct host_service *s, const struct host_job *job,
                     const uint32_t v[4])
{
    if (!is_point(s->order, v[0]) || !is_point(s->order, v[1]) ||
        !is_point(s->order, v[2]) || !is_point(s->order, v[3]) ||
        v[0] == v[1] || v[0] == v[2] || v[0] == v[3] || v[1] == v[2] ||
        v[1] == v[3] || v[2] == v[3]) {
        return false;
    }
    uint32_t brick = owner_of(s->order, v);
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
    uint32_t brick = owner_of(s->order, v);
    snprintf(why, WHY_BYTES, "a result of brick %u, %s", brick,
             brick >= job->first && brick < job->last
                 ? "which it has committed before"
                 : "which is not of its job");
}

/* The node is named, and does its job no more. */
static int refuse(struct host_service *s, unsigned node, const char *why,
                  struct host_error *error)
{
    return host_idle_leave(s, node, why)
               ? 0
               : host_fail(error, HOST_CUBE,
                           "node %u: %s, and so before its new start; are host "
                           "and node of one version? run make",
                           node, why);
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
                     s->order->bricks * INCODE_BRICK_POINTS);
    do {
        uint32_t(*rows)[4] = host_tetrahedra_room(s->tets, room, error);
        if (rows == NULL) {
            return error->code;
        }
        event = node_result_read(&reader, rows, room, &count);
        if (event == NODE_RESULT_GARBAGE) {
            return refuse(s, message->source, "invalid results", error);
        }
        for (size_t i = 0; i < count; i++) {
            if (!is_sound(s, job, rows[i])) {
                describe(s, job, rows[i], why);
                return refuse(s, message->source, why, error);
            }
        }
        host_tetrahedra_keep(s->tets, count);
        s->node[message->source].unreported += count;
        if (event == NODE_RESULT_COMMIT &&
            s->strategy->commit(&s->work, message->source, reader.brick) != 0) {
            snprintf(why, sizeof why, "committed brick %u, not of its job",
                     reader.brick);
            return refuse(s, message->source, why, error);
        }
    } while (event != NODE_RESULT_END);
    return 0;
}
