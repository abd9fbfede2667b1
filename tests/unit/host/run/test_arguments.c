/* What `incode run` takes, and what it refuses with a reason. */
#include <sys/wait.h>
#include <unistd.h>

#include "host/mesh/points.h"
#include "host/run/arguments.h"
#include "host/service/strategies/strategies.h"
#include "tests/unit/test.h"

enum { WORDS_MAX = 13 };

/* Parses "incode run" with these words, ended by NULL. */
static int parse(const char *const *words, struct host_run_options *options,
                 struct host_error *error) {
    char text[WORDS_MAX + 2][64] = {"incode run"};
    char *argv[WORDS_MAX + 2] = {text[0]};
    int argc = 1;
    memset(error, 0, sizeof *error);
    for (; words[argc - 1] != NULL; argc++) {
        assert_true(argc <= WORDS_MAX);
        strcpy(text[argc], words[argc - 1]);
        argv[argc] = text[argc];
    }
    return host_arguments_run(argc, argv, options, error);
}

TEST(test_defaults) {
    struct host_run_options o;
    struct host_error error;
    static const char *const words[] = {"a.xyz", NULL};
    assert_int_equal(parse(words, &o, &error), 0);
    assert_null(o.strategy); /* auto */
    assert_int_equal(o.partition, HOST_ADAPTIVE);
    assert_int_equal(o.index, INCODE_KD);
    assert_int_equal(o.face_rule, INCODE_FACE_OWN);
    assert_int_equal(o.build, INCODE_BUILD_AUTO);
    assert_int_equal(o.memory, 4194304);
    assert_int_equal(o.nodes, 0);
    assert_int_equal(o.outputs, 0);
    assert_int_equal(o.verifying, HOST_VERIFY_WHERE_DUE);
    assert_false(o.quiet || o.table || o.map || o.explain || o.anywhere);
    assert_true(o.progress);
    assert_true(o.direct);
    assert_int_equal(o.threads, 0);
}

TEST(test_direct) {
    struct host_run_options o;
    struct host_error error;
    static const char *const threads[] = {"a.xyz",   "--threads=3", "--verify",
                                          "--stats", "b.json",      NULL};
    assert_int_equal(parse(threads, &o, &error), 0);
    assert_true(o.direct);
    assert_int_equal(o.threads, 3);
    static const char *const cube[] = {"--strategy=auto", "--nodes=2",
                                       "--memory=4M",     "--patience=9",
                                       "--explain",       "--map"};
    for (size_t i = 0; i < sizeof cube / sizeof cube[0]; i++) {
        const char *const alone[] = {"a.xyz", cube[i], NULL};
        assert_int_equal(parse(alone, &o, &error), 0);
        assert_false(o.direct);
        const char *const both[] = {"a.xyz", cube[i], "--threads=2", NULL};
        assert_int_equal(parse(both, &o, &error), HOST_USAGE);
    }
}

TEST(test_options) {
    struct host_run_options o;
    struct host_error error;
    static const char *const words[] = {"--strategy=spatial",
                                        "--partition=uniform",
                                        "--index=grid",
                                        "--face-rule=paper",
                                        "--build=points",
                                        "--nodes=8",
                                        "--memory=512K",
                                        "--window=1",
                                        "--verify",
                                        "--patience=7",
                                        "a.xyz",
                                        NULL};
    assert_int_equal(parse(words, &o, &error), 0);
    assert_ptr_equal(o.strategy, &host_spatial);
    assert_int_equal(o.partition, HOST_UNIFORM);
    assert_int_equal(o.index, INCODE_GRID);
    assert_int_equal(o.face_rule, INCODE_FACE_PAPER);
    assert_int_equal(o.build, INCODE_BUILD_POINTS);
    assert_int_equal(o.nodes, 8);
    assert_int_equal(o.memory, 524288);
    assert_int_equal(o.window, 1);
    assert_int_equal(o.verifying, HOST_VERIFY_ALWAYS);
    assert_int_equal(o.patience_s, 7);
}

/* The Linda programs, and what they heed, in any order. */
TEST(test_linda) {
    static const char *const words[][4] = {
        {"a.xyz", "--strategy=linda", "--faces-per-job=7", NULL},
        {"a.xyz", "--linda=master-slaves", "--strategy=linda", NULL},
        {"a.xyz", "--linda=spatial", "--strategy=linda", NULL}};
    static const char *const names[] = {"linda", "linda", "linda-spatial"};
    for (size_t i = 0; i < 3; i++) {
        struct host_run_options o;
        struct host_error error;
        assert_int_equal(parse(words[i], &o, &error), 0);
        assert_string_equal(o.strategy->name, names[i]);
        assert_int_equal(o.sharing.faces_per_job, i == 0 ? 7 : 0);
    }
}

/* Exit status 2, and the message says what is allowed. */
TEST(test_refused) {
    static const struct {
        const char *word, *said;
    } wrong[] = {
        {"--linda=two", "no such name; allowed: master-slaves, spatial"},
        {"--linda=spatial", "goes with --strategy linda alone"},
        {"--strategy=quick", "no such name"},
        {"--partition=odd", "adaptive, uniform"},
        {"--index=tree", "naive, grid, kd"},
        {"--face-rule=all", "own, paper"},
        {"--build=stars", "auto, faces, points"},
        {"--order=sorted", "canonical, as-made"},
        {"--link=wet-string", "no such name; allowed: tcp, "},
        {"--link=a-name-longer-than-any-other-name-that-there-is",
         "no such name; allowed: tcp"},
        {"--board=mps2", "no such name; "},
        {"--board-kill=100", "--board-kill: no such option of "},
        {"--cluster=1", "2 to 1024"},
        {"--cluster=4", "--cluster: goes with"},
        {"--builders=0", "1 to 1023"},
        {"--builders=4", "--builders: goes with"},
        {"--faces-per-job=97", "1 to 96"},
        {"--faces-per-job=9", "--faces-per-job: goes with"},
        {"--jobs-per-worker=17", "1 to 16"},
        {"--jobs-per-worker=2", "--jobs-per-worker: goes with"},
        {"--strategy=spatail", "did you mean spatial? allowed: "},
        {"--nodes=3", "not a power of two, as a cube has nodes; allowed: 1, 2, "
                      "4, 8, 16, 32, 64"},
        {"--nodes=128", "1, 2, 4, 8, 16, 32, 64, or with --cube "},
        {"--verfy",
         "--verfy: no such option of incode run; did you mean --verify?"},
        {"b.xyz", "b.xyz: a second file of points after a.xyz; give one"},
        {"--memory=1K", "640K to 1G"},
        {"--window=0", "1 to 64"}};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        const char *const words[] = {"a.xyz", wrong[i].word, NULL};
        struct host_run_options o;
        struct host_error error;
        assert_int_equal(parse(words, &o, &error), HOST_USAGE);
        assert_non_null(strstr(error.text, wrong[i].said));
    }
}

/* What would change nothing is refused, and what goes with it is not. */
TEST(test_in_vain) {
    static const struct {
        const char *vain, *beside, *with;
    } cases[] = {{"--memory=1M", "--cube=lab.cube", "--nodes=2"},
                 {"--link=tcp", "--cube=lab.cube", "--nodes=2"},
                 {"--link=mpi", "--cube=lab.cube", "--nodes=2"},
                 {"--board=linux", "--cube=lab.cube", "--nodes=2"},
                 {"--window=4", "--cube=lab.cube", "--nodes=2"},
                 {"--node-program=node", "--link=mpi", "--cube=lab.cube"},
                 {"--progress", "-q", "--nodes=2"},
                 {"--explain", "-q", "--nodes=2"},
                 {"--explain", "--strategy=spatial", "--strategy=auto"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct host_run_options o;
        struct host_error error;
        const char *words[] = {"a.xyz", cases[i].vain, cases[i].beside, NULL};
        size_t name = strcspn(cases[i].vain, "=");
        assert_int_equal(parse(words, &o, &error), HOST_USAGE);
        assert_memory_equal(error.text, cases[i].vain, name);
        assert_non_null(strstr(error.text, "; leave it out"));
        words[2] = cases[i].with;
        assert_int_equal(parse(words, &o, &error), 0);
    }
}

/* Each value of an enumeration has a name, which the options know it by. */
TEST(test_names) {
    const struct {
        const char *option;
        const char *const *names;
        int last;
    } tables[] = {{"--partition", host_partitions, HOST_UNIFORM},
                  {"--index", host_indexes, INCODE_KD},
                  {"--face-rule", host_face_rules, INCODE_FACE_PAPER},
                  {"--build", host_builds, INCODE_BUILD_POINTS}};
    for (size_t i = 0; i < sizeof tables / sizeof tables[0]; i++) {
        for (int value = 0; value <= tables[i].last; value++) {
            struct host_run_options o;
            struct host_error error;
            const char *words[] = {tables[i].option, tables[i].names[value],
                                   "a.xyz", NULL};
            assert_non_null(words[1]);
            assert_int_equal(parse(words, &o, &error), 0);
            const int found[] = {(int)o.partition, (int)o.index,
                                 (int)o.face_rule, (int)o.build};
            assert_int_equal(found[i], value);
        }
        assert_null(tables[i].names[tables[i].last + 1]);
    }
}

/* Every row of the tables of links and boards is known by its name, and an
 * error about any other lists it. */
TEST(test_rows) {
    struct host_run_options o;
    struct host_error error, refusal;
    const char *words[] = {"--link", "wet-string", "a.xyz", NULL};
    assert_int_equal(parse(words, &o, &refusal), HOST_USAGE);
    for (unsigned i = 0; host_link_name(i) != NULL; i++) {
        words[1] = host_link_name(i);
        assert_int_equal(parse(words, &o, &error), 0);
        assert_ptr_equal(o.link, host_link_row(i));
        assert_ptr_equal(o.link, host_link_named(words[1]));
        assert_non_null(strstr(refusal.text, words[1]));
    }
    words[0] = "--board";
    words[1] = "z80";
    assert_int_equal(parse(words, &o, &refusal), HOST_USAGE);
    for (unsigned i = 0; host_board_name(i) != NULL; i++) {
        words[1] = host_board_name(i);
        assert_int_equal(parse(words, &o, &error), 0);
        assert_ptr_equal(o.board, host_board_row(i));
        assert_non_null(strstr(refusal.text, words[1]));
    }
    /* A part of one, or two of them, is none. */
    static const char *const parts[] = {"", "mps2", "an500,mps2", "500"};
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++) {
        words[1] = parts[i];
        assert_int_equal(parse(words, &o, &error), HOST_USAGE);
        assert_non_null(strstr(error.text, "no such name"));
    }
}

/* Options that a program adds, which make a cube of the run. */
TEST(test_added) {
    static const struct host_option rows[] = {
        {"host-rate", 0, "BYTES", "",
         HOST_AT(struct host_run_options, throttle.bytes_a_second), .least = 1,
         .most = 9999},
        {0}};
    static const char *const words[] = {"a.xyz", "--host-rate=1024", NULL};
    static const char *const none[] = {"a.xyz", NULL};
    struct host_run_options o;
    struct host_error error;
    assert_int_equal(parse(words, &o, &error), HOST_USAGE);
    host_arguments_add(rows);
    assert_int_equal(parse(words, &o, &error), 0);
    assert_int_equal(o.throttle.bytes_a_second, 1024);
    assert_int_equal(o.throttle.slow_us, 30000000);
    assert_false(o.direct);
    assert_int_equal(parse(none, &o, &error), 0);
    assert_true(o.direct);
    host_arguments_add(NULL);
}

/* What a bare board has settles what else may be asked for. */
TEST(test_bare_boards) {
    static const struct {
        const char *words[4], *said;
    } wrong[] = {
        {{"--nodes=32", "--board=mps2-an500"}, "give 16 or fewer"},
        {{"--nodes=4", "--board=raspi3b"}, "a cube of 2; give 2 or fewer"},
        {{"--memory=8M", "--board=mps2-an385"}, "mps2-an385 has 4M"},
        {{"--link=tcp", "--board=mps2-an385"}, "--link: "},
        {{"--link=mpi", "--board=mps2-an385"}, "--link: "},
        {{"--window=4", "--board=mps2-an385"}, "--window: "},
        {{"--node-program=x", "--board=raspi3b"}, "--node-program: "}};
    static const char *const right[] = {"a.xyz", "--board=mps2-an500",
                                        "--nodes=16", "--memory=4M", NULL};
    struct host_run_options o;
    struct host_error error;
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        const char *words[] = {"a.xyz", wrong[i].words[0], wrong[i].words[1],
                               NULL};
        assert_int_equal(parse(words, &o, &error), HOST_USAGE);
        assert_non_null(strstr(error.text, wrong[i].said));
    }
    assert_int_equal(parse(right, &o, &error), 0);
    assert_string_equal(o.link->name, "uart");
    assert_int_equal(o.nodes, 16);
}

/* What `incode run` prints with this word, blanks squeezed. */
static void printed(const char *word, char *text, size_t size) {
    size_t used = 0;
    int ends[2];
    char c;
    assert_int_equal(pipe(ends), 0);
    fflush(NULL);
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        const char *const words[] = {word, NULL};
        struct host_run_options o;
        struct host_error error;
        dup2(ends[1], STDOUT_FILENO);
        (void)parse(words, &o, &error); /* ends the process */
        _exit(1);
    }
    close(ends[1]);
    while (read(ends[0], &c, 1) == 1 && used + 1 < size) {
        bool blank = c == ' ' || c == '\n';
        if (!blank || used == 0 || text[used - 1] != ' ')
            text[used++] = blank ? ' ' : c;
    }
    text[used] = '\0';
    close(ends[0]);
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_int_equal(status, 0);
}

/* The strategies of the table, and auto, are those that the option takes, its
 * help explains, and the error about any other lists. */
TEST(test_strategies) {
    static char help[16384];
    struct host_run_options o;
    struct host_error refusal, error;
    const char *words[] = {"--strategy", "quick", "a.xyz", NULL};
    printed("--help", help, sizeof help);
    assert_int_equal(parse(words, &o, &refusal), HOST_USAGE);
    unsigned i = 0;
    for (; host_strategy_name(i) != NULL; i++) {
        char line[128];
        words[1] = host_strategy_name(i);
        assert_int_equal(parse(words, &o, &error), 0);
        assert_ptr_equal(o.strategy, host_strategy_row(i));
        assert_non_null(strstr(refusal.text, words[1]));
        snprintf(line, sizeof line, "%s (%s", words[1], host_strategy_help(i));
        assert_non_null(strstr(help, line));
    }
    assert_true(i >= 3);
    assert_string_equal(host_strategy_name(i - 1), "auto");
}
