#include "bench_links.h"

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

#include "transport/drivers/serial.h"
#include "transport/drivers/sim.h"
#include "transport/drivers/secure_sodium.h"
#include "transport/drivers/tcp_wire.h"
#include "host/machines/cluster.h"
#include "host/base/progress.h"

enum {
    MESSAGE = 1600,
    SMALL = 16,
    PINGS = 200,
    FIRST = 16, /* messages of the first trial, by which the second is sized */
    MOST = 200000,
    TRIAL_US = 700000,
    PATIENCE_US = 20000000,
    LINGER_US = 30000,
    FIFO_BYTES = 64,    /* of a port: so many are brought at once */
    FAST_BAUD = 3000000 /* as which a pseudo-terminal counts */
};

/* What a message asks, in its first byte. */
enum { ECHO, STREAM, DATA, USED, LEAVE };

/* --- an end --------------------------------------------------------------- */

struct bench {
    struct host_bench_end *end;
    struct link *link;
    uint64_t heard_us;
    uint32_t due; /* of a stream: to be written, */
    uint32_t got; /* and read */
    bool left;
    uint8_t answer[SMALL];
};

static uint64_t used_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
}

static bool say(struct bench *b, uint8_t what, uint64_t value, size_t size)
{
    uint8_t bytes[MESSAGE] = {what};
    memcpy(bytes + 8, &value, sizeof value);
    return link_write(b->link, bytes, size, NULL, 0) == 0;
}

/* False: no room for the answer yet. */
static bool take(struct bench *b, const struct link_message *m, unsigned role)
{
    uint64_t value;
    uint8_t what = m->data[0];
    memcpy(&value, m->data + 8, sizeof value);
    if (role == 1 && what == ECHO) {
        return say(b, ECHO, value, m->size);
    }
    if (role == 1 && what == USED) {
        return say(b, USED, used_us(), SMALL);
    }
    if (what == STREAM) {
        b->due = (uint32_t)value;
    } else if (what == DATA) {
        b->got++;
    } else if (what == LEAVE) {
        b->left = true;
    }
    memcpy(b->answer, m->data, SMALL);
    return true;
}

/* One look at the link: how many messages came. */
static unsigned turn(struct bench *b, unsigned role)
{
    struct link_message message;
    unsigned got = 0;
    uint64_t now = host_now_us();
    int moved = link_poll_receive(b->link, now);
    while (link_read(b->link, &message) && take(b, &message, role)) {
        link_release(b->link);
        b->heard_us = now;
        got++;
    }
    while (b->due > 0 && say(b, DATA, 0, MESSAGE)) {
        b->due--;
    }
    moved += link_poll_send(b->link, host_now_us());
    if (got == 0 && moved == 0) {
        b->end->idle(b->end->context, link_next_due_us(b->link, now));
    }
    return got;
}

static bool patient(const struct bench *b)
{
    return host_now_us() - b->heard_us < PATIENCE_US;
}

/* Microseconds from question to answer; < 0: there is none. */
static double ask(struct bench *b, uint8_t what, size_t size)
{
    uint64_t begin = host_now_us();
    while (!say(b, what, 0, size)) {
        (void)turn(b, 0);
    }
    while (turn(b, 0) == 0) {
        if (!patient(b)) {
            return -1;
        }
    }
    return (double)(host_now_us() - begin);
}

static double mean_round_trip(struct bench *b, size_t size)
{
    double sum = 0;
    uint64_t begin = host_now_us();
    for (unsigned i = 1; i <= PINGS; i++) {
        double us = ask(b, ECHO, size);
        sum += us;
        if (us < 0 || host_now_us() - begin > TRIAL_US) {
            return us < 0 ? us : sum / i;
        }
    }
    return sum / PINGS;
}

/* `count` messages each way at once: microseconds. */
static double stream(struct bench *b, uint32_t count)
{
    uint64_t begin = host_now_us();
    while (!say(b, STREAM, count, SMALL)) {
        (void)turn(b, 0);
    }
    b->due = count;
    b->got = 0;
    while (b->got < count || b->due > 0 || !link_idle(b->link)) {
        (void)turn(b, 0);
        if (!patient(b)) {
            return -1;
        }
    }
    return (double)(host_now_us() - begin);
}

static uint64_t used_by_both(struct bench *b)
{
    uint64_t other;
    (void)ask(b, USED, SMALL);
    memcpy(&other, b->answer + 8, sizeof other);
    return other + used_us();
}

static int measure(struct bench *b, struct host_bench_row *row)
{
    row->round_trip_us = ask(b, ECHO, SMALL) < 0 ? -1 : 0; /* shakes hands */
    if (row->round_trip_us < 0) {
        return -1;
    }
    row->round_trip_us = mean_round_trip(b, SMALL);
    row->hop_us = mean_round_trip(b, MESSAGE) / 2;
    double trial = stream(b, FIRST);
    double fits = FIRST * (double)TRIAL_US / trial;
    uint32_t count = fits < FIRST ? FIRST : fits > MOST ? MOST : (uint32_t)fits;
    uint64_t used = used_by_both(b);
    double us = stream(b, count);
    used = used_by_both(b) - used;
    const struct link_statistics *s = link_statistics(b->link);
    row->bytes_per_s = 1e6 * count * MESSAGE / us;
    row->cpu_us = (double)used / (2.0 * count);
    row->retransmitted = (double)s->retransmitted / (double)s->frames_sent;
    return trial < 0 || us < 0 ? -1 : 0;
}

/* Until the farewell has arrived, as far as that can be told. */
static void linger(struct bench *b)
{
    uint64_t begin = host_now_us();
    while (host_now_us() - begin < LINGER_US) {
        (void)link_poll(b->link, host_now_us());
        b->end->idle(b->end->context, LINGER_US / 10);
    }
}

int host_bench_end(struct host_bench_end *end, unsigned role,
                   struct host_bench_row *row)
{
    struct bench b = {.end = end, .heard_us = host_now_us()};
    struct link_config config = end->settings;
    int status = -1;
    config.pipe = end->pipe;
    config.epoch = (uint32_t)b.heard_us | 1;
    config.node = (uint16_t)role;
    config.peer_node = (uint16_t)(1 - role);
    size_t bytes = link_bytes(&config);
    void *memory = malloc(bytes);
    b.link = memory == NULL ? NULL : link_init(memory, bytes, &config);
    if (b.link != NULL && role == 0) {
        status = measure(&b, row);
        (void)say(&b, LEAVE, 0, SMALL);
        linger(&b);
    } else if (b.link != NULL) {
        while (!b.left && patient(&b)) {
            (void)turn(&b, role);
        }
        linger(&b);
        status = b.left ? 0 : -1;
    }
    free(memory);
    return status;
}

/* --- drivers -------------------------------------------------------------- */

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

static uint64_t now_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000 + (uint64_t)now.tv_nsec;
}

static int slow_send(void *context, const uint8_t *bytes, size_t size)
{
    const struct slow_end *s = context;
    return s->beneath.send(s->beneath.context, bytes, size);
}

static int slow_receive(void *context, uint8_t *bytes, size_t size)
{
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

static void sleep_on(struct pollfd *fds, nfds_t count, uint64_t wait_us)
{
    struct timespec wait = {(time_t)(wait_us / 1000000),
                            (long)(wait_us % 1000000) * 1000};
    (void)ppoll(fds, count, &wait, NULL);
}

static void idle_tcp(void *context, uint64_t wait_us)
{
    struct wire *w = context;
    struct pollfd fd = {w->tcp.fd, tcp_events(&w->tcp), 0};
    sleep_on(&fd, 1, wait_us);
}

static void idle_line(void *context, uint64_t wait_us)
{
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

static void idle_net(void *context, uint64_t wait_us)
{
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
                    unsigned role, uint32_t baud)
{
    (void)role, (void)baud;
    tcp_pipe_init(&wire->tcp, fd);
    end->pipe = tcp_link_pipe(&wire->tcp);
    end->idle = idle_tcp;
    end->settings.window = 8;
    return 0;
}

static int open_line(struct wire *wire, struct host_bench_end *end, int fd,
                     unsigned role, uint32_t baud)
{
    (void)role;
    serial_pipe_init(&wire->line, fd, baud);
    wire->slow.beneath = serial_link_pipe(&wire->line);
    wire->slow.byte_ns = baud == 0 ? 0 : UINT64_C(10000000000) / baud;
    end->pipe = baud == 0
                    ? wire->slow.beneath
                    : (struct link_pipe){&wire->slow, slow_send, slow_receive};
    end->idle = idle_line;
    end->settings = (struct link_config){.window = 14, .message_max = 1608};
    link_for_serial(&end->settings, baud == 0 ? FAST_BAUD : baud);
    return 0;
}

/* Where the two ends of a keyed wire meet: a port that is free before they
 * part. */
static struct tcp_address meeting;

static int choose_meeting(int fds[2])
{
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
                    unsigned role, uint32_t baud)
{
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
                   struct host_bench_row *row)
{
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
                      struct host_error *error)
{
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

/* --- sim: both ends here, in virtual time --------------------------------- */

enum { SIM_BYTES_A_SECOND = 300000, SIM_STEP_US = 20, SIM_COUNT = 400 };

struct sim_bench {
    uint64_t now_us;
    struct sim_wire wire;
    struct link *link[2];
    uint32_t got[2], due[2];
    bool echo;
};

/* One step of time: end 1 echoes, where that is asked. */
static void sim_turn(struct sim_bench *s, size_t size)
{
    static const uint8_t bytes[MESSAGE];
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
               link_write(s->link[who], bytes, size, NULL, 0) == 0) {
            s->due[who]--;
        }
        (void)link_poll_send(s->link[who], s->now_us);
    }
}

/* Virtual microseconds until end 0 has had `count` messages. */
static double sim_count(struct sim_bench *s, uint32_t count, bool echo,
                        size_t size)
{
    uint64_t begin = s->now_us;
    s->echo = echo;
    s->got[0] = 0;
    s->due[0] = count;
    s->due[1] = echo ? 0 : count;
    while (s->got[0] < count && s->now_us - begin < PATIENCE_US) {
        sim_turn(s, size);
    }
    return (double)(s->now_us - begin);
}

static int run_sim(struct host_bench_row *row, struct host_error *error)
{
    static struct sim_bench s;
    static const struct sim_quality quality = {.bytes_per_s =
                                                   SIM_BYTES_A_SECOND,
                                               .latency_us = 100,
                                               .room = 512,
                                               .bytes = SIM_BYTES_MIN};
    struct host_bench_end end;
    void *memory[3] = {malloc(sim_wire_bytes(&quality)), NULL, NULL};
    open_line(&(struct wire){0}, &end, -1, 0, 0);
    memset(&s, 0, sizeof s);
    if (memory[0] != NULL) {
        sim_wire_init(&s.wire, memory[0], &quality, &s.now_us, 1);
    }
    for (unsigned who = 0; who < 2 && memory[0] != NULL; who++) {
        struct link_config c = end.settings;
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
        (void)sim_count(&s, 1, true, SMALL);
        row->round_trip_us = sim_count(&s, 1, true, SMALL);
        row->hop_us = sim_count(&s, 1, true, MESSAGE) / 2;
        uint64_t used = used_us();
        double us = sim_count(&s, SIM_COUNT, false, MESSAGE);
        row->cpu_us = (double)(used_us() - used) / (2.0 * SIM_COUNT);
        row->bytes_per_s = 1e6 * SIM_COUNT * MESSAGE / us;
    }
    bool made = s.link[1] != NULL;
    for (unsigned i = 0; i < 3; i++) {
        free(memory[i]);
    }
    return made ? 0 : host_fail_memory(error, "the simulated links");
}

/* --- mpi: a program of its own -------------------------------------------- */

/* False: there is no mpirun, or it does not start two ranks. */
static bool run_mpi(struct host_bench_row *row)
{
    char path[4096], command[4400];
    struct host_error ignored = {0};
    if (host_cluster_program(NULL, path, sizeof path - 8, &ignored) != 0) {
        return false;
    }
    strcpy(strrchr(path, '/') + 1, "incode-mpi");
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
                      const struct host_bench_row *row)
{
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

int host_bench_links(struct host_error *error)
{
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
    if (run_sim(&sim, error) != 0) {
        return error->code;
    }
    print_row("sim, 3000000 baud, 100 us away", SIM_BYTES_A_SECOND, &sim);
    if (run_mpi(&mpi)) {
        print_row("mpi, two ranks", 0, &mpi);
    } else {
        printf("%-30s not measured: mpirun does not start two ranks here\n",
               "mpi, two ranks");
    }
    return 0;
}
