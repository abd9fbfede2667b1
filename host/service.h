/* The host's part of a run: hands out the setup and the jobs, serves pages,
 * collects tetrahedra and commits, keeps spilled faces, gives credit, and
 * watches over the nodes.  One loop, one thread; it never waits to write while
 * there is something to read.
 *
 * Memory: the cube's windows, 3 KiB a node, a bit a brick, the spilled faces
 * (see spill.h), and the tetrahedra themselves.  Work: a few ns a byte.
 *
 *     host_service_run(&service, &error);
 *     service.report[i].finished.statistics ...; tets: vertex numbers
 *     host_service_end(&service);
 */
#ifndef HOST_SERVICE_H
#define HOST_SERVICE_H

#include "../node/message.h"
#include "ledger.h"
#include "machine.h"
#include "order.h"
#include "progress.h"
#include "spill.h"
#include "tetrahedra.h"

enum { HOST_PAGES_QUEUED_MAX = 256, HOST_UNSPILLS_MAX = 64 };

/* What the host knows of one node while it runs. */
struct host_node {
    uint32_t pages[HOST_PAGES_QUEUED_MAX]; /* asked for, to be sent */
    uint32_t pages_first, pages_count;
    struct {
        struct node_spill_header header;
        struct host_spill_list list;
    } unspills[HOST_UNSPILLS_MAX]; /* asked for, to be sent */
    uint32_t unspills_first, unspills_count;
    uint32_t results; /* messages taken */
    uint32_t credit;  /* messages allowed, as the node knows */
    bool job_due, report_due, done;
    struct node_job_message job;
};

/* What remains of a node when the run is over. */
struct host_node_report {
    bool here, ready, finished;
    struct node_ready_message map;
    struct node_finished_message statistics;
    uint64_t pages; /* that this node had from the host */
    uint64_t page_bytes;
};

struct host_service {
    /* Given by the caller, who clears the rest. */
    struct host_machine *machine;
    const struct host_order *order;
    struct host_tetrahedra *tets; /* takes rows of vertex numbers */
    struct node_setup_message setup;
    unsigned window; /* frames; 0: a large one */
    bool show_progress;
    /* One job a node: regions of the order; nodes beyond `workers` hold. */
    unsigned workers;
    /* Results. */
    struct host_node_report *report; /* [nodes], until the end */
    uint64_t pages_us;               /* time spent on serving pages */
    uint64_t retransmitted;          /* frames, on the host's wire */
    /* Private. */
    struct cube *cube;
    void *cube_memory;
    struct host_node *node;
    struct host_ledger ledger;
    struct host_spill spill;
    struct host_progress progress;
    bool setup_due, started, finished;
    unsigned here, ready, done; /* nodes that are up; that have their setup;
                                   that finished */
    unsigned turn;              /* the node to be served next */
    uint64_t check_us, wire_seen_us;
};

/* Brings up the cube on the machine's wire, and waits until every node has
 * answered: the start-up. */
int host_service_start(struct host_service *service, struct host_error *error);

/* Hands out the setup and the jobs, and returns when every brick is committed
 * and every node has finished. */
int host_service_run(struct host_service *service, struct host_error *error);

/* Tells the nodes to stop, ends those that do not, and frees all. */
void host_service_end(struct host_service *service);

#endif
