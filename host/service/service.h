/* The host's part of a run: hands out the setup and the jobs, serves pages,
 * collects tetrahedra and commits, keeps spilled faces, gives credit, and
 * watches over the nodes.  One loop, one thread; it never waits to write while
 * there is something to read.
 *
 * On any loss (failure_detector.h) it begins a new generation of the cube's
 * wiring: every node drops its job and its role, uncommitted tetrahedra are
 * dropped here, and their bricks are given out again, in ranges.  Before the
 * run is over, the whole result is checked: audit.h.
 *
 * Memory: the cube's windows, 3 KiB a node, a byte a brick, the spilled faces
 * (see spill.h), and the tetrahedra themselves.  In a call that puts arrays
 * aside (host/base/scratch.h), only the windows and what a node takes stay. */
#ifndef HOST_SERVICE_H
#define HOST_SERVICE_H

#include "host/mesh/tetrahedra.h"
#include "host/mesh/order.h"
#include "audit.h"
#include "host/service/strategies/strategy.h"
#include "in_use.h"
#include "kept.h"
#include "ledger.h"
#include "machine.h"
#include "node/message.h"
#include "watchers.h"
#include "host/mesh/spill.h"

enum {
    HOST_PAGES_QUEUED_MAX = NODE_PAGES_IN_FLIGHT_MAX,
    HOST_UNSPILLS_MAX = 64,
    HOST_PATIENCE_US = 60000000 /* unless the caller says otherwise */
};

enum host_vouching { HOST_VOUCHES, HOST_DOUBTED, HOST_ASKED };

/* What the host knows of one node while it runs. */
struct host_node {
    uint32_t pages[HOST_PAGES_QUEUED_MAX]; /* asked for, to be sent */
    uint32_t pages_first, pages_count;
    uint32_t pages_in_a_row; /* turns that it has had for them */
    struct {
        struct node_spill_header header;
        struct host_spill_list list;
    } unspills[HOST_UNSPILLS_MAX]; /* asked for, to be sent */
    uint32_t unspills_first, unspills_count;
    uint32_t results; /* messages taken */
    uint32_t credit;  /* messages allowed, as the node knows */
    /* What is to be sent, in this order. */
    bool ping_due, setup_due, job_due, report_due;
    bool strategy_last; /* of what may wait, that was sent last */
    struct node_job_message job;
    bool working;  /* a job is out */
    bool reported; /* statistics of all that it has done are here */
    /* Whether it is there: failure_detector.h. */
    bool given_up;              /* for the rest of the run */
    bool aside;                 /* has no work for the rest of the run */
    bool left;                  /* for the rest of this generation */
    bool started_anew;          /* as it was not to be trusted with work */
    enum host_vouching vouches; /* that nothing was lost: faults.h, */
    uint32_t asked;             /* and the count in the ping that asks it */
    uint32_t work;              /* as its last pong counted it, */
    uint32_t awaited;           /* the page that it waited for, */
    uint32_t owing;             /* and who owed it answers */
    uint32_t refused;           /* links where it met another key */
    uint64_t still_us;          /* without progress: idle_nodes.h */
    bool pinged;                /* a ping has not been answered */
    bool ping_last;             /* what it was sent last is a ping */
    uint32_t sent, received;    /* counted messages of this generation */
    uint32_t missed;        /* pings that were lost before the first answer */
    uint32_t start;         /* the epoch of its start; 0: not heard of */
    uint64_t silent_us;     /* that it has not answered */
    bool cut_off;           /* no live wire leads to it */
    uint32_t silent;        /* links by which it hears nothing */
    uint64_t silence_us;    /* silent_us at the last check */
    uint64_t slow_us;       /* its longest silence of late: suspects.h */
    uint64_t starved_us;    /* it waited for a processor: bring_up.h */
    bool doubted;           /* the user was told so: suspects.h; */
    uint32_t wires_doubted; /* and of these links, */
    uint64_t wires_us;      /* after so long */
    uint64_t pinged_us, ping_again_us;
    uint32_t links;          /* that have been up, as either end has said */
    uint64_t links_heard_us; /* uncabled_us when this end said so last */
    /* Statistics of starts that are over, and tetrahedra of the present one
     * that no statistics know of yet. */
    struct node_finished_message before;
    uint64_t unreported;
    /* Faces that it has spilled and not got back, and how many there may be
     * before they are judged: results.h. */
    uint64_t spilled, spilled_max;
};

/* What remains of a node when the run is over. */
struct host_node_report {
    bool up, ready;
    struct node_ready_message map;
    struct node_finished_message statistics;
    uint64_t pages; /* that this node alone had from the host */
    uint64_t page_bytes;
};

/* What a node has reported, which counts once all have answered: faults.h. */
struct host_fault {
    bool told;
    unsigned node;
    char text[NODE_FAULT_TEXT_MAX + 1];
};

struct host_service {
    /* Given by the caller, who clears the rest. */
    struct host_machine *machine;
    const struct host_order *order;
    struct host_tetrahedra *tets; /* takes rows of vertex numbers */
    const struct host_strategy *strategy;
    struct host_sharing sharing;
    struct node_setup_message setup; /* page_key: drawn anew for each run */
    unsigned window;                 /* frames; 0: a large one */
    uint64_t patience_us; /* for a silent node; 0: HOST_PATIENCE_US */
    enum host_verifying verifying;
    struct host_kept *kept; /* in a journal; or NULL */
    bool foreign;           /* the nodes are of a cube file, or ranks */
    /* Of a node, and the cube file that says so (NULL: an option does), for
     * what paging.h tells; 0: it tells nothing. */
    uint64_t memory;
    const char *memory_of;
    /* Results. */
    struct host_node_report *report;     /* [nodes], until the end */
    uint64_t pages_us;                   /* time spent on serving pages */
    uint64_t page_bytes_to_all;          /* of pages that were sent to all */
    uint64_t retransmitted;              /* frames, on the host's wire */
    uint64_t bytes_sent, bytes_received; /* on it, all that there are */
    unsigned restarts;                   /* of nodes, by the machine */
    unsigned generations;                /* of the cube's wiring; 1: no loss */
    unsigned missing_wires;              /* that were named: missing_links.h */
    unsigned excluded;                   /* nodes whose work was wrong */
    /* Private. */
    struct cube *cube;
    void *cube_memory;
    struct host_node *node;
    struct host_work work; /* what the strategy sees; who is lost */
    struct host_ledger ledger;
    struct host_spill spill;
    bool started, finished, paging_told;
    uint64_t pages_sent;
    bool reporting, dealt; /* statistics are asked for; first jobs are out */
    bool over, late; /* all is here that is needed; a loss came after that */
    struct host_audit audit;
    uint32_t generation; /* of the wiring that is followed */
    bool loss;           /* a new one is due */
    unsigned blamed;     /* the node of the last loss, as far as is known */
    struct host_fault fault;
    unsigned fruitless; /* losses in a row without a commit between them */
    uint32_t committed_before;
    uint64_t undoubted_us;               /* since a node was doubted */
    bool wire_lost;                      /* the one in use is dead */
    uint64_t wire_frames, wire_quiet_us; /* that have come by it; since then */
    /* Nodes to come: bring_up.h. */
    unsigned there;              /* the most that were, */
    uint64_t waited_us, step_us; /* since the last of them came, and of that
                                    since the last look at the processors */
    uint64_t opened_us;          /* the first look */
    char waiting[400];           /* what the user was told, as far as needed */
    uint64_t waiting_us;
    /* Wires that never came up are looked for: missing_links.h. */
    bool searching;
    uint64_t search_us;   /* since when, */
    uint64_t news_us;     /* and when a node answered for the first time last */
    bool cabled;          /* every wire has been up, or was named */
    uint64_t uncabled_us; /* time without that, while all nodes answer */
    bool probe, probing; /* nodes are pinged one by one: in the next generation;
                            now, until all have answered */
    /* Living nodes that are up; that have their setup; a job. */
    unsigned up, ready, working;
    unsigned turn, ping_turn; /* the node to be served, and pinged, next */
    struct host_watching watching;
    uint64_t ping_us, check_us, began_us, wire_down_us;
    struct host_in_use in_use;
};

/* Brings up the cube on the machine's wire, and waits until every node has
 * answered: the start-up. */
int host_service_start(struct host_service *service, struct host_error *error);

/* The same in parts, for who has other things to do between two rounds of the
 * loop: before the first; one; and whether every node has answered. */
int host_service_open(struct host_service *service, struct host_error *error);
int host_service_round(struct host_service *service, struct host_error *error);

/* Hands out the setup and the jobs, and returns when every brick is committed
 * and every node has told its statistics. */
int host_service_run(struct host_service *service, struct host_error *error);

/* After the run, and no part of its time: waits for wires that have not been up
 * yet, and that nothing needed, until they are or are named.  At once where all
 * have been, as is the rule. */
int host_service_wires(struct host_service *service, struct host_error *error);

/* Tells the nodes to stop, ends those that do not, and frees all. */
void host_service_end(struct host_service *service);

#endif
