/* Bad wires for the system tests, by chance from a seed; at its end by SIGTERM
 * it prints what it has done to them.
 *
 *     relay SEED BYTES_A_FAULT MS_A_CLOSE DELAY_MS FROM:TO...
 *
 * relays TCP connections on loopback (relay/network.h).  FROM, TO: ports; 0 for
 * BYTES_A_FAULT or MS_A_CLOSE: never.
 *
 *     relay uart [NAME=VALUE...] PATH,PATH...
 *
 * stands between UARTs that are sockets with paths (relay/uart.h).  NAME: seed,
 * baud, fifo, flip, drop, burst; the last three: one in so many bytes.  @PATH:
 * a socket that the relay makes; else one that it calls.
 */
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "relay/chance.h"
#include "relay/network.h"
#include "relay/uart.h"

static volatile sig_atomic_t ended;

static void end(int number) {
    (void)number;
    ended = 1;
}

static int complain(const char *text) {
    fprintf(stderr, "relay: %s: %s\n", text, strerror(errno));
    return 1;
}

static int relay_network(int argc, char **argv) {
    struct network_settings settings = {
        strtoull(argv[1], NULL, 10), strtoull(argv[2], NULL, 10),
        strtoull(argv[3], NULL, 10), strtoull(argv[4], NULL, 10)};
    if (!network_open(&settings))
        return complain(argv[0]);
    for (int i = 5; i < argc; i++)
        if (!network_add(argv[i]))
            return complain(argv[i]);
    network_run(&ended);
    network_print();
    return 0;
}

/* --- UARTs ---------------------------------------------------------------- */

static bool set_uart(struct uart_settings *settings, const char *text) {
    unsigned long long value = 0;
    char name[8];
    if (sscanf(text, "%7[a-z]=%llu", name, &value) != 2 || value > UINT32_MAX)
        return false;
    struct {
        const char *name;
        uint32_t *value;
    } row[] = {{"baud", &settings->baud},
               {"fifo", &settings->fifo},
               {"flip", &settings->flip_bytes},
               {"drop", &settings->drop_bytes},
               {"burst", &settings->burst_bytes}};
    if (strcmp(name, "seed") == 0) {
        settings->seed = value;
        return true;
    }
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        if (strcmp(name, row[i].name) == 0) {
            *row[i].value = (uint32_t)value;
            return true;
        }
    }
    return false;
}

static void print_uarts(const struct uart_counts *c) {
    printf("%llu bytes, %llu flips, %llu drops, %llu bursts of %llu bytes, "
           "%llu overruns, %llu unheard, %llu connections\n",
           (unsigned long long)c->bytes, (unsigned long long)c->flips,
           (unsigned long long)c->drops, (unsigned long long)c->bursts,
           (unsigned long long)c->burst_bytes, (unsigned long long)c->overruns,
           (unsigned long long)c->unheard, (unsigned long long)c->connections);
}

static int relay_uarts(char **argv) {
    static struct uart_wires wires;
    struct uart_settings settings = {.seed = 1, .baud = 115200};
    for (; *argv != NULL && set_uart(&settings, *argv); argv++) {
    }
    if (settings.baud == 0 || !uart_wires_init(&wires, &settings))
        return complain("uart");
    for (; *argv != NULL; argv++)
        if (!uart_wires_add(&wires, *argv))
            return complain(*argv);
    while (!ended)
        uart_wires_wait(&wires, uart_wires_carry(&wires, chance_now_us()));
    uart_wires_close(&wires);
    print_uarts(&wires.counts);
    return 0;
}

int main(int argc, char **argv) {
    bool uarts = argc >= 3 && strcmp(argv[1], "uart") == 0;
    if (!uarts && argc < 6) {
        fprintf(stderr, "usage: relay SEED BYTES_A_FAULT MS_A_CLOSE DELAY_MS "
                        "FROM:TO...\n"
                        "       relay uart [NAME=VALUE...] PATH,PATH...\n");
        return 2;
    }
    (void)signal(SIGTERM, end);
    return uarts ? relay_uarts(argv + 2) : relay_network(argc, argv);
}
