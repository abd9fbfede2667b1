/* Reset and boot lines in a cube file: of GPIO chips, and DTR and RTS of the
 * host's ports. */

#include "host/nodes/cube_file.h"
#include "tests/unit/test.h"

static struct host_cube_file file;
static struct host_error error;

static int parse(const char *text) {
    memset(&error, 0, sizeof error);
    return host_cube_file_parse(&file, "a.cube", text, &error);
}

#define HOST_WIRE "{ node = 0; to = \"host\"; unix = \"h\"; }"
#define LINKS                                                                  \
    "links = (" HOST_WIRE ", { node = 0; to = 1; unix = \"01\"; } );\n"

TEST(lines_of_chips) {
    assert_int_equal(
        parse("dimension = 1;\n"
              "nodes = ( { node = 0; board = \"linux\"; },\n"
              "  { node = 1;\n"
              "    reset = { chip = \"pl061\"; line = 2; active_low = true;\n"
              "              open_drain = true; };\n"
              "    boot = { chip = \"gpiochip0\"; line = \"BOOT1\"; }; } "
              ");\n" LINKS),
        0);
    const struct host_cube_pin *reset =
        host_cube_pin(&file, 1, HOST_LINE_RESET);
    const struct host_cube_pin *boot = host_cube_pin(&file, 1, HOST_LINE_BOOT);
    assert_int_equal(file.pins, 2);
    assert_null(host_cube_pin(&file, 0, HOST_LINE_RESET));
    assert_non_null(reset);
    assert_int_equal(reset->line, 4);
    assert_int_equal(reset->wire, -1);
    assert_string_equal(reset->chip, "pl061");
    assert_string_equal(reset->name, "");
    assert_int_equal(reset->offset, 2);
    assert_true(reset->active_low && reset->open_drain);
    assert_non_null(boot);
    assert_string_equal(boot->chip, "gpiochip0");
    assert_string_equal(boot->name, "BOOT1");
    assert_false(boot->active_low || boot->open_drain);
    host_cube_file_free(&file);
}

#define SERIAL "serial = [\"/dev/uart\", \"/dev/ttyUSB0\"]; "

/* The second wire of the host has lines of its own. */
TEST(lines_of_ports) {
    assert_int_equal(
        parse("dimension = 1; links = (\n"
              "{ node = 0; to = 1; unix = \"01\"; },\n"
              "{ node = 0; to = \"host\"; " SERIAL "dtr = \"reset\";\n"
              "  rts = \"boot\"; },\n"
              "{ node = 1; to = \"host\"; serial = [\"/dev/uart\", "
              "\"/dev/ttyUSB1\"]; rts = \"reset\"; } );"),
        0);
    const struct host_cube_pin *reset =
        host_cube_pin(&file, 0, HOST_LINE_RESET);
    const struct host_cube_pin *boot = host_cube_pin(&file, 0, HOST_LINE_BOOT);
    assert_non_null(reset);
    assert_non_null(boot);
    assert_int_equal(reset->wire, 0);
    assert_false(reset->rts);
    assert_int_equal(reset->line, 3);
    assert_int_equal(boot->wire, 0);
    assert_true(boot->rts);
    assert_int_equal(boot->line, 4);
    reset = host_cube_pin(&file, 1, HOST_LINE_RESET);
    assert_non_null(reset);
    assert_int_equal(reset->wire, 1);
    assert_true(reset->rts);
    const struct host_cube_wire *first = host_cube_host_wire(&file, 0);
    const struct host_cube_wire *second = host_cube_host_wire(&file, 1);
    assert_true(first->dtr_low && first->rts_low);
    assert_true(!second->dtr_low && second->rts_low);
    host_cube_file_free(&file);
}

/* Many boards, each with both. */
TEST(room_for_all) {
    static char text[64 * 200];
    size_t used = 0;
    used += (size_t)snprintf(
        text, sizeof text, "dimension = 4; board = \"mps2-an500\"; nodes = (");
    for (unsigned i = 0; i < 16; i++) {
        used += (size_t)snprintf(
            text + used, sizeof text - used,
            "%s{ node = %u; reset = { chip = \"c\"; line = %u; }; "
            "boot = { chip = \"c\"; line = %u; }; }",
            i == 0 ? "" : ", ", i, 2 * i, 2 * i + 1);
    }
    snprintf(text + used, sizeof text - used, "); links = (" HOST_WIRE ");");
    assert_int_equal(parse(text), 0);
    assert_int_equal(file.pins, 32);
    for (unsigned i = 0; i < 16; i++) {
        assert_int_equal(host_cube_pin(&file, i, HOST_LINE_BOOT)->offset,
                         2 * i + 1);
    }
    host_cube_file_free(&file);
}

static void refuse(const char *text, const char *said) {
    assert_int_equal(parse(text), HOST_INPUT);
    if (strncmp(error.text, said, strlen(said)) != 0 ||
        strstr(error.text, "; ") == NULL)
        fail_msg("%s: %s", text, error.text);
}

TEST(what_is_wrong_with_a_chips) {
    static const char *const cases[][2] = {
        {"reset = 17;", "a.cube:2: reset: no group in braces; "},
        {"reset = { line = 1; };", "a.cube:2: reset: chip: not given"},
        {"boot = { chip = 3; line = 1; };", "a.cube:2: boot: chip: not given"},
        {"reset = { chip = \"\"; line = 1; };", "a.cube:2: reset: chip: not"},
        {"reset = { chip = \"c\"; };", "a.cube:2: reset: line: not given"},
        {"reset = { chip = \"c\"; line = -1; };", "a.cube:2: reset: line: "},
        {"reset = { chip = \"c\"; line = 65536; };", "a.cube:2: reset: line: "},
        {"reset = { chip = \"c\"; line = \"\"; };", "a.cube:2: reset: line: "},
        {"reset = { chip = \"c\"; line = 1.5; };", "a.cube:2: reset: line: "},
        {"reset = { chip = \"c\"; line = 1; active_low = 1; };",
         "a.cube:2: reset: active_low: neither"},
        {"reset = { chip = \"c\"; line = 1; open_drain = 1; };",
         "a.cube:2: reset: open_drain: neither"},
        {"reset = { chip = \"c\"; line = 1; open_drain = true; };",
         "a.cube:2: reset: open_drain: such a line can only pull low; add"},
        {"reset = { chip = \"c\";\n line = 1; active_high = true; };",
         "a.cube:3: reset: active_high: no such setting"},
        {"reset = { chip = \"c\"; line = 1; };\nboot = { chip = \"c\"; line = "
         "1; };",
         "a.cube:3: boot: node 0 has that line as well, by line 2 of this "
         "file; give each its own"},
        {"reset = { chip = \"12345678901234567890123456789012345678901234567890"
         "12345678901234\"; line = 1; };",
         "a.cube:2: reset: chip: not given, or no name of 1 to 63"},
    };
    char text[600];
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        snprintf(text, sizeof text,
                 "dimension = 1; nodes = ( {\n%s node = 0; } ); " LINKS,
                 cases[i][0]);
        refuse(text, cases[i][1]);
    }
}

TEST(what_is_wrong_with_a_ports) {
    static const char *const cases[][2] = {
        {"{ node = 0; to = \"host\"; " SERIAL "dtr = \"rst\"; }",
         "a.cube:2: dtr: does neither; give "},
        {"{ node = 0; to = \"host\"; " SERIAL "rts = 1; }",
         "a.cube:2: rts: does neither; give "},
        {"{ node = 0; to = \"host\"; " SERIAL
         "rts = \"boot\"; rtscts = true; }",
         "a.cube:2: rts: holds the other end back"},
        {"{ node = 0; to = \"host\"; " SERIAL
         "dtr = \"boot\"; rts = \"boot\"; }",
         "a.cube:2: boot: node 0 has one in line 2; leave one"},
        {"{ node = 0; to = \"host\"; unix = \"h\"; dtr = \"reset\"; }",
         "a.cube:2: dtr: does nothing beside unix"},
        {HOST_WIRE ", { node = 0; to = 1; " SERIAL "rts = \"reset\"; }",
         "a.cube:2: rts: not at a wire of the host"},
    };
    char text[600];
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        snprintf(text, sizeof text, "dimension = 1; links = (\n%s );",
                 cases[i][0]);
        refuse(text, cases[i][1]);
    }
    refuse("dimension = 0; nodes = ( { node = 0;\n"
           "  reset = { chip = \"c\"; line = 1; }; } );\n"
           "links = ( { node = 0; to = \"host\"; " SERIAL
           "dtr = \"reset\"; } );",
           "a.cube:3: reset: node 0 has one in line 2; leave one of them out");
}
