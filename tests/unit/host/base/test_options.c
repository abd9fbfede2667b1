/* The arguments of a command: what is wrong with them, and what was meant. */

#include "host/base/options.h"
#include "tests/unit/test.h"

enum { WORDS_MAX = 6 };

struct seen {
    unsigned quiet, words, dry;
    char seed[8], window[8];
};

static error_t take(int key, char *value, struct argp_state *state) {
    struct seen *seen = state->input;
    switch (key) {
    case 'q':
        seen->quiet++;
        return 0;
    case 's':
        snprintf(seen->seed, sizeof seen->seed, "%s", value);
        return 0;
    case 'd':
        seen->dry += value == NULL ? 1 : 10;
        return 0;
    case 300:
        snprintf(seen->window, sizeof seen->window, "%s", value);
        return 0;
    case ARGP_KEY_ARG:
        seen->words++;
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static const struct argp_option options[] = {
    {NULL, 0, NULL, 0, "A group:", 1},
    {"seed", 's', "S", 0, "a value", 1},
    {"sieve", 302, "S", 0, "another, which begins alike", 1},
    {"window", 300, "N", 0, "no letter", 1},
    {"windows", 301, NULL, 0, "begins like another", 2},
    {"dry", 'd', "D", OPTION_ARG_OPTIONAL, "a value, or none", 2},
    {"quiet", 'q', NULL, 0, "no value, and the last letter", 2},
    {0}};
static const struct argp argp = {options, take, "", "", NULL, NULL, NULL};

static int parse(const char *const words[], struct seen *seen,
                 struct host_error *error) {
    char text[WORDS_MAX + 2][40] = {"incode try"};
    char *argv[WORDS_MAX + 2] = {text[0]};
    int argc = 1;
    memset(seen, 0, sizeof *seen);
    memset(error, 0, sizeof *error);
    for (; words[argc - 1] != NULL; argc++) {
        snprintf(text[argc], sizeof text[argc], "%s", words[argc - 1]);
        argv[argc] = text[argc];
    }
    return host_options_parse(&argp, argc, argv, ARGP_NO_HELP, seen, error);
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
    assert_string_equal(seen.window, "9");
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

TEST(test_the_one_argument) {
    const char *argument = NULL;
    struct host_error error = {0};
    assert_int_equal(
        host_option_argument(ARGP_KEY_END, "IMAGE", NULL, &argument, &error),
        HOST_USAGE);
    assert_non_null(strstr(error.text, "IMAGE: not given; "));
    error.code = 0;
    assert_int_equal(
        host_option_argument(ARGP_KEY_ARG, "IMAGE", "a", &argument, &error), 0);
    assert_int_equal(
        host_option_argument(ARGP_KEY_END, "IMAGE", NULL, &argument, &error),
        0);
    assert_int_equal(
        host_option_argument(ARGP_KEY_ARG, "IMAGE", "b", &argument, &error),
        HOST_USAGE);
    assert_string_equal(error.text,
                        "b: one argument too many; give IMAGE alone");
    assert_string_equal(argument, "a");
}

/* -h ends a command that has done nothing, and is no error. */
TEST(test_help) {
    static const char *const words[] = {"-h", "--zzz", NULL};
    struct seen seen;
    struct host_error error;
    assert_int_not_equal(parse(words, &seen, &error), 0);
    assert_int_equal(error.code, 0);
}
