/* The console's engine: lines, help, completion, folded answers, objects of
 * JSON, over a cube of the simulator. */
#include "shell_world.h"

/* --- lines ---------------------------------------------------------------- */

TEST(what_is_no_command_is_told) {
    begin(2, false);
    assert_int_equal(says(""), 0);
    assert_int_equal(says("   # ping 0"), 0);
    assert_string_equal(desk.said, "");
    assert_int_equal(desk.shell.first, 0);
    assert_int_equal(says("pnig 0"), HOST_USAGE);
    assert_non_null(strstr(desk.failed, "did you mean ping?"));
    assert_int_equal(says("ping"), HOST_USAGE);
    assert_non_null(strstr(desk.failed, "ping SET [TIMES]"));
    assert_int_equal(says("ping 0 1 2"), HOST_USAGE);
    assert_int_equal(says("ping 4"), HOST_USAGE);
    assert_int_equal(says("ping 0 0"), HOST_USAGE);
    assert_int_equal(says("ping 'a"), HOST_USAGE);
    assert_int_equal(says("trace 0 4"), HOST_USAGE);
    assert_int_equal(says("help pong"), HOST_USAGE);
    assert_int_equal(says("abort"), HOST_USAGE);
    assert_int_equal(says("run points.xyz"), HOST_USAGE);
    assert_int_equal(says("\x1b[2J\xff"), HOST_USAGE);
    assert_null(strchr(desk.failed, '\x1b'));
    assert_int_equal(desk.shell.first, HOST_USAGE);
    assert_int_equal(says("exit"), 0);
    assert_true(desk.shell.leaves);
    end();
}

TEST(a_line_may_have_too_many_words) {
    char line[4096] = "ping";
    begin(0, false);
    for (unsigned i = 0; i < 2 * HOST_SHELL_WORDS; i++)
        strcat(line, " 0");
    assert_int_equal(says(line), HOST_USAGE);
    end();
}

TEST(help_has_every_command) {
    const struct host_shell_command *row;
    begin(0, false);
    assert_int_equal(says("help"), 0);
    for (unsigned i = 0; (row = host_shell_command_row(i)) != NULL; i++) {
        assert_non_null(strstr(desk.said, row->help));
        assert_ptr_equal(host_shell_command(row->name), row);
    }
    assert_int_equal(says("help \"top\" # and no more"), 0);
    assert_non_null(strstr(desk.said, "  top [SET]"));
    assert_null(strstr(desk.said, "  ping"));
    assert_false(desk.shell.open); /* it needs no cube */
    end();
}

/* --- completion ----------------------------------------------------------- */

/* What may stand at the end of the line: "a b ". */
static void completes(const char *line, const char *expected, size_t from) {
    char *words[64], all[1024] = "";
    size_t at;
    unsigned count = host_shell_complete(&desk.shell, line, &at, words, 64);
    for (unsigned i = 0; i < count; i++) {
        strcat(all, words[i]);
        strcat(all, " ");
        free(words[i]);
    }
    assert_string_equal(all, expected);
    if (count > 0)
        assert_int_equal(at, from);
}

TEST(words_are_completed) {
    begin(2, false);
    assert_int_equal(host_shell_open(&desk.shell, &desk.shell.error), 0);
    completes("li", "links ", 0);
    completes("  me", "memory ", 2);
    completes("re", "reset ", 0);
    completes("ping ", "all 0 1 2 3 ", 5);
    completes("ping 0-", "0-0 0-1 0-2 0-3 ", 5);
    completes("ping 0,3", "0,3 ", 5);
    completes("ping 0 ", "", 0);
    completes("trace 1 ", "0 1 2 3 ", 8);
    completes("help tr", "trace ", 5);
    completes("wires ", "", 0);
    completes("nothing ", "", 0);
    completes("run /proc/self/statu", "/proc/self/status ", 4);
    completes("run a -o /proc/self/statu", "/proc/self/status ", 9);
    completes("ping 'a ", "", 0);
    end();
}

/* --- folding -------------------------------------------------------------- */

static void fold_line(void *context, const char *text) {
    append(context, text);
}

TEST(equal_rows_are_folded) {
    static char text[SAID];
    struct host_fold fold = {0};
    for (unsigned i = 0; i < 8; i++)
        host_fold_add(&fold, i, i == 5 ? "down" : "up");
    host_fold_add(&fold, CUBE_HOST, "up");
    text[0] = '\0';
    host_fold_print(&fold, "STATE", fold_line, text);
    assert_string_equal(text, "NODES    STATE\n"
                              "0-4,6-7  up\n"
                              "5        down\n"
                              "host     up\n");
    host_fold_free(&fold);
    host_fold_add(&fold, 1, "a\nb");
    host_fold_add(&fold, 3, "a\nb");
    text[0] = '\0';
    host_fold_print(&fold, NULL, fold_line, text);
    assert_string_equal(text, "1,3:\n    a\n    b\n");
    host_fold_free(&fold);
}

TEST(figures_are_short) {
    char text[HOST_SHELL_FIGURE], bar[HOST_SHELL_BAR];
    assert_string_equal(host_shell_bytes(0, text), "0");
    assert_string_equal(host_shell_bytes(999, text), "999");
    assert_string_equal(host_shell_bytes(4 << 20, text), "4.00M");
    assert_string_equal(host_shell_bytes(UINT64_MAX, text), "16.0E");
    assert_string_equal(host_shell_count(12345, text), "12.3k");
    assert_string_equal(host_shell_time(999, text), "999 us");
    assert_string_equal(host_shell_time(1250, text), "1.25 ms");
    assert_string_equal(host_shell_time(2500000, text), "2.50 s");
    assert_string_equal(host_shell_bar(0.5, 4, bar), "[##  ]");
    assert_string_equal(host_shell_bar(0.001, 4, bar), "[#   ]");
    assert_string_equal(host_shell_bar(7.0, 4, bar), "[####]");
    assert_int_equal(strlen(host_shell_bar(0.0, 1000, bar)),
                     HOST_SHELL_BAR - 1);
}

/* --- over a cube ---------------------------------------------------------- */

TEST(nodes_are_asked) {
    begin(3, false);
    assert_int_equal(says("ping all 2"), 0);
    assert_non_null(strstr(desk.said, "2 of 2"));
    assert_int_equal(says("ping 0-3,7"), 0);
    assert_int_equal(says("links"), 0);
    assert_non_null(strstr(desk.said, "up"));
    assert_non_null(strstr(desk.said, "\nhost "));
    assert_int_equal(says("stat 1-2"), 0);
    assert_int_equal(says("memory"), 0);
    assert_non_null(strstr(desk.said, "1-7:\n    1.00M in all"));
    assert_int_equal(says("log 0"), 0);
    assert_int_equal(says("top"), 0);
    assert_non_null(strstr(desk.said, "   7 -"));
    assert_int_equal(says("nodes"), 0);
    assert_int_equal(says("trace 0 7"), 0);
    assert_non_null(strstr(desk.said, "  1  link 0  node 1"));
    assert_non_null(strstr(desk.said, "  3  link 2  node 7"));
    assert_int_equal(says("trace 5 5"), 0);
    assert_int_equal(says("wires"), 0);
    assert_non_null(strstr(desk.said, "6-----------7"));
    assert_string_equal(desk.failed, "");
    assert_int_equal(desk.shell.first, 0);
    end();
}

TEST(answers_are_objects) {
    static const char *const lines[] = {
        "ping 0-1 2", "links",  "stat",      "memory 3", "log",
        "top",        "nodes",  "trace 0 3", "wires",    "help",
        "exit",       "ping 9", "\"",        "nonsense", "\xff"};
    begin(2, true);
    for (unsigned i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        int status = says(lines[i]);
        json_t *answer = object();
        assert_int_equal(json_integer_value(json_object_get(answer, "status")),
                         status);
        assert_true((status != 0) ==
                    (json_object_get(answer, "error") != NULL));
        json_decref(answer);
    }
    assert_int_equal(says("links 1,3"), 0);
    json_t *answer = object();
    json_t *nodes = json_object_get(answer, "nodes");
    assert_int_equal(json_array_size(nodes), 2);
    json_t *node = json_array_get(nodes, 1);
    assert_int_equal(json_integer_value(json_object_get(node, "node")), 3);
    json_t *links = json_object_get(node, "links");
    assert_true(json_array_size(links) >= 2);
    assert_string_equal(
        json_string_value(json_object_get(json_array_get(links, 0), "state")),
        "up");
    json_decref(answer);
    assert_int_equal(says("trace 0 3"), 0);
    answer = object();
    assert_int_equal(json_array_size(json_object_get(answer, "hops")), 2);
    json_decref(answer);
    end();
}

TEST(what_is_dead_is_marked) {
    begin(2, false);
    assert_int_equal(says("wires"), 0);
    deafen(0, 1, true);
    let_pass(4 * DEAD_US);
    assert_int_equal(says("wires"), HOST_CUBE);
    assert_non_null(strstr(desk.said, "node 0 link 1 to node 2: "));
    assert_non_null(strstr(desk.said, "x           |"));
    assert_int_equal(says("ping 0-3 1"), 0);
    assert_int_equal(says("trace 0 2"), 0);
    assert_non_null(strstr(desk.said, "along the tree"));
    assert_non_null(strstr(desk.said, "  3  link "));
    end();
}

TEST(who_is_gone_is_named) {
    begin(2, false);
    assert_int_equal(says("ping all 1"), 0);
    host_world_kill(&desk.world, 3);
    let_pass(4 * DEAD_US);
    assert_int_equal(says("stat"), HOST_CUBE);
    assert_non_null(strstr(desk.failed, "node 3: stat: "));
    assert_non_null(strstr(desk.said, "\n3 "));
    assert_int_equal(says("ping 1-3 1"), HOST_CUBE);
    assert_int_equal(says("ping 0-2 1"), 0);
    assert_int_equal(says("wires"), HOST_CUBE);
    assert_non_null(strstr(desk.said, "(3)"));
    assert_int_equal(says("reset 3"), HOST_CUBE);
    assert_int_equal(desk.pulses, 0);
    assert_int_equal(desk.shell.first, HOST_CUBE);
    end();
}

TEST(nodes_that_begin_anew_are_noted) {
    begin(2, false);
    assert_int_equal(says("ping all 1"), 0);
    let_pass(1000000);
    assert_string_equal(desk.noted, "");
    host_world_crash(&desk.world, 2, 100000, false);
    let_pass(6000000);
    assert_non_null(strstr(desk.noted, "node 2: begun anew"));
    desk.noted[0] = '\0';
    let_pass(6000000);
    assert_string_equal(desk.noted, "");
    assert_int_equal(says("ping 2 1"), 0);
    end();
}

TEST(nodes_are_reset) {
    begin(2, false);
    assert_int_equal(says("reset 1-2"), 0);
    assert_non_null(strstr(desk.said, "1-2  begun anew"));
    assert_int_equal(desk.world.node[1].starts, 2);
    assert_int_equal(desk.world.node[3].starts, 1);
    assert_int_equal(desk.pulses, 0);
    assert_string_equal(desk.noted, ""); /* it was asked for */
    host_world_pause(&desk.world, 3, UINT64_MAX / 8);
    desk.lined = 1u << 3;
    let_pass(4 * DEAD_US);
    assert_int_equal(says("reset 3"), 0);
    assert_int_equal(desk.pulses, 1);
    end();
}

TEST(a_person_may_interrupt) {
    begin(2, false);
    assert_int_equal(says("ping all 1"), 0);
    desk.interrupt = true;
    assert_int_equal(says("ping all 1000"), HOST_CUBE);
    assert_non_null(strstr(desk.failed, "interrupted"));
    desk.interrupt = false;
    assert_int_equal(says("ping all 1"), 0); /* the cube is still there */
    end();
}

static bool take_picture(void *context, const char *text) {
    (void)context;
    if (text == NULL)
        return false;
    assert_non_null(strstr(text, "MEMORY"));
    return ++desk.pictures < desk.enough;
}

TEST(top_goes_on_until_it_is_enough) {
    begin(2, false);
    desk.sink.picture = take_picture;
    desk.enough = 5;
    assert_int_equal(says("top"), 0);
    assert_int_equal(desk.pictures, 5);
    assert_true(desk.world.now_us > 4000000);
    end();
}

TEST(bytes_that_are_no_frame_are_shown) {
    char text[5 * HOST_WATCH_BYTES];
    struct host_watch watch = {.used = 0};
    begin(0, false);
    assert_int_equal(host_shell_open(&desk.shell, &desk.shell.error), 0);
    memcpy(watch.last, "Hi\r\n\x1b\\", 6);
    watch.used = 6;
    host_watch_noise(&watch, text, sizeof text);
    assert_string_equal(text, "Hi\\r\\n\\x1b\\x5c");
    end();
}
