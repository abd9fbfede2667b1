/* `incode run`: points in, a cube of nodes, tetrahedra out.
 *
 * Memory: 52 bytes a point and 16 a tetrahedron at the end, 108 a point while
 * the points are ordered. */
#ifndef HOST_RUN_H
#define HOST_RUN_H

#include <sys/types.h>

#include "host/base/limits.h"
#include "host/verify/check.h"
#include "host/nodes/boards.h"
#include "host/nodes/cluster.h"
#include "host/mesh/points.h"
#include "host/mesh/tetrahedra.h"
#include "host/mesh/order.h"
#include "host/service/service.h"
#include "host/service/strategies/strategies.h"

enum { HOST_OUTPUTS_MAX = 16 };

struct host_run_result;

/* Of the tetrahedra in the outputs: that of their digest, or as they were made,
 * which has none. */
enum host_row_order { HOST_CANONICAL, HOST_AS_MADE };

struct host_run_options {
    const char *input;
    const char *format; /* of the input, for host_format_told; NULL: by name */
    const char *output[HOST_OUTPUTS_MAX];
    unsigned outputs;
    bool direct;      /* on threads of this process, without nodes */
    unsigned threads; /* then: so many; 0: one a processor */
    const struct host_strategy *strategy; /* NULL: auto */
    unsigned linda; /* the row of --linda; `strategy` is that one then */
    struct host_sharing sharing;
    enum host_partition partition;
    enum incode_index index;
    enum incode_face_rule face_rule;
    enum incode_build build;
    const struct host_link *link;
    const struct host_board *board;
    unsigned nodes; /* 0: what suits this machine */
    /* For `auto`: processors of nodes that are not of this machine, and bytes
     * a second of the host's wire; 0: there are none, or it is fast. */
    unsigned processors;
    uint64_t wire_bytes_s;
    struct host_limits limits; /* of the host's memory */
    uint64_t memory;
    uint64_t patience_s;      /* for a node that does not answer */
    const char *cube;         /* a file that describes real nodes, or NULL */
    const char *stats;        /* a file for the statistics, or NULL */
    const char *resume;       /* a folder for the run's state, or NULL */
    struct host_state *state; /* what is in it (state.h); NULL: none */
    enum host_verifying verifying;
    enum host_row_order row_order;
    bool quiet, table, map;
    bool explain;            /* print why `auto` chose the strategy */
    bool progress, anywhere; /* on a terminal; also without one */
    /* For tests. */
    unsigned window;
    uint64_t shuffle_seed;
    uint64_t unplug_us;
    struct host_throttle throttle;
    struct host_trouble trouble; /* of emulated boards */
    const char *node_program;
    /* Begins a cube of result->nodes where it is not the board that does. */
    int (*begin)(const struct host_run_options *options,
                 struct host_run_result *result, struct host_machine *machine,
                 struct host_error *error);
};

struct host_run_result {
    uint64_t rows, points, duplicates, negative_zeros;
    uint64_t tetrahedra, hull_facets;
    struct host_digest digest;
    const struct host_strategy *strategy; /* the one taken, */
    char why[HOST_WHY_BYTES];             /* by `auto`: why; else empty */
    enum host_partition partition;
    enum incode_index index;
    enum incode_build build; /* what the nodes are told */
    const struct host_link *link;
    const struct host_board *board;
    unsigned nodes;
    uint64_t memory;
    double time_total_s, time_read_s, time_order_s, time_io_s;
    double time_start_up_s, time_triangulation_s, time_verify_s, time_write_s;
    double t_min_s, t_max_s; /* of the nodes that worked */
    /* Of the host's process: files apart, and of it what time_triangulation_s
     * is the clock's of. */
    double host_cpu_s, host_triangulation_cpu_s;
    uint64_t host_peak_bytes;
    uint64_t host_memory;            /* what the host may use */
    uint64_t scratch_bytes;          /* put aside, at most at a time */
    uint32_t bricks, resumed_bricks; /* of the order; done by an earlier run */
    uint64_t pages;                  /* that there are to be asked for */
    uint64_t make_tetra_calls, built, exact_orient3d, exact_in_sphere;
    uint64_t retransmitted, faces_spilled;
    uint64_t bytes_sent, bytes_received; /* on the host's wire */
    unsigned lost;                  /* nodes that the run had to do without */
    unsigned restarts, generations; /* of nodes; of the cube's wiring */
    unsigned missing_wires;         /* that were named */
    unsigned excluded;              /* nodes whose work was wrong */
    unsigned checks_failed;         /* of the result, in part done again */
    uint64_t candidates, candidates_histogram[24];
    uint64_t vertices, vertices_waited;
    uint64_t stars_lent, stars_borrowed,
        tetrahedra_late;                         /* incode/triangulator.h */
    int socket_send_bytes, socket_receive_bytes; /* buffers of a wire's end */
    struct host_node_report node[HOST_NODES_MAX];
    bool limited;            /* the kernel held the nodes to their memory */
    const char *memory_held; /* see boards.h; NULL: nothing to say */
    bool verified;           /* the exact check was made */
    struct host_check_report check;
};

void host_run_defaults(struct host_run_options *options);

/* How many nodes the cube gets. */
unsigned host_run_nodes(const struct host_run_options *options);

/* Removes what process `writer`, which was ended in its run, has left of the
 * outputs. */
void host_run_clean(const struct host_run_options *options, pid_t writer);

/* Triangulates points: tets become rows of points, in no order. */
int host_triangulate(const struct host_run_options *options,
                     const struct host_points *points,
                     struct host_tetrahedra *tets,
                     struct host_run_result *result, struct host_error *error);

/* The same on nodes that are there already, result->nodes of them, with
 * result's strategy and memory as they are.  Ends the machine, whatever
 * happens. */
int host_triangulate_on(const struct host_run_options *options,
                        struct host_machine *machine,
                        const struct host_points *points,
                        struct host_tetrahedra *tets,
                        struct host_run_result *result,
                        struct host_error *error);

/* The nodes' reports, and sums over them, into a result that is clear but for
 * its number of nodes.  t_min_s and t_max_s are of nodes that have told of a
 * time at work: neither of holders, nor of nodes lost before they told. */
void host_run_sum(const struct host_service *service,
                  struct host_run_result *result);

/* The whole command: reads, triangulates, verifies, writes. */
int host_run(const struct host_run_options *options,
             struct host_run_result *result, struct host_error *error);

#endif
