/* A bad network: relays TCP connections on loopback, and changes, deletes and
 * delays bytes and closes connections, by chance from a seed.
 *
 * Memory: 128 KB a direction of up to 128 connections, from malloc. */
#ifndef TESTS_SYSTEM_RELAY_NETWORK_H
#define TESTS_SYSTEM_RELAY_NETWORK_H

#include <signal.h>
#include <stdbool.h>
#include <stdint.h>

struct network_settings {
    uint64_t seed;
    uint64_t bytes_a_fault, ms_a_close; /* on average; 0: never */
    uint64_t delay_ms;                  /* at most */
};

/* False: there is no memory. */
bool network_open(const struct network_settings *settings);

/* Takes connections to a port and passes them on to another: "FROM:TO".  False,
 * and errno. */
bool network_add(const char *text);

/* Until *ended. */
void network_run(const volatile sig_atomic_t *ended);

/* How often each was done. */
void network_print(void);

#endif
