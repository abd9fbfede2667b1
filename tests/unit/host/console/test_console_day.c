/* A day of the console, in the simulator's time: wires are pulled and put back,
 * nodes are reset, counters of 32 bits in microseconds go round twenty times,
 * and neither the answers nor its memory change. */
#include <malloc.h>

#include "shell_world.h"
#include "tests/unit/emulated.h"

#define HOUR_US (UINT64_C(3600) * 1000000)
enum { HOURS = 24, HOURS_EMULATED = 2, SETTLE_S = 30 };

static void is_well(const char *line) {
    if (says(line) != 0)
        fail_msg("%s: %s%s", line, desk.said, desk.failed);
    assert_true(desk.said[0] != '\0');
}

static void all_is_well(void) {
    is_well("ping all 2");
    is_well("links");
    is_well("stat");
    is_well("nodes");
    is_well("trace 0 3");
    is_well("wires");
    is_well("memory 1-2");
    desk.noted[0] = '\0';
}

/* What happens in an hour, by turns. */
static void disturb(unsigned hour) {
    unsigned node = 1 + hour % 3;
    if (hour % 3 == 0) {
        is_well("reset 1-3");
    } else if (hour % 3 == 1) {
        host_world_crash(&desk.world, node, 2000000, false);
        let_pass(SETTLE_S * UINT64_C(1000000));
        assert_non_null(strstr(desk.noted, "begun anew"));
    } else {
        deafen(0, 1, true);
        let_pass(SETTLE_S * UINT64_C(1000000));
        assert_int_equal(says("wires"), HOST_CUBE);
        deafen(0, 1, false);
    }
    let_pass(SETTLE_S * UINT64_C(1000000));
}

TEST(a_day_passes) {
    size_t first = 0;
    unsigned hours = emulated() || SANITIZED ? HOURS_EMULATED : HOURS;
    begin(2, false);
    for (unsigned hour = 0; hour < hours; hour++) {
        uint64_t end_us = (hour + 1) * HOUR_US;
        all_is_well();
        disturb(hour);
        all_is_well();
        size_t used = mallinfo2().uordblks;
        first = hour == 2 ? used : first;
        if (hour > 2 && used > first + 4096)
            fail_msg("hour %u: %zu bytes, %zu at first", hour, used, first);
        let_pass(end_us - desk.world.now_us);
    }
    all_is_well();
    assert_true(desk.world.now_us >= hours * HOUR_US);
    end();
}
