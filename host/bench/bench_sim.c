#include "bench_sim.h"

#include <stdlib.h>
#include <string.h>

#include "transport/drivers/sim.h"

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
               link_write(s->link[who], bytes, size, NULL, 0) == 0) {
            s->due[who]--;
        }
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
    while (s->got[0] < count && s->now_us - begin < PATIENCE_US) {
        sim_turn(s, size);
    }
    return (double)(s->now_us - begin);
}

int host_bench_sim(struct host_bench_row *row, struct host_error *error) {
    static struct sim_bench s;
    static const struct sim_quality quality = {.bytes_per_s =
                                                   HOST_BENCH_SIM_BYTES,
                                               .latency_us = 100,
                                               .room = 512,
                                               .bytes = SIM_BYTES_MIN};
    void *memory[3] = {malloc(sim_wire_bytes(&quality)), NULL, NULL};
    memset(&s, 0, sizeof s);
    if (memory[0] != NULL) {
        sim_wire_init(&s.wire, memory[0], &quality, &s.now_us, 1);
    }
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
    for (unsigned i = 0; i < 3; i++) {
        free(memory[i]);
    }
    return made ? 0 : host_fail_memory(error, "the simulated links");
}
