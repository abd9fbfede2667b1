#include "wire.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "boards/process.h"
#include "transport/drivers/secure_sodium.h"
#include "transport/drivers/unix_file.h"

enum { LOOK_US = 500000 };

void linux_wire_inherit(struct linux_wire *wire, int fd) {
    memset(wire, 0, sizeof *wire);
    wire->kind = isatty(fd) == 1 ? LINUX_TERMINAL : LINUX_SOCKET;
    if (wire->kind == LINUX_TERMINAL)
        serial_pipe_init(&wire->serial, fd, 0);
    else
        tcp_pipe_init(&wire->tcp, fd);
}

/* --- wires that the node opens itself ------------------------------------- */

static bool open_socket(struct linux_wire *wire,
                        const struct tcp_wire_config *config,
                        struct linux_fault *fault) {
    wire->kind = LINUX_NET;
    if (tcp_wire_open(wire->net, config) == 0)
        return true;
    bool file = tcp_address_path(&config->address) != NULL;
    fault->what = "cannot listen there";
    fault->reason = errno;
    fault->next = !file ? "end what has that port, or give an address of this "
                          "machine"
                  : errno == EEXIST ? "that file is no socket; give another "
                                      "path"
                                    : "end who listens there, or give a path "
                                      "in a folder of your own";
    return false;
}

/* The user who must do without a key is told what that means. */
static bool guard_net(const struct linux_guard *guard,
                      struct tcp_wire_config *config,
                      struct linux_fault *fault) {
    config->insecure = guard->insecure;
    config->key = guard->insecure ? NULL : guard->key;
    config->suite = config->key == NULL ? NULL : &secure_sodium;
    config->source = guard->source;
    if (!guard->insecure && guard->key == NULL) {
        fault->what = "a wire over TCP wants a key";
        fault->next = "make one with: incode key FILE, and give it with --key "
                      "(or give --insecure)";
        return false;
    }
    if (guard->insecure && getenv(LINUX_AGAIN) == NULL) {
        fault_print(&(struct linux_fault){
            .where = "--wire",
            .value = fault->value,
            .what = "insecure: whoever reaches that address can take the wire "
                    "over, and send false results",
            .next = "make a key with: incode key FILE"});
    }
    return true;
}

static bool open_net(struct linux_wire *wire, const char *address, bool listens,
                     const struct linux_guard *guard,
                     struct linux_fault *fault) {
    struct tcp_wire_config config = {.listens = listens, .ends = &wire->ends};
    if (tcp_address_parse(&config.address, address) != 0) {
        fault->what = "not an address in numbers with a port";
        fault->next = "write 10.0.0.7:7001 or [2001:db8::7]:7001";
        return false;
    }
    return guard_net(guard, &config, fault) &&
           open_socket(wire, &config, fault);
}

static bool open_path(struct linux_wire *wire, const char *path, bool listens,
                      struct linux_fault *fault) {
    struct tcp_wire_config config = {.listens = listens};
    if (tcp_address_set_path(&config.address, path) != 0) {
        fault->what = "not a path of 1 to 107 bytes";
        fault->next = "give a shorter one";
        return false;
    }
    return open_socket(wire, &config, fault);
}

/* A device that is not there, or vanished, is looked for from time to time. */
static void recover(void *context) {
    struct linux_wire *wire = context;
    uint64_t now_us = process_clock_us(CLOCK_MONOTONIC);
    serial_close(wire->serial.fd);
    wire->serial.fd = -1;
    if (now_us - wire->look_us < LOOK_US)
        return;
    wire->look_us = now_us;
    int fd = serial_open(wire->device, wire->baud, wire->rts_cts);
    wire->reason = fd < 0 ? errno : 0;
    if (fd >= 0) {
        serial_pipe_init(&wire->serial, fd, wire->baud);
        wire->serial.recover = recover;
        wire->serial.context = wire;
    }
}

/* From the end, as a device's name may have colons of its own. */
static bool read_serial(struct linux_wire *wire, const char *text) {
    static const char flow[] = ":rtscts";
    size_t size = strlen(text);
    wire->rts_cts =
        size >= strlen(flow) && strcmp(text + size - strlen(flow), flow) == 0;
    size -= wire->rts_cts ? strlen(flow) : 0;
    size_t digits = 0;
    while (digits < size && text[size - digits - 1] >= '0' &&
           text[size - digits - 1] <= '9')
        digits++;
    size -= digits;
    if (digits == 0 || size < 2 || text[size - 1] != ':' ||
        size > sizeof wire->device)
        return false;
    wire->baud = (uint32_t)strtoul(text + size, NULL, 10);
    memcpy(wire->device, text, size - 1);
    return true;
}

static bool open_serial(struct linux_wire *wire, const char *text,
                        struct linux_fault *fault) {
    if (!read_serial(wire, text)) {
        fault->what = "not a device and its rate";
        fault->next = "write serial:/dev/ttyS0:115200 or "
                      "serial:/dev/ttyS0:115200:rtscts";
        return false;
    }
    wire->kind = LINUX_TERMINAL;
    serial_pipe_init(&wire->serial, -1, wire->baud);
    wire->serial.recover = recover;
    wire->serial.context = wire;
    recover(wire);
    if (wire->serial.fd < 0 && access(wire->device, F_OK) == 0) {
        fault->what = "does not open at that rate";
        fault->reason = wire->reason;
        fault->next = "end who uses it, or give a rate that it knows";
        return false;
    }
    return true;
}

/* What is behind a word that the text begins with; NULL: it does not. */
static const char *behind(const char *text, const char *word) {
    size_t size = strlen(word);
    return strncmp(text, word, size) == 0 ? text + size : NULL;
}

bool linux_wire_open(struct linux_wire *wire, const char *text,
                     const struct linux_guard *guard, struct tcp_wire *net,
                     struct linux_fault *fault) {
    const char *at;
    memset(wire, 0, sizeof *wire);
    wire->net = net;
    wire->text = text;
    wire->ends =
        (struct secure_ends){{SECURE_NODE_UNKNOWN, SECURE_PORT_UNKNOWN},
                             {SECURE_NODE_UNKNOWN, SECURE_PORT_UNKNOWN}};
    if ((at = behind(text, "listen:")) != NULL)
        return open_net(wire, at, true, guard, fault);
    if ((at = behind(text, "call:")) != NULL)
        return open_net(wire, at, false, guard, fault);
    if ((at = behind(text, "unix-listen:")) != NULL)
        return open_path(wire, at, true, fault);
    if ((at = behind(text, "unix-call:")) != NULL)
        return open_path(wire, at, false, fault);
    if ((at = behind(text, "serial:")) != NULL)
        return open_serial(wire, at, fault);
    fault->what =
        "not one of listen:, call:, unix-listen:, unix-call: and serial:";
    return false;
}

void linux_wires_name(struct linux_wire *wires, unsigned count,
                      const struct cube_config *cube) {
    for (unsigned d = 0; d < count; d++) {
        wires[d].ends.self = (struct link_end){cube->self, (uint8_t)d};
        wires[d].ends.peer = cube_peer_of(cube, cube->self, d);
    }
}

static const struct linux_wire *ending;
static unsigned ending_count;

/* What is called here may be called in a handler. */
static void end(int signal_number) {
    for (unsigned i = 0; i < ending_count; i++)
        if (ending[i].kind == LINUX_NET)
            tcp_wire_close(ending[i].net);
    (void)raise(signal_number);
}

void linux_wires_end_with(const struct linux_wire *wires, unsigned count) {
    static const int signals[] = {SIGINT, SIGTERM, SIGHUP};
    struct sigaction action = {.sa_handler = end,
                               .sa_flags = (int)SA_RESETHAND};
    ending = wires;
    ending_count = count;
    for (size_t i = 0; i < sizeof signals / sizeof signals[0]; i++)
        (void)sigaction(signals[i], &action, NULL);
}

struct link_pipe linux_wire_pipe(struct linux_wire *wire) {
    return wire->kind == LINUX_TERMINAL ? serial_link_pipe(&wire->serial)
           : wire->kind == LINUX_NET    ? tcp_wire_pipe(wire->net)
                                        : tcp_link_pipe(&wire->tcp);
}

/* Adds what to wait for: the number of entries. */
static unsigned add_events(const struct linux_wire *wire, struct pollfd *fds) {
    if (wire->kind == LINUX_NET)
        return tcp_wire_events(wire->net, fds);
    bool serial = wire->kind == LINUX_TERMINAL;
    fds->fd = serial ? wire->serial.fd : wire->tcp.fd;
    fds->events =
        serial ? serial_events(&wire->serial) : tcp_events(&wire->tcp);
    return fds->events != 0 ? 1 : 0;
}

static void hear(struct linux_wire *wire, const struct pollfd *fds,
                 unsigned count) {
    if (wire->kind == LINUX_NET)
        tcp_wire_heard(wire->net, fds, count);
    else if (wire->kind == LINUX_SOCKET && count > 0)
        tcp_heard(&wire->tcp, fds->revents);
}

/* Once, and of another key at the end that calls: whoever calls the other may
 * be a stranger. */
static void tell_of_key(struct linux_wire *wire) {
    bool calls = wire->kind == LINUX_NET && !wire->net->config.listens;
    bool lacks_key = wire->kind == LINUX_NET && wire->net->lone_key &&
                     wire->net->config.key == NULL;
    if (!calls && lacks_key && !wire->told) {
        wire->told = true;
        fault_print(&(struct linux_fault){
            .where = "--wire",
            .value = wire->text,
            .what = "is called by one who has a key, and this node has none",
            .next = "give both ends the same key file, here with --key"});
    }
    if (!calls || wire->told || wire->net->pause_us <= 2 * TCP_PAUSE_MIN_US)
        return;
    struct tcp_wire_doubt doubt = tcp_wire_doubt(wire->net);
    if (doubt.what != NULL) {
        wire->told = true;
        fault_print(&(struct linux_fault){.where = "--wire",
                                          .value = wire->text,
                                          .what = doubt.what,
                                          .next = doubt.next});
    }
}

uint32_t linux_wires_refused(const struct linux_wire *wires, unsigned count) {
    uint32_t refused = 0;
    for (unsigned i = 0; i < count; i++) {
        const struct tcp_wire *net = wires[i].net;
        bool other = wires[i].kind == LINUX_NET && net->tcp.fd < 0 &&
                     (net->other_key || net->lone_key);
        refused |= (uint32_t)other << i;
    }
    return refused;
}

void linux_wires_idle(struct linux_wire *wires, unsigned count,
                      uint64_t wait_us, uint64_t awake_us) {
    struct pollfd fds[CUBE_LINKS_MAX * TCP_WIRE_FDS_MAX];
    unsigned first[CUBE_LINKS_MAX + 1], used = 0;
    for (unsigned i = 0; i < count; i++) {
        const struct linux_wire *wire = &wires[i];
        if (wire->kind == LINUX_TERMINAL &&
            serial_wait_us(&wire->serial) < wait_us)
            wait_us = serial_wait_us(&wire->serial);
        if (wire->kind == LINUX_NET && tcp_wire_wait_us(wire->net) < wait_us)
            wait_us = tcp_wire_wait_us(wire->net);
        first[i] = used;
        used += add_events(wire, fds + used);
    }
    first[count] = used;
    wait_files(fds, used, wait_us, awake_us);
    for (unsigned i = 0; i < count; i++) {
        hear(&wires[i], fds + first[i], first[i + 1] - first[i]);
        tell_of_key(&wires[i]);
    }
}
