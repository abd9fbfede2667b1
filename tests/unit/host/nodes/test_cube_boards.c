/* Bare boards in a cube file: which nodes they are, what they need, and what
 * their links are called. */

#include "host/nodes/cube_file.h"
#include "tests/unit/test.h"

#define HOST_WIRE "{ node = 0; to = \"host\"; unix = \"h\"; }"
#define M7 "board = \"mps2-an500\"; "

static struct host_cube_file file;
static struct host_error error;

static int parse(const char *text) {
    memset(&error, 0, sizeof error);
    return host_cube_file_parse(&file, "a.cube", text, &error);
}

/* No link between them is needed in the file. */
TEST(all_nodes_are_of_a_board) {
    static char options[HOST_NODE_OPTIONS_MAX][HOST_NODE_OPTION_BYTES];
    char line[400];
    assert_int_equal(parse("dimension = 4; " M7 "links = (" HOST_WIRE ");"), 0);
    assert_string_equal(file.board->name, "mps2-an500");
    for (unsigned i = 0; i < 16; i++)
        assert_true(host_cube_is_bare(&file, i));
    assert_false(host_cube_is_bare(&file, CUBE_HOST));
    assert_int_equal(file.serial_baud, 115200);
    assert_string_equal(host_cube_link(&file)->name, "uart");
    assert_null(host_cube_start_line(&file, 3, line, sizeof line));
    assert_true(host_cube_node_options(&file, 3, options) > 0);
    host_cube_file_free(&file);
}

static const char *const mixed =
    "dimension = 2; start = [2, 3];\n"
    "nodes = ( { node = 0; board = \"mps2-an385\"; },\n"
    "          { node = 1; board = \"mps2-an500\"; } );\n"
    "links = (" HOST_WIRE ",\n"
    "  { node = 0; to = 2; unix = \"02\"; },\n"
    "  { node = 1; to = 3; serial = [\"/dev/ttyUSB0\", \"/dev/ttyUSB1\"]; },\n"
    "  { node = 2; to = 3; unix = \"23\"; } );\n";

TEST(nodes_are_of_several_boards) {
    char line[400];
    assert_int_equal(parse(mixed), 0);
    assert_string_equal(file.board->name, "mixed");
    assert_string_equal(file.board_of[0]->name, "mps2-an385");
    assert_string_equal(file.board_of[1]->name, "mps2-an500");
    assert_string_equal(file.board_of[2]->name, "linux");
    assert_string_equal(host_cube_link(&file)->name, "mixed");
    assert_null(host_cube_start_line(&file, 1, line, sizeof line));
    assert_non_null(host_cube_start_line(&file, 2, line, sizeof line));
    assert_non_null(strstr(line, " --serial-baud 115200 "));
    assert_non_null(strstr(line, " --wire 1=unix-call:02"));
    host_cube_file_free(&file);
}

/* The whole is named, or where nothing is said of a board, linux. */
TEST(one_board_is_no_mixture) {
    assert_int_equal(parse("dimension = 0; " M7
                           "nodes = ( { node = 0; board = \"linux\"; "
                           "} ); links = (" HOST_WIRE ");"),
                     0);
    assert_string_equal(file.board->name, "linux");
    assert_string_equal(host_cube_link(&file)->name, "unix");
    host_cube_file_free(&file);
}

TEST(what_a_board_has_not) {
    static const struct {
        const char *text, *said;
    } cases[] = {
        {"dimension = 0;\n board = \"mps2-an600\"; links = (" HOST_WIRE ");",
         "a.cube:2: board: not one that there is; give \"linux\" or "},
        {"dimension = 5;\n" M7 "links = (" HOST_WIRE ");",
         "a.cube:1: dimension: node 0 (mps2-an500) has UARTs for dimension 4"},
        {"dimension = 2;\nboard = \"raspi3b\"; links = (" HOST_WIRE ");",
         "a.cube:1: dimension: node 0 (raspi3b) has UARTs for dimension 1"},
        {"dimension = 1; " M7 "\nstart = [1]; links = (" HOST_WIRE ");",
         "a.cube:2: start: node 1 (mps2-an500) is no program"},
        {"dimension = 1; " M7 "\nmemory = \"8M\"; links = (" HOST_WIRE ");",
         "a.cube:2: memory: node 0 (mps2-an500) has 4M; leave it out"},
        {"dimension = 0; " M7 "links = (\n{ node = 0; to = \"host\"; tcp = "
         "\"127.0.0.1:1\"; insecure = true; });",
         "a.cube:2: node 0 (mps2-an500) has no TCP; give unix or serial"},
        {"dimension = 0; " M7 "links = (\n{ node = 0; to = \"host\"; serial = "
         "[\"a\", \"b\"]; baud = 9600; });",
         "a.cube:2: node 0 (mps2-an500) has UARTs of baud = 115200"},
        {"dimension = 1; nodes = ( { node = 1; " M7 "} ); links = (" HOST_WIRE
         ",\n{ node = 0; to = 1; unix = \"b\"; });",
         "a.cube:2: node 1 (mps2-an500) cannot call; "},
        {"dimension = 1; nodes = ( { node = 1; " M7 "} );\nlinks = (" HOST_WIRE
         ");",
         "a.cube:2: no link between nodes 0 and 1"},
        {"dimension = 0;\nnodes = [1]; links = (" HOST_WIRE ");",
         "a.cube:2: nodes: not a list of groups"},
        {"dimension = 0;\nnodes = (1); links = (" HOST_WIRE ");",
         "nodes: not a list of groups"},
        {"dimension = 0;\nlinks = (7, " HOST_WIRE ");",
         "a.cube:2: links: not a list of groups"},
        {"dimension = 0;\nnodes = ( { node = 1; " M7 "} ); links = (" HOST_WIRE
         ");",
         "a.cube:2: node: not a node of this cube; give 0 to 0"},
        {"dimension = 0;\nnodes = ( { node = 0; } ); links = (" HOST_WIRE ");",
         "a.cube:2: nodes: an entry with nothing of its node"},
        {"dimension = 0; nodes = ( { node = 0; " M7 "},\n{ node = 0; " M7
         "} ); links = (" HOST_WIRE ");",
         "a.cube:2: nodes: a node twice"},
        {"dimension = 0;\nnodes = ( { node = 0; bord = 1; } ); links = "
         "(" HOST_WIRE ");",
         "a.cube:2: bord: "}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        assert_int_equal(parse(cases[i].text), HOST_INPUT);
        if (strstr(error.text, cases[i].said) == NULL ||
            strstr(error.text, "; ") == NULL)
            fail_msg("%s: %s", cases[i].text, error.text);
    }
}
