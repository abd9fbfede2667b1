/* The line of progress on terminals of several widths: it stays one line, goes
 * away at the end, and what is noted meanwhile stands by itself. */

#include "tests/unit/test.h"
#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <stdbool.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "host/base/progress.h"

enum { ROWS = 8, COLUMNS = 200 };

/* What stands on a terminal, as far as this program writes to one. */
static struct screen {
    int master, slave, before; /* before: standard error */
    unsigned columns, row, column;
    char text[ROWS][COLUMNS + 1];
    bool wrapped;
    unsigned drawn; /* times that a line began anew */
} screen;

static void open_screen(unsigned short columns) {
    struct winsize size = {.ws_row = ROWS, .ws_col = columns};
    memset(&screen, 0, sizeof screen);
    screen.columns = columns;
    assert_int_equal(openpty(&screen.master, &screen.slave, NULL, NULL, &size),
                     0);
    screen.before = dup(STDERR_FILENO);
    assert_true(dup2(screen.slave, STDERR_FILENO) >= 0);
}

static void close_screen(void) {
    assert_true(dup2(screen.before, STDERR_FILENO) >= 0);
    (void)close(screen.before);
    (void)close(screen.slave);
    (void)close(screen.master);
}

static void erase(char *row, unsigned from) {
    memset(row + from, 0, COLUMNS - from);
}

static void take(char c) {
    char *row = screen.text[screen.row];
    if (c == '\r') {
        screen.column = 0;
        screen.drawn++;
    } else if (c == '\n') {
        assert_true(++screen.row < ROWS);
    } else {
        /* The last column is left free: some terminals wrap there. */
        screen.wrapped = screen.wrapped || screen.column + 1 >= screen.columns;
        assert_true(screen.column < COLUMNS);
        row[screen.column++] = c;
    }
}

/* Rows up; from here to the row's end; and to the screen's. */
static void obey(char what, unsigned number) {
    if (what == 'A') {
        assert_true(number > 0 && number <= screen.row);
        screen.row -= number;
    } else if (what == 'K' || what == 'J') {
        erase(screen.text[screen.row], screen.column);
        for (unsigned i = screen.row + 1; what == 'J' && i < ROWS; i++)
            erase(screen.text[i], 0);
    } else {
        fail();
    }
}

/* Takes what has come.  A terminal delivers in its own time: a bell of ours
 * rings when all before it is here.  clock: within a minute. */
static void look(void) {
    static unsigned in, number;
    assert_int_equal(write(screen.slave, "\a", 1), 1);
    for (char c = 0; c != '\a';) {
        struct pollfd file = {screen.master, POLLIN, 0};
        assert_true(poll(&file, 1, 60000) > 0);
        assert_int_equal(read(screen.master, &c, 1), 1);
        if (c == '\033') {
            in = 1;
            number = 0;
        } else if (in == 1) {
            assert_int_equal(c, '[');
            in = 2;
        } else if (in == 2 && c >= '0' && c <= '9') {
            number = 10 * number + (unsigned)(c - '0');
        } else if (in == 2) {
            obey(c, number);
            in = 0;
        } else if (c != '\a') {
            take(c);
        }
    }
}

/* Shows until a line is drawn, which takes a tenth of a second.  clock: or no
 * more than minutes. */
static const char *shown(uint64_t done, uint64_t total, uint64_t amount) {
    look();
    unsigned before = screen.drawn;
    for (int i = 0; i < 6000 && screen.drawn == before; i++) {
        host_progress_show(done, total, amount);
        (void)poll(NULL, 0, 10); /* clock: a line comes every three seconds */
        look();
    }
    assert_true(screen.drawn > before);
    return screen.text[screen.row];
}

TEST(test_fits) {
    static const unsigned short widths[] = {30, 12, 5, 80, 160};
    for (size_t i = 0; i < sizeof widths / sizeof widths[0]; i++) {
        open_screen(widths[i]);
        host_progress_begin(true);
        host_progress_phase("triangulating", "Mtet");
        look();
        assert_true(screen.text[0][0] == 't'); /* at once */
        const char *text =
            shown(UINT32_MAX / 2, UINT32_MAX, UINT64_C(123456789012));
        assert_memory_equal(text, "tria", 4);
        if (widths[i] >= 30) {
            assert_non_null(strstr(text, "triangulating  49 %"));
            assert_non_null(strstr(text, "[###"));
        }
        if (widths[i] >= 80) {
            assert_non_null(strstr(text, " Mtet/s"));
            assert_non_null(strstr(text, " left"));
        }
        assert_int_equal(screen.row, 0);
        assert_false(screen.wrapped);
        host_progress_end();
        look();
        assert_string_equal(screen.text[0], "");
        host_progress_phase("writing", "MB");
        host_progress_show(1, 2, 3);
        look();
        assert_string_equal(screen.text[0], "");
        close_screen();
    }
}

TEST(test_follows_the_width) {
    struct winsize narrow = {.ws_row = ROWS, .ws_col = 30};
    open_screen(100);
    host_progress_begin(true);
    host_progress_phase("triangulating", "Mtet");
    assert_non_null(strstr(shown(1, 2, 5000000), "5.0 Mtet "));
    assert_int_equal(ioctl(screen.slave, TIOCSWINSZ, &narrow), 0);
    screen.columns = 30;
    assert_null(strstr(shown(1, 2, 5000000), "Mtet"));
    assert_false(screen.wrapped);
    host_progress_end();
    close_screen();
}

/* Of what has no total, the amount is shown. */
TEST(test_counts) {
    open_screen(30);
    host_progress_begin(true);
    host_progress_phase("writing", "MB");
    host_progress_add(12000000);
    host_progress_add(34000000);
    assert_non_null(strstr(shown(0, 0, 46000000), "writing 46.0 MB"));
    assert_false(screen.wrapped);
    host_progress_end();
    close_screen();
}

TEST(test_notes) {
    open_screen(80);
    host_note("node %u: %s", 1, "before");
    host_progress_begin(true);
    host_progress_phase("triangulating", "Mtet");
    (void)shown(1, 4, 1);
    host_note("node %u: %s", 3, "it does \033[2Jnot answer");
    look();
    assert_string_equal(screen.text[0], "incode: node 1: before");
    assert_string_equal(screen.text[1],
                        "incode: node 3: it does \\x1b[2Jnot answer");
    assert_memory_equal(screen.text[2], "triangulating  25 %", 19);
    host_progress_end();
    look();
    assert_string_equal(screen.text[2], "");
    close_screen();
}

/* clock: likewise */
static void draw_rows(double part) {
    look();
    for (unsigned before = screen.drawn, i = 0;
         i < 6000 && screen.drawn == before; i++) {
        host_progress_row(0, "node 0", part, "takes blocks");
        host_progress_row(1, "node 1", -1.0, "is not there");
        host_progress_draw();
        (void)poll(NULL, 0, 10);
        look();
    }
}

/* A table stays where it is, makes room for notes, and goes away whole. */
TEST(test_rows) {
    open_screen(60);
    assert_int_equal(host_progress_rows_max(), 0);
    host_progress_begin(true);
    assert_int_equal(host_progress_rows_max(), ROWS - 2);
    host_progress_rows(2);
    draw_rows(0.25);
    draw_rows(0.5);
    assert_non_null(strstr(screen.text[0], "node 0 [####"));
    assert_non_null(strstr(screen.text[0], " 50 % takes blocks"));
    assert_string_equal(screen.text[1], "node 1 is not there");
    host_note("node %u: %s", 1, "is waited for");
    look();
    assert_string_equal(screen.text[0], "incode: node 1: is waited for");
    assert_memory_equal(screen.text[1], "node 0 [", 8);
    assert_string_equal(screen.text[2], "node 1 is not there");
    assert_false(screen.wrapped);
    host_progress_end();
    look();
    assert_string_equal(screen.text[1], "");
    assert_string_equal(screen.text[2], "");
    assert_int_equal(screen.row, 1);
    close_screen();
}

/* No line where it is not wanted, nor where nobody sees it; notes come. */
TEST(test_quiet) {
    int ends[2];
    char said[64] = "";
    open_screen(80);
    host_progress_begin(false);
    host_progress_phase("triangulating", "Mtet");
    host_progress_end();
    look();
    assert_int_equal(screen.drawn, 0);
    assert_int_equal(pipe(ends), 0);
    assert_true(dup2(ends[1], STDERR_FILENO) >= 0);
    host_progress_begin(true);
    host_progress_phase("triangulating", "Mtet");
    host_note("node %u", 1);
    host_progress_end();
    (void)close(ends[1]);
    close_screen();
    assert_true(read(ends[0], said, sizeof said - 1) > 0);
    assert_string_equal(said, "incode: node 1\n");
    (void)close(ends[0]);
}

/* Without a terminal, where that is asked for: whole lines, and few. */
TEST(test_lines) {
    int ends[2], before = dup(STDERR_FILENO);
    char said[256] = "";
    struct pollfd file;
    unsigned shown = 0;
    assert_int_equal(pipe(ends), 0);
    assert_true(dup2(ends[1], STDERR_FILENO) >= 0);
    file = (struct pollfd){ends[0], POLLIN, 0};
    host_progress_begin_anywhere();
    host_progress_phase("reading", "MB");
    assert_int_equal(host_progress_rows_max(), 0);
    for (; shown < 60000 && poll(&file, 1, 0) == 0; shown++) {
        if (shown % 8 == 0)
            host_progress_phase("triangulating", "Mtet");
        (void)poll(NULL, 0, 10); /* clock: a line comes every three seconds */
        host_progress_show(1, 4, 2000000);
    }
    host_progress_show(2, 4, 2000000); /* too soon */
    host_progress_end();
    assert_true(dup2(before, STDERR_FILENO) >= 0);
    (void)close(before);
    (void)close(ends[1]);
    assert_true(shown > 10);
    assert_true(read(ends[0], said, sizeof said - 1) > 0);
    static const char begins[] = "incode: triangulating  25 % 2.0 Mtet ";
    assert_memory_equal(said, begins, sizeof begins - 1);
    assert_null(strpbrk(said, "\r\033[#"));
    assert_string_equal(strchr(said, '\n'), "\n"); /* and no more */
    (void)close(ends[0]);
}
