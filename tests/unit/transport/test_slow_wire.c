/* Serial wires of bare boards: slow, noisy, with a board at each end that looks
 * at its UARTs every 50 ms at worst, and knows the rate of its own wires alone,
 * which a relay or another board may not keep. */
#include "link_pair.h"

enum {
    RING = 790, /* bytes that a driver's ring and an emulator's socket take */
    MESSAGES = 60
};

/* Both directions at once; what share of the wire the messages had. */
static double share(uint32_t baud, uint32_t told, uint32_t look_us, bool bad,
                    uint64_t seed) {
    struct host_sim_cube_options wire = perfect;
    struct link_config config = {.window = 14, .message_max = 1608};
    link_for_serial(&config, told);
    wire.wire.bytes_per_s = baud / 10;
    wire.wire.room = RING;
    if (bad) {
        wire.faults.chance[SIM_FLIP] = 1e-5;
        wire.faults.chance[SIM_LOSS] = 0.01;
        wire.faults.chance[SIM_BURST] = 2e-5;
        wire.faults.burst_bytes = 100;
    }
    struct pair *p = new_pair(&config, &wire, seed);
    for (unsigned i = 0; i < 40; i++) { /* they come up */
        p->ends[0].most = p->ends[1].most = 0;
        step(p, look_us);
    }
    uint64_t begin_us = p->now_us;
    run(p, MESSAGES, look_us, 2000000000);
    double bytes = (double)p->ends[0].payload,
           us = (double)(p->now_us - begin_us);
    for (unsigned who = 0; who < 2; who++) {
        const struct link_statistics *s = link_statistics(p->ends[who].link);
        assert_int_equal(s->sessions, 1);
        assert_true(link_state(p->ends[who].link) == LINK_UP);
    }
    free_pair(p);
    return bytes * 1e6 / us / (baud / 10.0);
}

TEST(slow_wires_carry) {
    static const struct {
        uint32_t baud, told, look_us;
    } cases[] = {{19200, 19200, 1000},   {19200, 19200, 50000},
                 {19200, 115200, 1000},  {19200, 115200, 50000},
                 {115200, 115200, 1000}, {115200, 115200, 50000},
                 {115200, 921600, 1000}, {115200, 921600, 50000},
                 {921600, 115200, 5000}, {921600, 921600, 5000}};
    for (unsigned i = 0; i < 10; i++) {
        double clean =
            share(cases[i].baud, cases[i].told, cases[i].look_us, false, i);
        double noisy = 0;
        for (uint64_t seed = 0; seed < 5; seed++) {
            noisy += share(cases[i].baud, cases[i].told, cases[i].look_us, true,
                           seed) /
                     5;
        }
        assert_true(clean > 0.9);
        assert_true(noisy > 0.75);
    }
}
