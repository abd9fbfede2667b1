/* The common part of all face managers, with any carrier of lists (lists.h):
 * jobs from the host, a front that lends its faces (incode/paper/manager.h),
 * results and spilled faces to the host.  The functions of such a role call
 * these. */
#ifndef NODE_FACE_MANAGER_H
#define NODE_FACE_MANAGER_H

#include "lists.h"
#include "incode/paper/manager.h"
#include "triangulation.h"
#include "node/common.h"
#include "outlet.h"

struct node_face_manager {
    struct node_fault *fault;
    struct node_carrier carrier;
    struct node_jobs jobs;
    bool drained; /* the front is done, results still leave */
    struct node_outlet outlet;
    uint32_t faces_per_job;
    uint16_t nodes; /* of the cube */
    size_t outlet_bytes;
    uint64_t bytes_in;
    struct incode_manager manager;
};

/* Bytes that suffice beside the struct, in a node of so much memory. */
size_t node_face_manager_min(size_t memory);

/* memory: aligned to NODE_ALIGNMENT.  counted and fault must outlive it.
 * False: *fault is set. */
bool node_face_manager_start(struct node_face_manager *f, void *memory,
                             size_t bytes,
                             const struct node_setup_message *setup,
                             const struct node_carrier *carrier,
                             struct node_counted *counted,
                             struct node_fault *fault);

/* Messages of the host: a job, credit, spilled faces.  False: it is another
 * one. */
bool node_face_manager_message(struct node_face_manager *f,
                               const struct cube_message *message,
                               uint64_t now_us);

/* Steps that did something. */
unsigned node_face_manager_work(struct node_face_manager *f,
                                struct node_pace *pace);

/* As in a role: messages that have not left, the epoch of a job that is done,
 * and what follows its end. */
uint32_t node_face_manager_held(const struct node_face_manager *f);
uint32_t node_face_manager_done(const struct node_face_manager *f);
void node_face_manager_end(struct node_face_manager *f, uint64_t now_us);

/* The first three tables: results on their way out, the active face list, open
 * bricks. */
void node_face_manager_map(const struct node_face_manager *f,
                           struct node_map *map);

/* All but the bytes of the carrier and the role's own memory. */
void node_face_manager_gauge(const struct node_face_manager *f,
                             struct incode_gauge *gauge);
void node_face_manager_totals(const struct node_face_manager *f,
                              struct node_finished_message *totals,
                              uint64_t now_us);

#endif
