#include "progress.h"

#include <errno.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "error.h"
#include "text.h"

enum {
    EVERY_US = 100000,
    LINE_US = 3000000, /* without a terminal */
    BAR_MAX = 40,
    BAR_MIN = 6,
    WIDTH = 80,
    HEIGHT = 24,
    TEXT = 256,
    TEXT_MAX = 2048,
    ROWS_MAX = 64,
    GONE_BYTES = 24
};

static struct {
    bool wanted, terminal;
    const char *what, *unit;
    uint64_t start_us, next_us; /* of the phase; when a line is due */
    uint64_t added;
    char text[TEXT]; /* as it stands */
    volatile sig_atomic_t shown;
    unsigned rows; /* of a table; 0: there is the line */
    char row[ROWS_MAX][TEXT];
    char gone[GONE_BYTES]; /* what takes away what is shown */
} line;

/* All at once, so that no other process writes in between. */
static void put(const char *text, size_t bytes) {
    for (size_t done = 0; done < bytes;) {
        ssize_t n = write(STDERR_FILENO, text + done, bytes - done);
        if (n < 0 && errno != EINTR)
            return; /* nobody is there to be told */
        done += n > 0 ? (size_t)n : 0;
    }
}

/* Columns to write in: the last one stays free, where some terminals wrap. */
static unsigned columns(void) {
    struct winsize size;
    bool known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col;
    unsigned all = known ? size.ws_col : WIDTH;
    return all < TEXT / 2 ? all - 1 : TEXT / 2;
}

/* What takes so many rows away is there before they are. */
static void show(const char *text, size_t bytes, unsigned rows) {
    if (rows > 1)
        snprintf(line.gone, sizeof line.gone, "\033[%uA\r\033[J", rows - 1);
    else
        snprintf(line.gone, sizeof line.gone, "\r\033[K");
    line.shown = 1;
    put(text, bytes);
}

/* Over what stands there, which flickers less than taking it away. */
static void draw_rows(void) {
    char text[ROWS_MAX * (TEXT + 8)];
    int n = 0, width = (int)columns();
    if (line.shown && line.rows > 1)
        n = snprintf(text, sizeof text, "\033[%uA", line.rows - 1);
    for (unsigned i = 0; i < line.rows; i++) {
        n += snprintf(text + n, sizeof text - (size_t)n, "%s\r%.*s\033[K",
                      i == 0 ? "" : "\n", width, line.row[i]);
    }
    show(text, (size_t)n, line.rows);
}

static void draw(void) {
    char text[TEXT + 16];
    if (line.rows > 0) {
        draw_rows();
        return;
    }
    if (!line.terminal) {
        host_note("%s", line.text);
        return;
    }
    int n =
        snprintf(text, sizeof text, "\r%.*s\033[K", (int)columns(), line.text);
    show(text, (size_t)n, 1);
}

void host_progress_begin(bool wanted) {
    line.terminal = isatty(STDERR_FILENO) != 0;
    line.wanted = wanted && line.terminal;
}

void host_progress_begin_anywhere(void) {
    host_progress_begin(true);
    line.wanted = true;
    line.next_us = host_now_us() + LINE_US;
}

void host_progress_phase(const char *what, const char *unit) {
    line.what = what;
    line.unit = unit;
    line.added = 0;
    line.start_us = host_now_us();
    snprintf(line.text, sizeof line.text, "%s", what);
    if (line.wanted && line.terminal) {
        line.next_us = line.start_us + EVERY_US;
        draw();
    }
}

/* Ends of the line, each shorter than the one before. */
enum { TAILS = 4 };
struct tails {
    char text[TAILS][TEXT / 2];
};

static struct tails tails_of(double part, double amount, double seconds) {
    struct tails t = {0};
    char left[40] = "", rate[40] = "", count[40] = "";
    if (part > 0.0) {
        double s = seconds / part - seconds + 0.999;
        unsigned all = s < 3.6e6 ? (unsigned)s : 3600000;
        snprintf(left, sizeof left, " %u:%02u:%02u left", all / 3600,
                 all / 60 % 60, all % 60);
    }
    if (line.unit != NULL) {
        snprintf(rate, sizeof rate, " %.3g %s/s", 1e-6 * amount / seconds,
                 line.unit);
        snprintf(count, sizeof count, " %.1f %s", 1e-6 * amount, line.unit);
    }
    snprintf(t.text[0], sizeof t.text[0], "%s%s%s", count, rate, left);
    snprintf(t.text[1], sizeof t.text[1], "%s%s", rate, left);
    snprintf(t.text[2], sizeof t.text[2], "%s", part > 0.0 ? left : count);
    return t;
}

static const char hashes[] = "########################################";

/* As much as fits: the phase and the percentage before all, then the time that
 * is left, a bar, the rate and the amount. */
static void compose(double part, bool has_total, struct tails tails) {
    char head[TEXT / 4];
    unsigned width = columns(), tail = 0;
    int n = snprintf(head, sizeof head, "%.32s", line.what);
    if (has_total) {
        n += snprintf(head + n, sizeof head - (size_t)n, " %3d %%",
                      (int)(100.0 * part));
    }
    unsigned used = (unsigned)n, bar = has_total ? BAR_MIN + 3 : 0;
    while (tail + 2 < TAILS && used + bar + strlen(tails.text[tail]) > width)
        tail++;
    while (tail + 1 < TAILS && used + strlen(tails.text[tail]) > width)
        tail++;
    used += (unsigned)strlen(tails.text[tail]);
    if (has_total && line.terminal && used + bar <= width) {
        unsigned room = width - used - 3;
        unsigned cells = room < BAR_MAX ? room : BAR_MAX;
        int full = (int)(part * cells);
        snprintf(line.text, sizeof line.text, "%s [%.*s%*s]%s", head, full,
                 hashes, (int)cells - full, "", tails.text[tail]);
    } else {
        snprintf(line.text, sizeof line.text, "%s%s", head, tails.text[tail]);
    }
}

void host_progress_show(uint64_t done, uint64_t total, uint64_t amount) {
    if (!line.wanted || line.what == NULL)
        return;
    uint64_t now = host_now_us();
    if (now < line.next_us)
        return;
    line.next_us = now + (line.terminal ? EVERY_US : LINE_US);
    double seconds = 1e-6 * (double)(now - line.start_us);
    double part = total == 0 ? 0.0 : (double)done / (double)total;
    part = part < 1.0 ? part : 1.0;
    compose(part, total > 0, tails_of(part, (double)amount, seconds));
    draw();
}

void host_progress_add(uint64_t amount) {
    line.added += amount;
    host_progress_show(0, 0, line.added);
}

unsigned host_progress_rows_max(void) {
    struct winsize size;
    if (!line.wanted || !line.terminal)
        return 0;
    bool known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_row;
    unsigned all = known ? size.ws_row : HEIGHT;
    return all <= 2 ? 1 : all - 2 < ROWS_MAX ? all - 2 : ROWS_MAX;
}

void host_progress_rows(unsigned rows) {
    host_progress_erase();
    line.rows = rows < ROWS_MAX ? rows : ROWS_MAX;
    memset(line.row, 0, sizeof line.row);
    line.next_us = 0;
}

void host_progress_row(unsigned row, const char *head, double part,
                       const char *tail) {
    char bar[BAR_MAX + 16] = "";
    unsigned width = columns();
    if (row >= line.rows)
        return;
    unsigned used = (unsigned)(strlen(head) + strlen(tail)) + 10;
    if (part >= 0.0 && used + BAR_MIN <= width) {
        unsigned cells = width - used < BAR_MAX ? width - used : BAR_MAX;
        int full = (int)((part < 1.0 ? part : 1.0) * cells);
        snprintf(bar, sizeof bar, " [%.*s%*s] %3d %%", full, hashes,
                 (int)cells - full, "", (int)(100.0 * part));
    }
    snprintf(line.row[row], sizeof line.row[row], "%.64s%s %.100s", head, bar,
             tail);
}

void host_progress_draw(void) {
    uint64_t now = host_now_us();
    if (line.wanted && line.terminal && line.rows > 0 && now >= line.next_us) {
        line.next_us = now + EVERY_US;
        draw();
    }
}

void host_progress_erase(void) {
    if (line.shown) {
        line.shown = 0;
        put(line.gone, strlen(line.gone));
    }
}

void host_progress_end(void) {
    host_progress_erase();
    line.wanted = false;
    line.rows = 0;
}

static void (*show_note)(const char *text);

void host_note_to(void (*take)(const char *text)) {
    show_note = take;
}

void host_note(const char *format, ...) {
    char raw[TEXT_MAX], text[TEXT_MAX + 16] = "incode: ";
    size_t head = strlen(text);
    bool again = line.shown != 0;
    va_list list;
    va_start(list, format);
    (void)vsnprintf(raw, sizeof raw, format, list);
    va_end(list);
    host_text_printable(text + head, sizeof text - head - 1, raw);
    if (show_note != NULL) {
        show_note(text + head);
        return;
    }
    strcat(text, "\n");
    host_progress_erase();
    put(text, strlen(text));
    if (again)
        draw();
}
