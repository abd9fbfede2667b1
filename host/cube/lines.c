#include "lines.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "host/base/error.h"
#include "gpio.h"

static const int signals[HOST_GUARD_SIGNALS] = {SIGINT, SIGTERM, SIGHUP,
                                                SIGQUIT, SIGTSTP};

/* What a handler can reach: signals come to any thread. */
static volatile sig_atomic_t came[HOST_GUARD_SIGNALS];
static volatile sig_atomic_t pipe_end = -1;

static void take(int signal) {
    int reason = errno;
    for (int i = 0; i < HOST_GUARD_SIGNALS; i++)
        came[i] = came[i] || signals[i] == signal;
    if (signal != SIGTSTP) {
        /* A pipe that is full wakes as well. */
        (void)!write((int)pipe_end, "", 1);
    }
    errno = reason;
}

/* 0, or -1 and errno. */
static int host_guard_begin(struct host_guard *guard) {
    struct sigaction action = {.sa_handler = take, .sa_flags = SA_RESTART};
    memset(guard, 0, sizeof *guard);
    if (pipe2(guard->ends, O_CLOEXEC | O_NONBLOCK) != 0)
        return -1;
    sigfillset(&action.sa_mask);
    pipe_end = guard->ends[1];
    for (int i = 0; i < HOST_GUARD_SIGNALS; i++) {
        came[i] = 0;
        guard->taken[i] = sigaction(signals[i], NULL, &guard->before[i]) == 0 &&
                          guard->before[i].sa_handler != SIG_IGN &&
                          sigaction(signals[i], &action, NULL) == 0;
    }
    return 0;
}

/* Sleeps; false: cut short by a signal.  Ctrl-Z does not cut it short. */
static bool host_guard_wait(struct host_guard *guard, unsigned ms) {
    struct pollfd look = {.fd = guard->ends[0], .events = POLLIN};
    uint64_t end_us = host_now_us() + (uint64_t)ms * 1000, now_us;
    int got = 0;
    while (got <= 0 && (now_us = host_now_us()) < end_us)
        got = poll(&look, 1, (int)((end_us - now_us + 999) / 1000));
    return got <= 0;
}

/* Signals that came meanwhile are raised before it returns. */
static void host_guard_end(struct host_guard *guard) {
    for (int i = 0; i < HOST_GUARD_SIGNALS; i++)
        if (guard->taken[i])
            (void)sigaction(signals[i], &guard->before[i], NULL);
    /* A handler may still be at work in another thread: what it writes to is
     * the last to go. */
    for (int i = 0; i < HOST_GUARD_SIGNALS; i++) {
        if (came[i]) {
            came[i] = 0;
            (void)raise(signals[i]);
        }
    }
    pipe_end = -1;
    close(guard->ends[0]);
    close(guard->ends[1]);
}

/* --- lines ---------------------------------------------------------------- */

/* --- one line ------------------------------------------------------------- */

static const char *device(const struct host_lines *lines,
                          const struct host_cube_pin *pin) {
    return host_cube_host_wire(lines->file, (unsigned)pin->wire)->device[1];
}

static int set(const struct host_lines *lines, const struct host_cube_pin *pin,
               bool active, struct host_error *error) {
    int status =
        pin->wire < 0
            ? host_gpio_set(lines->gpio[pin - lines->file->pin], active)
            : serial_port_set(lines->port[pin->wire], pin->rts, active);
    return status == 0
               ? 0
               : host_fail(error, HOST_CUBE,
                           "%s:%u: the %s line of node %u (%s): %s; see "
                           "that it is there, and plugged in",
                           lines->file->path, pin->line,
                           host_line_name(pin->kind), pin->node,
                           pin->wire < 0 ? pin->chip : device(lines, pin),
                           strerror(errno));
}

static int open_gpio(struct host_lines *lines, unsigned i,
                     struct host_error *error) {
    const struct host_cube_pin *pin = &lines->file->pin[i];
    char why[HOST_GPIO_WHY];
    int status = host_gpio_open(&lines->gpio[i], pin, why);
    return status == 0
               ? 0
               : host_fail(error, status, "%s:%u: the %s line of node %u: %s",
                           lines->file->path, pin->line,
                           host_line_name(pin->kind), pin->node, why);
}

static int open_port(struct host_lines *lines, unsigned k,
                     struct host_error *error) {
    const struct host_cube_wire *wire = host_cube_host_wire(lines->file, k);
    struct serial_port_settings settings = {.baud = wire->baud,
                                            .rts_cts = wire->rts_cts,
                                            .dtr = !wire->dtr_low,
                                            .rts = !wire->rts_low};
    memcpy(settings.name, wire->device[1], sizeof settings.name);
    lines->port[k] = &lines->own[k];
    return serial_port_open(lines->port[k], &settings) == 0
               ? 0
               : host_fail(error, HOST_CUBE, "%s", lines->port[k]->fault);
}

/* --- all of them ---------------------------------------------------------- */

int host_lines_open(struct host_lines *lines, const struct host_cube_file *file,
                    struct host_remote *remote, struct host_error *error) {
    memset(lines, 0, sizeof *lines);
    lines->file = file;
    lines->gpio = calloc(file->pins + 1, sizeof(void *));
    if (lines->gpio == NULL)
        return host_fail_memory(error, "the reset lines");
    for (unsigned i = 0; i < file->pins && error->code == 0; i++) {
        int wire = file->pin[i].wire;
        if (wire < 0)
            (void)open_gpio(lines, i, error);
        else if (remote != NULL)
            lines->port[wire] = &remote->port[wire].serial;
        else if (lines->port[wire] == NULL)
            (void)open_port(lines, (unsigned)wire, error);
    }
    if (error->code != 0)
        host_lines_close(lines);
    return error->code;
}

void host_lines_close(struct host_lines *lines) {
    for (unsigned i = 0; lines->gpio != NULL && i < lines->file->pins; i++)
        host_gpio_close(lines->gpio[i]);
    for (int k = 0; k < HOST_PORTS_MAX; k++) {
        if (lines->port[k] == &lines->own[k])
            serial_port_close(lines->port[k]);
        lines->port[k] = NULL;
    }
    free(lines->gpio);
    lines->gpio = NULL;
}

/* Both are tried, whatever fails.  False: cut short. */
static bool pulse(struct host_lines *lines, const struct host_cube_pin *reset,
                  const struct host_cube_pin *boot, struct host_guard *guard,
                  struct host_error *error) {
    bool good = (boot == NULL || set(lines, boot, true, error) == 0) &&
                set(lines, reset, true, error) == 0;
    bool whole = !good || host_guard_wait(guard, HOST_RESET_MS);
    (void)set(lines, reset, false, error);
    if (boot != NULL) {
        whole =
            whole && (error->code != 0 || host_guard_wait(guard, HOST_BOOT_MS));
        (void)set(lines, boot, false, error);
    }
    return whole;
}

int host_lines_reset(struct host_lines *lines, unsigned node, bool stay,
                     struct host_error *error) {
    const struct host_cube_file *file = lines->file;
    const struct host_cube_pin *reset =
        host_cube_pin(file, node, HOST_LINE_RESET);
    struct host_guard guard;
    if (reset == NULL) {
        return host_fail(error, HOST_CUBE,
                         "%s: node %u has no reset line; name it in nodes, as "
                         "in { node = %u; reset = { chip = \"gpiochip0\"; line "
                         "= 17; }; }, or press its button",
                         file->path, node, node);
    }
    if (host_guard_begin(&guard) != 0) {
        return host_fail(error, HOST_BROKEN, "a reset: %s; close some files",
                         strerror(errno));
    }
    bool whole = pulse(lines, reset,
                       stay ? host_cube_pin(file, node, HOST_LINE_BOOT) : NULL,
                       &guard, error);
    host_guard_end(&guard);
    return whole ? error->code
                 : host_fail(error, HOST_CUBE,
                             "%s: a signal cut the reset of node %u short; "
                             "reset it again",
                             file->path, node);
}
