#include "bench_links.h"

#include <errno.h>
#include <netinet/in.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "bench_end.h"
#include "bench_sim.h"
#include "host/nodes/cluster.h"
#include "transport/drivers/secure_sodium.h"
#include "transport/drivers/serial.h"
#include "transport/drivers/tcp_wire.h"

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
    if (got < 0) {
        return got;
    }
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
    if (s->last_ns > now) {
        due = (size_t)((s->last_ns - now + s->byte_ns - 1) / s->byte_ns);
    }
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
    if (fd >= 0) {
        close(fd);
    }
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
    if (tcp_wire_open(&wire->net, &config) != 0) {
        return -1;
    }
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
    if (driver->open(&wire, &end, fd, role, driver->baud) != 0) {
        return -1;
    }
    int status = host_bench_end(&end, role, row);
    if (driver->open == open_net) {
        tcp_wire_close(&wire.net);
    }
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
    for (unsigned i = 0; i < 2; i++) {
        if (fds[i] >= 0) {
            close(fds[i]);
        }
    }
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
        0) {
        return false;
    }
    snprintf(command, sizeof command,
             "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 "
             "timeout 30 mpirun --oversubscribe --bind-to none "
             "--mca pml ob1 --mca btl self,vader -np 2 '%s' "
             "bench-link 2> /dev/null",
             path);
    FILE *said = popen(command, "re");
    bool good =
        said != NULL && fscanf(said, "%lf %lf %lf %lf %lf", &row->bytes_per_s,
                               &row->round_trip_us, &row->hop_us, &row->cpu_us,
                               &row->retransmitted) == 5;
    if (said != NULL) {
        (void)pclose(said);
    }
    return good;
}

static void print_row(const char *name, double line_bytes_per_s,
                      const struct host_bench_row *row) {
    printf("%-30s %10.3f ", name, 1e-6 * row->bytes_per_s);
    if (line_bytes_per_s > 0) {
        printf("%6.1f %%", 100 * row->bytes_per_s / line_bytes_per_s);
    } else {
        printf("%8s", "-");
    }
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
        if (run_driver(&drivers[i], &row, error) != 0) {
            return error->code;
        }
        print_row(drivers[i].name, 0.1 * drivers[i].baud, &row);
    }
    struct host_bench_row sim = {0}, mpi = {0};
    if (host_bench_sim(&sim, error) != 0) {
        return error->code;
    }
    print_row("sim, 3000000 baud, 100 us away", HOST_BENCH_SIM_BYTES, &sim);
    if (run_mpi(&mpi)) {
        print_row("mpi, two ranks", 0, &mpi);
    } else {
        printf("%-30s not measured: mpirun does not start two ranks here\n",
               "mpi, two ranks");
    }
    return 0;
}
