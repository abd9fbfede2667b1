#include "progress.h"

#include <stdio.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "clock.h"

enum { EVERY_US = 100000, BAR_MAX = 40, TEXT = 52 };

void host_progress_start(struct host_progress *progress, bool wanted)
{
    progress->wanted = wanted && isatty(STDERR_FILENO) != 0;
    progress->shown = false;
    progress->start_us = host_now_us();
    progress->next_us = progress->start_us + 2 * EVERY_US;
}

/* Cells of the bar that the terminal's width leaves. */
static unsigned bar_cells(void)
{
    struct winsize size;
    if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col < TEXT) {
        return 10;
    }
    unsigned cells = size.ws_col - TEXT;
    return cells > BAR_MAX ? BAR_MAX : cells;
}

void host_progress_show(struct host_progress *progress, uint64_t done,
                        uint64_t total, uint64_t tetrahedra)
{
    static const char hashes[] = "########################################";
    uint64_t now = host_now_us();
    if (!progress->wanted || now < progress->next_us || total == 0) {
        return;
    }
    progress->next_us = now + EVERY_US;
    double seconds = 1e-6 * (double)(now - progress->start_us);
    double part = (double)done / (double)total;
    unsigned cells = bar_cells();
    int full = (int)(part * (double)cells);
    unsigned left =
        part > 0.0 ? (unsigned)(seconds / part - seconds + 0.999) : 0;
    fprintf(stderr, "\r%3d %% [%.*s%*s] %7.3f Mtet/s ", (int)(100.0 * part),
            full, hashes, (int)cells - full, "",
            1e-6 * (double)tetrahedra / seconds);
    if (part > 0.0) {
        fprintf(stderr, "%u:%02u:%02u left ", left / 3600, left / 60 % 60,
                left % 60);
    } else {
        fprintf(stderr, "             ");
    }
    fflush(stderr);
    progress->shown = true;
}

void host_progress_end(struct host_progress *progress)
{
    if (progress->shown) {
        fprintf(stderr, "\r\033[K");
        fflush(stderr);
        progress->shown = false;
    }
}
