#include "bench_links.h"

#include <mpi.h> /* its version alone */
#include <errno.h>
#include <netinet/in.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "transport/drivers/sim.h"
#include "bench.h"
#include "host/nodes/cluster.h"
#include "transport/drivers/secure_sodium.h"
#include "transport/drivers/serial.h"
#include "transport/drivers/tcp_wire.h"
#include "host/service/strategies/strategies.h"
#include "host/sim/sim_world.h"

enum { PATIENCE_US = 20000000, SIM_STEP_US = 20, SIM_COUNT = 400 };

struct sim_bench {
    uint64_t now_us;
    struct sim_wire wire;
    struct link *link[2];
    uint32_t got[2], due[2];
    bool echo;
};

/* One step of time: end 1 echoes, where that is asked. */
static void sim_turn(struct sim_bench *s, size_t size) {
    static const uint8_t bytes[HOST_BENCH_MESSAGE];
    struct link_message message;
    s->now_us += SIM_STEP_US;
    for (unsigned who = 0; who < 2; who++) {
        (void)link_poll_receive(s->link[who], s->now_us);
        while (link_read(s->link[who], &message)) {
            link_release(s->link[who]);
            s->got[who]++;
            s->due[who] += s->echo && who == 1 ? 1 : 0;
        }
        while (s->due[who] > 0 &&
               link_write(s->link[who], bytes, size, NULL, 0) == 0)
            s->due[who]--;
        (void)link_poll_send(s->link[who], s->now_us);
    }
}

/* Virtual microseconds until end 0 has had `count` messages. */
static double sim_count(struct sim_bench *s, uint32_t count, bool echo,
                        size_t size) {
    uint64_t begin = s->now_us;
    s->echo = echo;
    s->got[0] = 0;
    s->due[0] = count;
    s->due[1] = echo ? 0 : count;
    while (s->got[0] < count && s->now_us - begin < PATIENCE_US)
        sim_turn(s, size);
    return (double)(s->now_us - begin);
}

/* 0, or HOST_BROKEN without memory. */
static int host_bench_sim(struct host_bench_row *row,
                          struct host_error *error) {
    static struct sim_bench s;
    static const struct sim_quality quality = {.bytes_per_s =
                                                   HOST_BENCH_SIM_BYTES,
                                               .latency_us = 100,
                                               .room = 512,
                                               .bytes = SIM_BYTES_MIN};
    void *memory[3] = {malloc(sim_wire_bytes(&quality)), NULL, NULL};
    memset(&s, 0, sizeof s);
    if (memory[0] != NULL)
        sim_wire_init(&s.wire, memory[0], &quality, &s.now_us, 1);
    for (unsigned who = 0; who < 2 && memory[0] != NULL; who++) {
        struct link_config c = host_bench_serial(0);
        c.epoch = who + 1;
        c.node = (uint16_t)who;
        c.peer_node = (uint16_t)(1 - who);
        c.pipe = sim_pipe(&s.wire.end[who]);
        memory[1 + who] = malloc(link_bytes(&c));
        s.link[who] = memory[1 + who] == NULL
                          ? NULL
                          : link_init(memory[1 + who], link_bytes(&c), &c);
    }
    if (s.link[0] != NULL && s.link[1] != NULL) {
        (void)sim_count(&s, 1, true, HOST_BENCH_SMALL);
        row->round_trip_us = sim_count(&s, 1, true, HOST_BENCH_SMALL);
        row->hop_us = sim_count(&s, 1, true, HOST_BENCH_MESSAGE) / 2;
        uint64_t used = host_bench_used_us();
        double us = sim_count(&s, SIM_COUNT, false, HOST_BENCH_MESSAGE);
        row->cpu_us = (double)(host_bench_used_us() - used) / (2.0 * SIM_COUNT);
        row->bytes_per_s = 1e6 * SIM_COUNT * HOST_BENCH_MESSAGE / us;
    }
    bool made = s.link[1] != NULL;
    for (unsigned i = 0; i < 3; i++)
        free(memory[i]);
    return made ? 0 : host_fail_memory(error, "the simulated links");
}

/* --- bench links ---------------------------------------------------------- */

enum { FIFO_BYTES = 64 }; /* of a serial port: so many are brought at once */

/* What a pseudo-terminal brings at once a line would bring byte by byte: it is
 * held here until then. */
struct slow_end {
    struct link_pipe beneath;
    uint64_t byte_ns; /* on the line; 0: no line */
    uint64_t last_ns; /* when the last byte held is here */
    uint64_t look_ns; /* of the last look, */
    bool flows;       /* which found some */
    size_t held;
    uint8_t bytes[4096];
};

struct wire {
    struct tcp_pipe tcp;
    struct serial_pipe line;
    struct slow_end slow;
    struct tcp_wire net;
};

static uint64_t now_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000 + (uint64_t)now.tv_nsec;
}

static int slow_send(void *context, const uint8_t *bytes, size_t size) {
    const struct slow_end *s = context;
    return s->beneath.send(s->beneath.context, bytes, size);
}

static int slow_receive(void *context, uint8_t *bytes, size_t size) {
    struct slow_end *s = context;
    int got = s->beneath.receive(s->beneath.context, s->bytes + s->held,
                                 sizeof s->bytes - s->held);
    uint64_t now = now_ns();
    if (got < 0)
        return got;
    /* In a stream bytes came on while nobody looked. */
    uint64_t since = s->flows ? s->look_ns : now;
    s->look_ns = now;
    s->flows = got > 0 || s->held > 0;
    if (got > 0) {
        since = s->last_ns > since ? s->last_ns : since;
        s->last_ns = since + (unsigned)got * s->byte_ns;
        s->held += (size_t)got;
    }
    size_t due = 0;
    if (s->last_ns > now)
        due = (size_t)((s->last_ns - now + s->byte_ns - 1) / s->byte_ns);
    size_t here = s->held > due ? s->held - due : 0;
    here = here < size ? here : size;
    memcpy(bytes, s->bytes, here);
    s->held -= here;
    memmove(s->bytes, s->bytes + here, s->held);
    return (int)here;
}

static void sleep_on(struct pollfd *fds, nfds_t count, uint64_t wait_us) {
    struct timespec wait = {(time_t)(wait_us / 1000000),
                            (long)(wait_us % 1000000) * 1000};
    (void)ppoll(fds, count, &wait, NULL);
}

static void idle_tcp(void *context, uint64_t wait_us) {
    struct wire *w = context;
    struct pollfd fd = {w->tcp.fd, tcp_events(&w->tcp), 0};
    sleep_on(&fd, 1, wait_us);
}

static void idle_line(void *context, uint64_t wait_us) {
    struct wire *w = context;
    struct pollfd fd = {w->line.fd, serial_events(&w->line), 0};
    uint64_t line_us = serial_wait_us(&w->line);
    wait_us = line_us < wait_us ? line_us : wait_us;
    if (w->slow.held > 0) {
        size_t bytes = w->slow.held < FIFO_BYTES ? w->slow.held : FIFO_BYTES;
        uint64_t here_us = bytes * w->slow.byte_ns / 1000 + 1;
        wait_us = here_us < wait_us ? here_us : wait_us;
    }
    sleep_on(&fd, 1, wait_us);
}

static void idle_net(void *context, uint64_t wait_us) {
    struct wire *w = context;
    struct pollfd fds[TCP_WIRE_FDS_MAX];
    sleep_on(fds, tcp_wire_events(&w->net, fds), wait_us);
}

struct driver {
    const char *name;
    uint32_t baud; /* of a line; 0: none */
    /* Made before the fork, and opened after it by either end. */
    int (*make)(int fds[2]);
    int (*open)(struct wire *wire, struct host_bench_end *end, int fd,
                unsigned role, uint32_t baud);
};

static int open_tcp(struct wire *wire, struct host_bench_end *end, int fd,
                    unsigned role, uint32_t baud) {
    (void)role, (void)baud;
    tcp_pipe_init(&wire->tcp, fd);
    end->pipe = tcp_link_pipe(&wire->tcp);
    end->idle = idle_tcp;
    end->settings.window = 8;
    return 0;
}

static int open_line(struct wire *wire, struct host_bench_end *end, int fd,
                     unsigned role, uint32_t baud) {
    (void)role;
    serial_pipe_init(&wire->line, fd, baud);
    wire->slow.beneath = serial_link_pipe(&wire->line);
    wire->slow.byte_ns = baud == 0 ? 0 : UINT64_C(10000000000) / baud;
    end->pipe = baud == 0
                    ? wire->slow.beneath
                    : (struct link_pipe){&wire->slow, slow_send, slow_receive};
    end->idle = idle_line;
    end->settings = host_bench_serial(baud);
    return 0;
}

/* Where the two ends of a keyed wire meet: a port that is free before they
 * part. */
static struct tcp_address meeting;

static int choose_meeting(int fds[2]) {
    struct sockaddr_in free_port = {.sin_family = AF_INET,
                                    .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t size = sizeof free_port;
    int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    int status =
        fd < 0 ? -1
               : bind(fd, (struct sockaddr *)&free_port, size) |
                     getsockname(fd, (struct sockaddr *)&free_port, &size);
    if (fd >= 0)
        close(fd);
    memcpy(&meeting.to, &free_port, sizeof free_port);
    meeting.size = size;
    fds[0] = fds[1] = -1;
    return status;
}

static int open_net(struct wire *wire, struct host_bench_end *end, int fd,
                    unsigned role, uint32_t baud) {
    static const uint8_t key[SECURE_KEY_BYTES] = "for measuring only";
    struct tcp_wire_config config = {
        .listens = role == 1, .suite = &secure_sodium, .key = key};
    (void)fd, (void)baud;
    config.address = meeting;
    if (tcp_wire_open(&wire->net, &config) != 0)
        return -1;
    end->pipe = tcp_wire_pipe(&wire->net);
    end->idle = idle_net;
    end->settings.window = 8;
    return 0;
}

static int run_end(const struct driver *driver, int fd, unsigned role,
                   struct host_bench_row *row) {
    static struct wire wire;
    struct host_bench_end end;
    memset(&wire, 0, sizeof wire);
    memset(&end, 0, sizeof end);
    end.context = &wire;
    wire.net.listener = wire.net.tcp.fd = -1;
    if (driver->open(&wire, &end, fd, role, driver->baud) != 0)
        return -1;
    int status = host_bench_end(&end, role, row);
    if (driver->open == open_net)
        tcp_wire_close(&wire.net);
    return status;
}

/* Two processes, and the driver between them. */
static int run_driver(const struct driver *driver, struct host_bench_row *row,
                      struct host_error *error) {
    int fds[2];
    if (driver->make(fds) != 0) {
        return host_fail(error, HOST_CUBE,
                         "%s: %s; does this machine allow it?", driver->name,
                         strerror(errno));
    }
    pid_t child = fork();
    if (child == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        _exit(run_end(driver, fds[1], 1, row) == 0 ? 0 : 1);
    }
    int status = child < 0 ? -1 : run_end(driver, fds[0], 0, row);
    if (child > 0) {
        kill(child, SIGKILL);
        (void)waitpid(child, NULL, 0);
    }
    for (unsigned i = 0; i < 2; i++)
        if (fds[i] >= 0)
            close(fds[i]);
    return status == 0
               ? 0
               : host_fail(error, HOST_CUBE,
                           "%s: the other end does not answer; run again on "
                           "a machine that is less busy",
                           driver->name);
}

/* --- mpi: a program of its own -------------------------------------------- */

/* False: there is no mpirun, or it does not start two ranks. */
static bool run_mpi(struct host_bench_row *row) {
    char path[4096], command[4400];
    struct host_error ignored = {0};
    if (host_cluster_program(NULL, "incode-mpi", path, sizeof path, &ignored) !=
        0)
        return false;
    snprintf(command, sizeof command,
             "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 "
             "timeout 30 mpirun --oversubscribe --bind-to none "
             "--mca pml ob1 --mca btl self,%s -np 2 '%s' "
             "bench-link 2> /dev/null",
             OMPI_MAJOR_VERSION < 5 ? "vader" : "sm", path);
    FILE *said = popen(command, "re");
    bool good =
        said != NULL && fscanf(said, "%lf %lf %lf %lf %lf", &row->bytes_per_s,
                               &row->round_trip_us, &row->hop_us, &row->cpu_us,
                               &row->retransmitted) == 5;
    if (said != NULL)
        (void)pclose(said);
    return good;
}

static void print_row(const char *name, double line_bytes_per_s,
                      const struct host_bench_row *row) {
    printf("%-30s %10.3f ", name, 1e-6 * row->bytes_per_s);
    if (line_bytes_per_s > 0)
        printf("%6.1f %%", 100 * row->bytes_per_s / line_bytes_per_s);
    else
        printf("%8s", "-");
    printf(" %10.0f %10.0f %8.1f %8.2f %%\n", row->round_trip_us, row->hop_us,
           row->cpu_us, 100 * row->retransmitted);
    fflush(stdout);
}

int host_bench_links(struct host_error *error) {
    static const struct driver drivers[] = {
        {"tcp, loopback", 0, tcp_pair, open_tcp},
        {"tcp, with a key", 0, choose_meeting, open_net},
        {"serial, pseudo-terminal", 0, serial_pair, open_line},
        {"serial, paced to 115200 baud", 115200, serial_pair, open_line},
        {"serial, paced to 921600 baud", 921600, serial_pair, open_line},
        {"serial, paced to 3000000 baud", 3000000, serial_pair, open_line},
    };
    printf("%-30s %10s %8s %10s %10s %8s %10s\n", "", "MB/s", "of the",
           "round trip", "a hop, us", "cpu, us", "sent");
    printf("%-30s %10s %8s %10s %10s %8s %10s\n", "driver", "each way", "line",
           "16 B, us", "1600 B", "1600 B", "again");
    for (size_t i = 0; i < sizeof drivers / sizeof drivers[0]; i++) {
        struct host_bench_row row = {0};
        if (run_driver(&drivers[i], &row, error) != 0)
            return error->code;
        print_row(drivers[i].name, 0.1 * drivers[i].baud, &row);
    }
    struct host_bench_row sim = {0}, mpi = {0};
    if (host_bench_sim(&sim, error) != 0)
        return error->code;
    print_row("sim, 3000000 baud, 100 us away", HOST_BENCH_SIM_BYTES, &sim);
    if (run_mpi(&mpi)) {
        print_row("mpi, two ranks", 0, &mpi);
    } else {
        printf("%-30s not measured: mpirun does not start two ranks here\n",
               "mpi, two ranks");
    }
    return 0;
}

/* --- virtual run ---------------------------------------------------------- */

enum { HOST_US = 2 }; /* the host's own work is not modelled */

struct virtual_world {
    struct host_virtual_run *run;
    struct host_world world;
    struct host_service service;
    struct host_order order;
    struct host_tetrahedra tets;
    uint64_t page_bytes_to_all;
};

static uint64_t used_ns(void *context, unsigned i, const struct node *node) {
    const struct virtual_world *v = context;
    const struct cube_statistics *m = node_messages(node);
    struct node_finished_message totals;
    node_account(node, &totals);
    double times = v->run->slow > 0 && i == 0 ? v->run->slow : 1;
    return (uint64_t)(times * host_bench_node_ns(v->run->machine, &totals,
                                                 m->written + m->read));
}

static int open_world(struct virtual_world *v, struct host_error *error) {
    const struct host_run_options *run = v->run->options;
    const struct host_bench_machine *m = v->run->machine;
    struct host_world_options o = {
        .cube = {.dimension = (unsigned)__builtin_ctz(run->nodes),
                 .seed = 1,
                 .wire = m->wire,
                 .host_wire = m->host_wire,
                 .gather_us = m->gather_us,
                 .shared = m->shared},
        .memory = run->memory,
        .host_us = HOST_US,
        .step_us = 1,
        .used_ns = used_ns,
        .used_context = v,
        .routers = m->routers,
        .time_us_max = UINT64_MAX / 4,
        .steps_max = UINT64_MAX};
    return host_world_open(&v->world, &o, error);
}

static int serve(struct virtual_world *v, struct host_machine *machine,
                 struct host_error *error) {
    const struct host_run_options *run = v->run->options;
    struct host_service *s = &v->service;
    s->machine = machine;
    s->order = &v->order;
    s->tets = &v->tets;
    s->strategy = run->strategy;
    s->sharing = run->sharing;
    s->setup.setup.index = (uint8_t)run->index;
    s->setup.setup.face_rule = (uint8_t)run->face_rule;
    s->setup.setup.build = (uint8_t)run->build;
    int status = host_service_start(s, error);
    if (status == 0) {
        uint64_t start_us = v->world.now_us;
        status = host_service_run(s, error);
        v->run->result.time_triangulation_s =
            1e-6 * (double)(v->world.now_us - start_us);
        host_run_sum(s, &v->run->result);
        v->page_bytes_to_all = s->page_bytes_to_all;
    }
    host_service_end(s);
    return status;
}

static void sum(struct virtual_world *v) {
    struct host_virtual_run *run = v->run;
    struct host_run_result *r = &run->result;
    uint64_t bytes = v->page_bytes_to_all;
    run->work_ns = 0;
    for (unsigned i = 0; i < r->nodes; i++) {
        double counts[HOST_BENCH_COUNTS];
        host_bench_counts(&r->node[i].statistics, counts);
        run->work_ns += host_bench_work_ns(run->machine->price, counts);
        bytes += r->node[i].page_bytes;
    }
    r->tetrahedra = v->tets.count;
    r->points = v->order.points;
    r->time_io_s =
        host_bench_io_s(run->machine, bytes, (unsigned)__builtin_ctz(r->nodes));
}

int host_virtual_run(struct host_virtual_run *run,
                     const struct host_points *points,
                     struct host_error *error) {
    struct virtual_world *v = calloc(1, sizeof *v);
    if (v == NULL)
        return host_fail_memory(error, "the simulated cube");
    const struct host_run_options *o = run->options;
    v->run = run;
    memset(&run->result, 0, sizeof run->result);
    run->result.nodes = o->nodes;
    run->result.strategy = o->strategy;
    int status = host_order_make(
        &v->order, "points", points->xyz, points->count,
        host_strategy_partition(o->strategy, o->partition),
        o->strategy->regions(o->nodes), o->index == INCODE_GRID, error);
    if (status == 0 && open_world(v, error) == 0) {
        struct host_machine machine = host_world_machine(&v->world);
        status = serve(v, &machine, error);
        sum(v);
        host_world_close(&v->world);
    }
    host_order_free(&v->order);
    host_tetrahedra_free(&v->tets);
    free(v);
    return status != 0 ? status : error->code;
}
