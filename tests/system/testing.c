/* The program, with options of `incode run` for the faults that tests make: its
 * own main has another name here (tests/tests.mk). */
#include "host/run/arguments.h"

int incode_main(int argc, char **argv);

static const struct host_option rows[] = {
    {.help = "Faults:"},
    {"shuffle-seed", 0, "N", "Make arriving pages ready in a random order",
     HOST_AT(struct host_run_options, shuffle_seed), .most = UINT64_MAX},
    {"host-stall", 0, "MS", "The host sleeps up to MS milliseconds at random",
     HOST_AT(struct host_run_options, throttle.stall_us_max), .most = 60000,
     .unit = 1000},
    {"host-rate", 0, "BYTES",
     "The host reads BYTES a second for --host-rate-time",
     HOST_AT(struct host_run_options, throttle.bytes_a_second), .least = 1,
     .most = 1000000000},
    {"host-rate-time", 0, "S",
     "Of the first S seconds of --host-rate. Default: 30",
     HOST_AT(struct host_run_options, throttle.slow_us), .most = 86400,
     .unit = 1000000},
    {"host-unplug", 0, "MS",
     "The host closes its serial wire every MS milliseconds, for half a second",
     HOST_AT(struct host_run_options, unplug_us), .least = 50, .most = 86400000,
     .unit = 1000},
    {"board-reset", 0, "MS",
     "Every MS milliseconds another emulated board is reset, each once",
     HOST_AT(struct host_run_options, trouble.every_us[0]), .least = 10,
     .most = 86400000, .unit = 1000},
    {"board-stop", 0, "MS", "The same, but stopped for half of MS",
     HOST_AT(struct host_run_options, trouble.every_us[1]), .least = 10,
     .most = 86400000, .unit = 1000},
    {"board-kill", 0, "MS", "The same, but killed",
     HOST_AT(struct host_run_options, trouble.every_us[2]), .least = 10,
     .most = 86400000, .unit = 1000},
    {"seed", 0, "N", "Seed of --host-stall",
     HOST_AT(struct host_run_options, throttle.seed), .most = UINT64_MAX},
    {0}};

int main(int argc, char **argv) {
    host_arguments_add(rows);
    return incode_main(argc, argv);
}
