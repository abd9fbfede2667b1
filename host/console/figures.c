/* Figures in few letters, and bars. */
#include <string.h>

#include "commands.h"

static const char *scaled(double value, double unit, const char *names,
                          char text[HOST_SHELL_FIGURE]) {
    unsigned power = 0;
    while (value >= 999.5 && names[power + 1] != '\0') {
        value /= unit;
        power++;
    }
    int digits = power == 0 || value >= 99.95 ? 0 : value >= 9.995 ? 1 : 2;
    snprintf(text, HOST_SHELL_FIGURE, "%.*f%.*s", digits, value, power > 0,
             names + power);
    return text;
}

const char *host_shell_bytes(uint64_t bytes, char text[HOST_SHELL_FIGURE]) {
    return scaled((double)bytes, 1024, " KMGTPE", text);
}

const char *host_shell_count(uint64_t count, char text[HOST_SHELL_FIGURE]) {
    return scaled((double)count, 1000, " kMGTPE", text);
}

const char *host_shell_time(uint64_t us, char text[HOST_SHELL_FIGURE]) {
    if (us < 1000) {
        snprintf(text, HOST_SHELL_FIGURE, "%u us", (unsigned)us);
    } else if (us < 1000000) {
        snprintf(text, HOST_SHELL_FIGURE, "%.*f ms",
                 us < 10000    ? 2
                 : us < 100000 ? 1
                               : 0,
                 1e-3 * (double)us);
    } else {
        snprintf(text, HOST_SHELL_FIGURE, "%.2f s", 1e-6 * (double)us);
    }
    return text;
}

const char *host_shell_bar(double part, unsigned cells,
                           char text[HOST_SHELL_BAR]) {
    cells = cells + 3 < HOST_SHELL_BAR ? cells : HOST_SHELL_BAR - 3;
    part = part < 0.0 ? 0.0 : part < 1.0 ? part : 1.0;
    unsigned full = (unsigned)(part * cells + 0.5);
    full = full == 0 && part > 0.0 ? 1 : full;
    text[0] = '[';
    memset(text + 1, ' ', cells);
    memset(text + 1, '#', full);
    text[cells + 1] = ']';
    text[cells + 2] = '\0';
    return text;
}
