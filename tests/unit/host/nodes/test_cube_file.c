/* The cube file: what it says is what nodes are started with, and what is wrong
 * in it is named with its line. */
#include <sys/stat.h>
#include <unistd.h>

#include "host/nodes/cube_file.h"
#include "tests/unit/test.h"

static char directory[] = "/tmp/incode-cube.XXXXXX";
static char path[64], key_path[64];

static void write_file(const char *name, const char *text) {
    FILE *file = fopen(name, "w");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
}

static int set_up(void **unused) {
    (void)unused;
    assert_non_null(mkdtemp(directory));
    snprintf(path, sizeof path, "%s/lab.cube", directory);
    snprintf(key_path, sizeof key_path, "%s/lab.key", directory);
    write_file(key_path, "000102030405060708090a0b0c0d0e0f"
                         "101112131415161718191a1b1c1d1e1f\n");
    return chmod(key_path, 0600);
}

static int tear_down(void **unused) {
    (void)unused;
    return unlink(path) | unlink(key_path) | rmdir(directory);
}

static const char *const good =
    "dimension = 1; memory = \"512K\"; key = \"lab.key\"; start = [1];\n"
    "links = (\n"
    "  { node = 0; to = \"host\"; tcp = \"10.0.0.1:7000\"; },\n"
    "  { node = 1; to = \"host\"; tcp = \"127.0.0.1:7001\"; },\n"
    "  { node = 1; to = 0; serial = [\"/dev/ttyS1\", \"/dev/ttyUSB0\"];\n"
    "    baud = 921600; rtscts = true; }\n"
    ");\n";

static bool has(char options[HOST_NODE_OPTIONS_MAX][HOST_NODE_OPTION_BYTES],
                unsigned count, const char *name, const char *value) {
    for (unsigned i = 0; i + 1 < count; i += 2)
        if (strcmp(options[i], name) == 0 && strcmp(options[i + 1], value) == 0)
            return true;
    return false;
}

static bool named(char options[HOST_NODE_OPTIONS_MAX][HOST_NODE_OPTION_BYTES],
                  unsigned count, const char *name) {
    bool found = false;
    for (unsigned i = 0; i < count; i++)
        found = found || strcmp(options[i], name) == 0;
    return found;
}

TEST(nodes_are_started_as_it_says) {
    static struct host_cube_file file;
    static char options[HOST_NODE_OPTIONS_MAX][HOST_NODE_OPTION_BYTES];
    struct host_error error = {0};
    write_file(path, good);
    assert_int_equal(host_cube_file_read(&file, path, &error), 0);
    assert_int_equal(file.nodes, 2);
    assert_int_equal(file.memory, 512 * 1024);
    assert_true(file.has_key && file.serial_baud == 921600);
    assert_int_equal(file.key[0], 0);
    assert_int_equal(file.key[31], 0x1f);
    assert_string_equal(host_cube_link(&file)->name, "mixed");
    assert_true(file.local[1] && !file.local[0]);
    assert_int_equal(host_cube_host_wire(&file, 0)->node, 0);
    assert_int_equal(host_cube_host_wire(&file, 1)->node, 1);
    assert_null(host_cube_host_wire(&file, 2));
    unsigned count = host_cube_node_options(&file, 0, options);
    assert_true(has(options, count, "--node", "0"));
    assert_true(has(options, count, "--memory", "524288"));
    assert_true(has(options, count, "--serial-baud", "921600"));
    assert_true(has(options, count, "--key", key_path));
    assert_false(named(options, count, "--board")); /* the program's own */
    assert_false(named(options, count, "--window"));
    assert_false(named(options, count, "--host-port")); /* node 0 has it */
    assert_true(
        has(options, count, "--wire", "0=serial:/dev/ttyUSB0:921600:rtscts"));
    assert_true(has(options, count, "--wire", "1=listen:10.0.0.1:7000"));
    count = host_cube_node_options(&file, 1, options);
    assert_true(has(options, count, "--host-port", "1"));
    assert_true(
        has(options, count, "--wire", "0=serial:/dev/ttyS1:921600:rtscts"));
    assert_true(has(options, count, "--wire", "1=listen:127.0.0.1:7001") ||
                has(options, count, "--wire", "1=listen:[::1]:7001"));
    host_cube_file_free(&file);
}

static const char *const local =
    "dimension = 1; start = [1];\n"
    "links = (\n"
    "  { node = 0; to = \"host\"; unix = \"h\"; },\n"
    "  { node = 1; to = 0; %s; },\n"
    "  { node = 1; to = \"host\"; %s; }\n"
    ");\n";

/* Paths beside the file or from the root, wires that are insecure, and what
 * the statistics call them all. */
TEST(wires_without_a_key) {
    static const struct {
        const char *one, *two, *first, *second, *insecure, *link;
    } cases[] = {
        {"unix = \"/run/01\"", "unix = \"b\"", "0=unix-listen:/run/01",
         "1=unix-listen:%s/b", NULL, "unix"},
        {"tcp = \"127.0.0.1:5\"; insecure = true", "unix = \"b\"",
         "0=listen:127.0.0.1:5", "1=unix-listen:%s/b", "0", "mixed"},
        {"tcp = \"127.0.0.1:5\"; insecure = true",
         "tcp = \"127.0.0.1:6\"; insecure = true", "0=listen:127.0.0.1:5",
         "1=listen:127.0.0.1:6", "0,1", "mixed"},
    };
    static struct host_cube_file file;
    static char options[HOST_NODE_OPTIONS_MAX][HOST_NODE_OPTION_BYTES];
    struct host_error error = {0};
    char text[1024], second[HOST_NODE_OPTION_BYTES];
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        snprintf(text, sizeof text, local, cases[i].one, cases[i].two);
        write_file(path, text);
        assert_int_equal(host_cube_file_read(&file, path, &error), 0);
        assert_string_equal(host_cube_link(&file)->name, cases[i].link);
        unsigned count = host_cube_node_options(&file, 1, options);
        snprintf(second, sizeof second, cases[i].second, directory);
        assert_true(has(options, count, "--wire", cases[i].first));
        assert_true(has(options, count, "--wire", second));
        assert_true(cases[i].insecure == NULL ||
                    has(options, count, "--insecure", cases[i].insecure));
        host_cube_file_free(&file);
    }
    /* one path twice */
    snprintf(text, sizeof text, local, "unix = \"b\"", "unix = \"b\"");
    write_file(path, text);
    assert_int_equal(host_cube_file_read(&file, path, &error), 3);
    assert_non_null(strstr(error.text, "give each end of a link its own"));
}

/* Writes the good file with another text in place of one of it. */
static void write_changed(const char *old, const char *new) {
    char text[1024];
    const char *at = strstr(good, old);
    assert_non_null(at);
    snprintf(text, sizeof text, "%.*s%s%s", (int)(at - good), good, new,
             at + strlen(old));
    write_file(path, text);
}

/* A text of the good file, another in its place, and where and what the error
 * must say, if it is one. */
static const struct {
    const char *old, *new, *where, *what;
    int code;
} mistakes[] = {
    {"dimension = 1;", "dimension = 11;", ":1: ", "0 to 10", 3},
    {"dimension = 1;", "", ":1: ", "dimension", 3},
    {"dimension = 1;", "dimension = ;", ":1: ", "syntax error", 3},
    {"\"512K\"", "\"12K\"", ":1: ", "memory", 3},
    {"memory", "mammary", ":1: ", "mammary: no such setting", 3},
    {"lab.key", "no.key", ":1: ", "cannot be read: No such file", 3},
    {"lab.key", ".", ":1: ", "cannot be read: Is a directory", 3},
    {"lab.key", "lab.cube", ":1: ", "64 hexadecimal digits", 3},
    {"start = [1]", "board = \"z80\"", ":1: ", "give \"linux\"", 3},
    {"start = [1]", "board = 7", ":1: ", "give \"linux\"", 3},
    {"start = [1]", "start = [1, 0, 1]", ":1: ", "twice", 3},
    {"127.0.0.1:7001", "10.0.0.1:7000", ":4: ",
     "node 1 and the host has 10.0.0.1:7000, and so has that between node "
     "0 and the host in line 3; ",
     3},
    {"/dev/ttyS1\", \"/dev/ttyUSB0", "/dev/t\", \"/dev/t", ":0: ", "", 0},
    {"start = [1]", "start = [0, 1]", ":0: ", "", 0},
    {"tcp = \"127.0.0.1:7001\"", "serial = [\"/dev/ttyS1\", \"/dev/a\"]",
     ":5: ", "/dev/ttyS1", 3},
    {"tcp = \"127.0.0.1:7001\"", "serial = [\"/dev/ttyUSB0\", \"/dev/a\"]",
     ":0: ", "", 0},
    {"key = \"lab.key\";", "",
     ":3: ", "without a key; make one with: incode key FILE", 3},
    {"start = [1]", "start = [2]", ":1: ", "start", 3},
    {"node = 1; to = 0;", "node = 1; to = 1;", ":5: ", "no neighbours", 3},
    {"node = 1; to = 0;", "node = 7; to = 0;", ":5: ", "not a node", 3},
    {"node = 1; to = 0;", "node = 1; to = \"host\";",
     ":2: ", "no link between nodes 0 and 1", 3},
    {"node = 0; to = \"host\"", "node = 1; to = \"host\"", ":2: ", "node 0", 3},
    {"baud = 921600", "baud = 12", ":6: ", "300 to 20000000", 3},
    {"rtscts", "ctsrts", ":6: ", "ctsrts: no such setting", 3},
    {"[\"/dev/ttyS1\", \"/dev/ttyUSB0\"]", "[\"/dev/ttyS1\"]",
     ":5: ", "two devices", 3},
    {"tcp = \"10.0.0.1:7000\"", "tcp = \"10.0.0.1\"", ":3: ", "port", 3},
    {"tcp = \"10.0.0.1:7000\";", "", ":3: ", "none or several", 3},
    {"tcp = \"10.0.0.1:7000\";", "tcp = \"10.0.0.1:7\"; unix = \"/a\";",
     ":3: ", "none or several", 3},
    {"7000\";", "7000\"; baud = 9600;",
     ":3: ", "baud: does nothing beside tcp; leave it out", 3},
    {"7000\";", "7000\"; rtscts = false;",
     ":3: ", "rtscts: does nothing beside tcp; ", 3},
    {"baud = 921600", "via = \"10.0.0.1:7000\"",
     ":6: ", "via: does nothing beside serial; ", 3},
    {"baud = 921600", "insecure = false",
     ":6: ", "insecure: does nothing beside serial; ", 3},
    {"tcp = \"127.0.0.1:7001\"", "unix = \"/run/h\"; insecure = true",
     ":4: ", "insecure: does nothing beside unix; ", 3},
    {"tcp = \"127.0.0.1:7001\"", "unix = \"/run/h\"", ":0: ", "", 0},
    {"tcp = \"127.0.0.1:7001\"", "unix = \"\"", ":4: ", "unix: not a path", 3},
    {"tcp = \"127.0.0.1:7001\"",
     "unix = \"/run/a/path/that/is/far/longer/than/what/the/kernel/has/"
     "room/for/in/an/address/of/a/socket/which/is/107/bytes\"",
     ":4: ", "unix: not a path", 3},
    {"key = \"lab.key\";", "key = \"\";", ":1: ", "incode key FILE", 3},
    {"127.0.0.1:7001", "no.such.host.invalid:7001",
     ":4: ", "no.such.host.invalid", 4},
};

TEST(mistakes_are_named) {
    static struct host_cube_file file;
    for (size_t i = 0; i < sizeof mistakes / sizeof mistakes[0]; i++) {
        char where[96];
        struct host_error error = {0};
        write_changed(mistakes[i].old, mistakes[i].new);
        snprintf(where, sizeof where, "%s%s", path, mistakes[i].where);
        int status = host_cube_file_read(&file, path, &error);
        if (status != mistakes[i].code ||
            (status != 0 && (strstr(error.text, where) == NULL ||
                             strstr(error.text, mistakes[i].what) == NULL)))
            fail_msg("case %zu: exit %d: %s", i, status, error.text);
        if (status == 0)
            host_cube_file_free(&file);
    }
}

/* Of each setting a value of another type, and one that is another number
 * where it is cut to an int.  Lines as in the good file. */
TEST(other_types_are_no_values) {
    static const struct {
        const char *old, *new, *what;
    } cases[] = {
        {"dimension = 1", "dimension = \"1\"", ":1: dimension: "},
        {"dimension = 1", "dimension = 1.0", ":1: dimension: "},
        {"dimension = 1", "dimension = 4294967297L", ":1: dimension: "},
        {"\"512K\"", "1048576", ":1: memory: "},
        {"\"512K\"", "[\"512K\"]", ":1: memory: "},
        {"\"lab.key\"", "7", ":1: key: "},
        {"start = [1]", "window = \"8\"", ":1: window: "},
        {"start = [1]", "window = 8.0", ":1: window: "},
        {"start = [1]", "window = 4294967304L", ":1: window: "},
        {"start = [1]", "dead = 2.5", ":1: dead: "},
        {"start = [1]", "dead = true", ":1: dead: "},
        {"start = [1]", "dead = 4294967296L", ":1: dead: "},
        {"start = [1]", "board = [\"linux\"]", ":1: board: "},
        {"start = [1]", "start = 1", ":1: start: "},
        {"start = [1]", "start = \"1\"", ":1: start: "},
        {"start = [1]", "start = { node = 1; }", ":1: start: "},
        {"start = [1]", "start = [\"1\"]", ":1: start: "},
        {"start = [1]", "start = [1.0]", ":1: start: "},
        {"start = [1]", "start = (1, \"host\")", ":1: start: "},
        {"start = [1]", "start = [4294967297L]", ":1: start: "},
        {"node = 0;", "node = \"0\";", ":3: node: "},
        {"node = 0;", "node = 0.0;", ":3: node: "},
        {"to = 0;", "to = \"0\";", ":5: to: "},
        {"to = 0;", "to = 4294967296L;", ":5: to: "},
        {"tcp = \"10.0.0.1:7000\"", "tcp = 7000", ":3: not a host"},
        {"7000\";", "7000\"; via = 7000;", ":3: not a host"},
        {"[\"/dev/ttyS1\", \"/dev/ttyUSB0\"]", "\"/dev/ttyS1\"",
         ":5: serial: "},
        {"[\"/dev/ttyS1\", \"/dev/ttyUSB0\"]", "(\"/dev/ttyS1\", 1)",
         ":5: serial: "},
        {"\"/dev/ttyUSB0\"]", "\"/dev/ttyUSB0\", \"/dev/ttyS2\"]",
         ":5: serial: "},
        {"baud = 921600", "baud = \"9600\"", ":6: baud: "},
        {"baud = 921600", "baud = 9600.0", ":6: baud: "},
        {"baud = 921600", "baud = 4294976896L", ":6: baud: "},
        {"rtscts = true", "rtscts = 1", ":6: rtscts: "},
        {"7000\";", "7000\"; insecure = 1;", ":3: insecure: "},
        {"7000\";", "7000\"; insecure = \"true\";", ":3: insecure: "},
        {"tcp = \"10.0.0.1:7000\"", "unix = 7", ":3: unix: "},
        {"tcp = \"10.0.0.1:7000\"", "unix = [\"/a\", \"/b\"]", ":3: unix: "},
        {"rtscts = true", "rtscts = \"true\"", ":6: rtscts: "},
    };
    static struct host_cube_file file;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char expected[128];
        struct host_error error = {0};
        write_changed(cases[i].old, cases[i].new);
        snprintf(expected, sizeof expected, "%s%s", path, cases[i].what);
        if (host_cube_file_read(&file, path, &error) != HOST_INPUT ||
            strstr(error.text, expected) == NULL ||
            strstr(error.text, "; ") == NULL)
            fail_msg("%s: exit %d: %s", cases[i].new, error.code, error.text);
    }
}

/* What the library would follow, or not come back from, it never sees. */
TEST(what_the_library_is_not_given) {
    static const struct {
        const char *text, *said;
    } cases[] = {
        {"dimension = 0;\n  @include \"/dev/zero\"\n", ":2: @: "},
        {"@include \"lab.cube\"", ":1: @: "},
        {"a = \"\\\"\"; /* \" */ # \"\n// \"\n@include \"a\"", ":3: @: "},
        {"a = \"\n\n\"; @", ":3: @: "},
        {"a = ((((((((((((((((((((", ":1: too many brackets"},
        {"a=[[]];b=[[]];c=[[]];d=({[[{[[((((((((((((", ":1: too many brackets"},
        /* Read on, and refused for what they are. */
        {"# @include \"a\"\n/* @ */ // @\ndimension = \"@include\";",
         ":3: dimension: "},
        {"dimension = 1; /* @", ":1: links: "},
        {"dimension = \"1", ":1: syntax error"},
        {")))]]]}}}", ":1: syntax error"},
        {"", ":1: dimension: "}};
    static struct host_cube_file file;
    static char many[4096];
    struct host_error error = {0};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        error = (struct host_error){0};
        assert_int_equal(
            host_cube_file_parse(&file, "a.cube", cases[i].text, &error), 3);
        if (strstr(error.text, cases[i].said) == NULL)
            fail_msg("%s: %s", cases[i].text, error.text);
    }
    for (int i = 0; i < 100; i++)
        snprintf(many + strlen(many), sizeof many - strlen(many), "a%d=1;", i);
    error = (struct host_error){0};
    assert_int_equal(host_cube_file_parse(&file, "a.cube", many, &error), 3);
    assert_non_null(strstr(error.text, ":1: more settings"));
}

TEST(files_that_are_not_taken) {
    static const struct {
        const char *path, *what;
    } others[] = {{"/no/such.cube", "No such file"},
                  {"/tmp", "a directory; "},
                  {"/dev/zero", "a pipe or device; "},
                  {"/dev/null", "a pipe or device; "}};
    static struct host_cube_file file;
    struct host_error error = {0};
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++) {
        error = (struct host_error){0};
        assert_int_equal(host_cube_file_read(&file, others[i].path, &error), 3);
        assert_non_null(strstr(error.text, others[i].what));
    }
    assert_int_equal(unlink(path), 0);
    assert_int_equal(mkfifo(path, 0600), 0); /* which nobody writes to */
    error = (struct host_error){0};
    assert_int_equal(host_cube_file_read(&file, path, &error), 3);
    assert_non_null(strstr(error.text, "a pipe or device; "));
    assert_int_equal(unlink(path), 0);
    write_file(path, good);
    assert_int_equal(truncate(path, INT32_MAX), 0);
    error = (struct host_error){0};
    assert_int_equal(host_cube_file_read(&file, path, &error), 3);
    assert_non_null(strstr(error.text, "at most 4 MiB; "));
    write_file(path, good);
    assert_int_equal(chmod(key_path, 0602), 0);
    error = (struct host_error){0};
    assert_int_equal(host_cube_file_read(&file, path, &error), 3);
    assert_non_null(strstr(error.text, "can be written by others"));
    assert_int_equal(chmod(key_path, 0600), 0);
}

TEST_GROUP(set_up, tear_down)
