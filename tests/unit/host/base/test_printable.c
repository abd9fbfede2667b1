/* Words from elsewhere, for a terminal and for a shell. */

#include "host/base/error.h"
#include "host/base/text.h"
#include "tests/unit/test.h"

enum { TEXT = 400, RANDOM_WORDS = 200, WORDS = 256 + RANDOM_WORDS };

TEST(test_printable) {
    static const struct {
        const char *text, *printed;
    } cases[] = {
        {"", ""},
        {"points.xyz", "points.xyz"},
        {"a b\\c", "a b\\c"},
        {"\x1b[2Jx", "\\x1b[2Jx"},
        {"a\nb\tc\r", "a\\x0ab\\x09c\\x0d"},
        {"\x7f", "\\x7f"},
        {"gr\xc3\xbc\xc3\x9f", "gr\xc3\xbc\xc3\x9f"},
        {"\xe2\x82\xac \xf0\x9f\x98\x80", "\xe2\x82\xac \xf0\x9f\x98\x80"},
        {"\xc2\x9b\x31m", "\\xc2\\x9b1m"}, /* CSI as one character */
        /* Writes backwards.  NOLINTNEXTLINE(misc-misleading-bidirectional) */
        {"\xe2\x80\xaetxt", "\\xe2\\x80\\xaetxt"},
        {"\xff\xfe", "\\xff\\xfe"},
        {"\xc0\xaf", "\\xc0\\xaf"},          /* not the shortest form */
        {"\xe0\x80\x8a", "\\xe0\\x80\\x8a"}, /* nor this */
        {"\xed\xa0\x80", "\\xed\\xa0\\x80"}, /* a surrogate */
        {"\xf4\x90\x80\x80", "\\xf4\\x90\\x80\\x80"}, /* past U+10FFFF */
        {"\xe2\x82", "\\xe2\\x82"},                   /* cut */
        {"\x80", "\\x80"},
        {"\xf8\x88\x80\x80\x80", "\\xf8\\x88\\x80\\x80\\x80"}};
    char out[TEXT], again[TEXT];
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        host_text_printable(out, sizeof out, cases[i].text);
        assert_string_equal(out, cases[i].printed);
        host_text_printable(again, sizeof again, out);
        assert_string_equal(again, out);
    }
}

/* Whole characters, and nothing past the end. */
TEST(test_bounds) {
    static const char text[] = "a\xe2\x82\xac\x1b";
    static const char *const cut[] = {
        "", "a", "a", "a", "a\xe2\x82\xac", "a\xe2\x82\xac"};
    char out[16];
    for (size_t size = 1; size <= 6; size++) {
        memset(out, '#', sizeof out);
        host_text_printable(out, size, text);
        assert_string_equal(out, cut[size - 1]);
        assert_int_equal(out[size], '#');
    }
    for (size_t size = 1; size <= 12; size++) {
        memset(out, '#', sizeof out);
        int status = host_text_quote(out, size, "it's");
        assert_int_equal(status, size > strlen("'it'\\''s'") ? 0 : -1);
        assert_string_equal(out, status == 0 ? "'it'\\''s'" : "");
        assert_int_equal(out[size], '#');
    }
}

TEST(test_quoted_where_needed) {
    static const struct {
        const char *text, *quoted;
    } cases[] = {{"/dev/ttyUSB0", "/dev/ttyUSB0"},
                 {"1=call:10.0.0.1:7001", "1=call:10.0.0.1:7001"},
                 {"", "''"},
                 {"=ls", "'=ls'"},
                 {"~", "'~'"},
                 {"; touch x", "'; touch x'"},
                 {"0=listen:[::1]:7001", "'0=listen:[::1]:7001'"},
                 {"it's", "'it'\\''s'"},
                 {"gr\xc3\xbc\xc3\x9f", "'gr\xc3\xbc\xc3\x9f'"},
                 {"a\nb", "'a\nb'"},
                 {"\x1b", "\"$(printf '\\033')\""}};
    char out[TEXT];
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        assert_int_equal(host_text_quote(out, sizeof out, cases[i].text), 0);
        assert_string_equal(out, cases[i].quoted);
    }
}

/* Every byte alone and between others, and words drawn from those that mean
 * something to a shell. */
static void make_word(unsigned i, char word[TEXT / 20]) {
    static const char hard[] = "'\"\\$`\n !*?[]{}~#&;|<>()\t\r\x1b\x80\xff%=a";
    static uint32_t state = 1;
    if (i < 256) {
        snprintf(word, TEXT / 20, i % 2 == 0 ? "%c" : "x%cy\n", (int)i);
        return;
    }
    unsigned length = 1 + i % 12;
    for (unsigned k = 0; k < length; k++) {
        state = state * 1664525 + 1013904223;
        word[k] = hard[(state >> 8) % (sizeof hard - 1)];
    }
    word[length] = '\0';
}

TEST(test_what_a_shell_reads) {
    static char said[WORDS * 20];
    char quoted[TEXT], printable[TEXT], word[TEXT / 20];
    char path[] = "/tmp/incode-quoted-XXXXXX", command[64];
    static char words[WORDS][TEXT / 20];
    int fd = mkstemp(path);
    FILE *script = fdopen(fd, "w");
    assert_non_null(script);
    for (unsigned i = 1; i < WORDS; i++) {
        make_word(i, word);
        memcpy(words[i], word, sizeof word);
        assert_int_equal(host_text_quote(quoted, sizeof quoted, word), 0);
        fprintf(script, "printf '%%s\\0' %s\n", quoted);
        for (char *c = quoted; *c != '\0'; c++)
            *c = *c == '\n' ? ' ' : *c;
        host_text_printable(printable, sizeof printable, quoted);
        assert_string_equal(printable, quoted);
    }
    assert_int_equal(fclose(script), 0);
    snprintf(command, sizeof command, "sh %s", path);
    FILE *shell = popen(command, "r");
    assert_non_null(shell);
    size_t size = fread(said, 1, sizeof said, shell), at = 0;
    assert_int_equal(pclose(shell), 0);
    remove(path);
    for (unsigned i = 1; i < WORDS; i++) {
        assert_true(at < size);
        assert_string_equal(said + at, words[i]);
        at += strlen(words[i]) + 1;
    }
    assert_int_equal(at, size);
}

static const char *name_of(const void *names, unsigned i) {
    return ((const char *const *)names)[i];
}

TEST(test_nearest) {
    static const char *const names[] = {"run",    "gen",     "verify",
                                        "digest", "convert", NULL};
    static const struct {
        const char *word, *nearest;
    } cases[] = {{"gne", "gen"},
                 {"rum", "run"},
                 {"verfy", "verify"},
                 {"digset", "digest"},
                 {"covnetr", "convert"},
                 {"xyz", NULL},
                 {"", NULL},
                 {"q", NULL},
                 {"a.xyz", NULL}};
    static const char long_word[] = "a word that is longer than any name, and "
                                    "than the table of its distances";
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const char *found = host_text_nearest(cases[i].word, name_of, names);
        if (cases[i].nearest == NULL)
            assert_null(found);
        else
            assert_string_equal(found, cases[i].nearest);
    }
    (void)host_text_nearest(long_word, name_of, names);
}

/* A line of an error, and one that is said. */
TEST(test_said) {
    char line[80] = "";
    struct host_error error = {0};
    assert_int_equal(
        host_fail(&error, HOST_INPUT, "%s: no; give", "\x1b]0;a\x07\n"),
        HOST_INPUT);
    assert_string_equal(error.text, "\\x1b]0;a\\x07\\x0a: no; give");
    FILE *stream = fmemopen(line, sizeof line, "w");
    assert_non_null(stream);
    host_say(stream, "%s is here\n", "a\n\x1b");
    host_say(stream, "%s", "b\n");
    fclose(stream);
    assert_string_equal(line, "a\\x0a\\x1b is here\nb\\x0a");
}
