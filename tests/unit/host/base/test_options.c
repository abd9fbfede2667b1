/* The arguments of a command: what is wrong with them, and what was meant. */

#include "host/base/options.h"
#include "tests/unit/test.h"

enum { WORDS_MAX = 6 };

struct seen {
    unsigned quiet, words, dry, colour, count;
    const char *seed, *sieve;
    uint64_t window, given;
    bool windows;
};

static void take_dry(void *into, const char *value, struct host_error *error) {
    (void)error;
    ((struct seen *)into)->dry += strcmp(value, "none") == 0 ? 1 : 10;
}

static void take_quiet(void *into, const char *value,
                       struct host_error *error) {
    (void)error;
    assert_null(value);
    ((struct seen *)into)->quiet++;
}

static void take_word(void *into, const char *value, struct host_error *error) {
    (void)value;
    (void)error;
    ((struct seen *)into)->words++;
}

static const char *colour(unsigned i) {
    static const char *const names[] = {"red", "green", NULL};
    return names[i];
}

static const struct host_option rows[] = {
    {.help = "A group:"},
    {"seed", 's', "S", "a value", HOST_AT(struct seen, seed)},
    {"sieve", 0, "S", "another, which begins alike",
     HOST_AT(struct seen, sieve)},
    {"window", 0, "N", "no letter", HOST_AT(struct seen, window), .least = 1,
     .most = 64, .unit = 1000},
    {"windows", 0, NULL, "begins like another", HOST_AT(struct seen, windows)},
    {.help = "Another:"},
    {"colour", 0, "NAME", "of a list", HOST_AT(struct seen, colour),
     .names = colour},
    {"count", 0, "N", "no more than fits", HOST_AT(struct seen, count),
     .most = 9},
    {"dry", 'd', "D", "a value, or none", .omitted = "none", .take = take_dry},
    {"quiet", 'q', NULL, "no value, and the last letter", .take = take_quiet},
    {0}};
static const struct host_options options = {
    .rows = rows, .argument = take_word, .arguments = "", .about = ""};

static int parse(const char *const words[], struct seen *seen,
                 struct host_error *error) {
    static char text[WORDS_MAX + 2][40] = {"incode try"};
    char *argv[WORDS_MAX + 2] = {text[0]};
    int argc = 1;
    memset(seen, 0, sizeof *seen);
    memset(error, 0, sizeof *error);
    for (; words[argc - 1] != NULL; argc++) {
        snprintf(text[argc], sizeof text[argc], "%s", words[argc - 1]);
        argv[argc] = text[argc];
    }
    return host_options_parse(&options, argc, argv, true, seen, &seen->given,
                              error);
}

TEST(test_taken) {
    struct seen seen;
    struct host_error error;
    static const char *const words[] = {"a",        "-qs4", "b",
                                        "--window", "9",    NULL};
    static const char *const dashes[] = {"--see=1", "-q", "--", "-x", NULL};
    assert_int_equal(parse(words, &seen, &error), 0);
    assert_int_equal(seen.words, 2);
    assert_int_equal(seen.quiet, 1);
    assert_string_equal(seen.seed, "4");
    assert_int_equal(seen.window, 9000);
    assert_true(host_option_given(rows, seen.given, "window"));
    assert_false(host_option_given(rows, seen.given, "windows"));
    assert_int_equal(parse(dashes, &seen, &error), 0);
    assert_int_equal(seen.words, 1);
}

/* Its value is in the same word; the next one is for itself. */
TEST(test_optional) {
    struct seen seen;
    struct host_error error;
    static const char *const words[] = {"--dry", "--seed=5", "-d",
                                        "-d7",   "-d",       NULL};
    static const char *const next[] = {"--dry", "--seed", NULL};
    assert_int_equal(parse(words, &seen, &error), 0);
    assert_int_equal(seen.dry, 13);
    assert_string_equal(seen.seed, "5");
    assert_int_equal(parse(next, &seen, &error), HOST_USAGE);
    assert_non_null(strstr(error.text, "--seed: wants a value; "));
}

TEST(test_refused) {
    static const struct {
        const char *word, *said;
    } wrong[] = {
        {"--sede=4", "--sede: no such option of incode try; did you mean "
                     "--seed?"},
        {"--hlep", "did you mean --help?"},
        {"--zzzzzzzz", "--zzzzzzzz: no such option of incode try; see incode "
                       "try --help"},
        {"--s=4", "--s: more than one option of incode try; write --seed or "
                  "--sieve"},
        {"--win=4", "--win: more than one option of incode try; write --window "
                    "or --windows"},
        {"--quiet=yes", "--quiet=yes: an option of incode try that takes no "
                        "value; write --quiet"},
        {"--seed", "--seed: wants a value; "},
        {"-s", "-s: wants a value; "},
        {"-x", "-x: no such option of incode try; see incode try --help"},
        {"-qx", "-x: no such option"},
        {"-seeds", ""}, /* -s with a value */
        {"-windwo", "-windwo: no such option of incode try; did you mean "
                    "--window?"},
        {"-\x1b", "-\\x1b: no such option"},
        {"--\x1b", "--\\x1b: no such option"}};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        const char *const words[] = {"a", wrong[i].word, NULL};
        struct seen seen;
        struct host_error error;
        int status = parse(words, &seen, &error);
        assert_int_equal(status, wrong[i].said[0] == '\0' ? 0 : HOST_USAGE);
        assert_non_null(strstr(error.text, wrong[i].said));
    }
}

TEST(test_numbers) {
    uint64_t number = 7;
    struct host_error error = {0};
    assert_int_equal(
        host_option_number("baud", "300", 300, 1000, &number, &error), 0);
    assert_int_equal(number, 300);
    assert_int_equal(
        host_option_number("baud", "2k", 300, 1000, &number, &error),
        HOST_USAGE);
    assert_int_equal(number, 300);
    assert_string_equal(error.text, "--baud 2k: not a number that is allowed; "
                                    "give 300 to 1000");
    error.code = 0;
    assert_int_equal(
        host_option_number("seed", "-1", 1, UINT64_MAX, &number, &error),
        HOST_USAGE);
    assert_string_equal(error.text, "--seed -1: not a number; give 1 or more");
}

/* Rows before a command's own go to a struct in its struct. */
struct outer {
    const char *image, *version;
    bool deep;
    struct seen inner;
};

static const struct host_option outer_rows[] = {
    {"deep", 0, NULL, "of the outer", HOST_AT(struct outer, deep)},
    {"version", 0, "TEXT", "its own", HOST_AT(struct outer, version)},
    {0}};

static int parse_outer(const char *first, const char *second,
                       struct outer *outer, struct host_error *error) {
    static const struct host_options outer_options = {
        .rows = outer_rows,
        .more = rows,
        .more_at = offsetof(struct outer, inner),
        .one = "IMAGE",
        .one_at = offsetof(struct outer, image),
        .needed = true,
        .arguments = "",
        .about = ""};
    static char text[3][20] = {"incode try"};
    char *argv[] = {text[0], text[1], text[2], NULL};
    int argc = first == NULL ? 1 : second == NULL ? 2 : 3;
    memset(error, 0, sizeof *error);
    memset(outer, 0, sizeof *outer);
    snprintf(text[1], sizeof text[1], "%s", argc > 1 ? first : "");
    snprintf(text[2], sizeof text[2], "%s", argc > 2 ? second : "");
    argv[argc] = NULL;
    return host_options_parse(&outer_options, argc, argv, true, outer, NULL,
                              error);
}

TEST(test_the_one_argument) {
    struct outer outer;
    struct host_error error;
    assert_int_equal(parse_outer(NULL, NULL, &outer, &error), HOST_USAGE);
    assert_non_null(strstr(error.text, "IMAGE: not given; "));
    assert_int_equal(parse_outer("a", NULL, &outer, &error), 0);
    assert_int_equal(parse_outer("a", "b", &outer, &error), HOST_USAGE);
    assert_string_equal(error.text,
                        "b: one argument too many; give IMAGE alone");
}

TEST(test_rows_of_another_struct) {
    struct outer outer;
    struct host_error error;
    assert_int_equal(parse_outer("--window=3", "a", &outer, &error), 0);
    assert_int_equal(outer.inner.window, 3000);
    assert_false(outer.deep);
    assert_int_equal(parse_outer("--deep", "a", &outer, &error), 0);
    assert_true(outer.deep);
    assert_false(outer.inner.windows);
    assert_int_equal(parse_outer("--version=2", "a", &outer, &error), 0);
    assert_string_equal(outer.version, "2");
}

TEST(test_values) {
    struct seen seen;
    struct host_error error;
    static const char *const good[] = {"--colour=green", "--count=9",
                                       "--windows", NULL};
    static const char *const much[] = {"--count=10", NULL};
    static const char *const blue[] = {"--colour", "gren", NULL};
    assert_int_equal(parse(good, &seen, &error), 0);
    assert_int_equal(seen.colour, 1);
    assert_int_equal(seen.count, 9);
    assert_true(seen.windows);
    assert_int_equal(parse(much, &seen, &error), HOST_USAGE);
    assert_string_equal(error.text, "--count 10: not a number that is allowed; "
                                    "give 0 to 9");
    assert_int_equal(parse(blue, &seen, &error), HOST_USAGE);
    assert_string_equal(error.text,
                        "--colour gren: no such name; did you mean green? "
                        "allowed: red, green");
}

/* Where help is not to be printed, -h is an error. */
TEST(test_help) {
    static const char *const words[] = {"-h", "--zzz", NULL};
    struct seen seen;
    struct host_error error;
    assert_int_equal(parse(words, &seen, &error), HOST_USAGE);
    assert_string_equal(error.text,
                        "--help: no help is given here; leave it out");
}
