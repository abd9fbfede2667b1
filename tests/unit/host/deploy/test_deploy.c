/* What starts a node on a board: words of a shell and of systemd, and the
 * node's memory. */
#include <stdbool.h>
#include <sys/utsname.h>
#include <unistd.h>

#include "host/deploy/deploy.h"
#include "host/deploy/script.h"
#include "host/deploy/answer.h"
#include "tests/unit/test.h"

static const char *const cube =
    "dimension = 0; memory = \"1M\";\n"
    "nodes = ( { node = 0; ssh = \"pi@board\"; folder = \"a b\"; } );\n"
    "links = ( { node = 0; to = \"host\"; unix = \"/run/%d$x\\\"y\"; } );\n";

static struct host_cube_file file;

static int read_cube(void **unused) {
    (void)unused;
    struct host_error error = {0};
    assert_int_equal(host_cube_file_parse(&file, "t.cube", cube, &error), 0);
    return 0;
}

static int free_cube(void **unused) {
    (void)unused;
    host_cube_file_free(&file);
    return 0;
}

TEST(test_where) {
    assert_string_equal(host_cube_ssh(&file, 0)->to, "pi@board");
    assert_string_equal(host_cube_ssh(&file, 0)->folder, "a b");
    assert_null(host_cube_ssh(&file, 1));
}

static char *text_of(const char *manager) {
    const struct host_unit unit = {.file = &file,
                                   .node = 0,
                                   .folder = "/home/p i/node-0",
                                   .manager = manager,
                                   .user = "pi"};
    char *text = host_unit_text(&unit);
    assert_non_null(text);
    return text;
}

TEST(test_service) {
    char *text = text_of("system");
    assert_non_null(
        strstr(text, "\nExecStart= \"/home/p i/node-0/incode-node\" \"--node\" "
                     "\"0\" "));
    assert_non_null(strstr(text, "unix-listen:/run/%%d$$x\\\"y\"\n"));
    assert_non_null(strstr(text, "\nUser=pi\n"));
    assert_non_null(strstr(text, "\nLimitDATA=983040\n"));
    assert_non_null(strstr(text, "\nLimitSTACK=65536\n"));
    assert_non_null(strstr(text, "\nMemoryMax=9437184\n"));
    assert_non_null(strstr(text, "\nWantedBy=multi-user.target\n"));
    free(text);
    text = text_of("user");
    assert_null(strstr(text, "\nUser="));
    assert_null(strstr(text, "network-online"));
    assert_non_null(strstr(text, "\nWantedBy=default.target\n"));
    free(text);
}

TEST(test_start) {
    char *text = text_of("none");
    assert_int_equal(strncmp(text, "#!/bin/sh\n", 10), 0);
    assert_non_null(strstr(text, "echo $$ > '/home/p i/node-0/pid'\n"));
    assert_non_null(strstr(text, "exec '/home/p i/node-0/incode-node' --node"));
    free(text);
}

/* A shell hands the script its words as they were. */
TEST(test_command) {
    char *command = host_script_command("look", 7, "a 'b' $c");
    assert_non_null(command);
    assert_int_equal(strncmp(command, "exec sh -c ", 11), 0);
    char *last = strstr(command, " incode-deploy look 7 ");
    assert_non_null(last);
    free(command);
}

TEST(test_programs) {
    static struct host_programs programs;
    struct host_error error = {0};
    char digits[HOST_SHA256_DIGITS + 1];
    host_digest_bytes("abc", 3, digits);
    assert_string_equal(digits, "ba7816bf8f01cfea414140de5dae2223b00361a396177a"
                                "9cb410ff61f20015ad");
    assert_int_equal(host_programs_open(&programs, "/nowhere", &error), 0);
    assert_null(host_programs_take(&programs, "armv6l", &error));
    assert_int_equal(error.code, HOST_CUBE);
    assert_non_null(strstr(error.text, "armv6l"));
    error = (struct host_error){0};
    assert_null(host_programs_take(&programs, "armv7l", &error));
    assert_non_null(strstr(error.text, "/nowhere/incode-node-armhf: "));
    assert_non_null(strstr(error.text, "; make it with: make nodes FOR=armhf"));
    host_programs_free(&programs);
}

/* Where the folder lacks it, what make has made for this machine's processor,
 * and for no other. */
TEST(test_own_program) {
    static struct host_programs programs;
    struct host_error error = {0};
    struct utsname here;
    char folder[] = "/tmp/incode-programs-XXXXXX",
         digits[HOST_SHA256_DIGITS + 1];
    assert_int_equal(uname(&here), 0);
    assert_non_null(mkdtemp(folder));
    assert_int_equal(host_programs_open(&programs, NULL, &error), 0);
    assert_non_null(strstr(programs.own, "/incode-node"));
    (void)snprintf(programs.folder, sizeof programs.folder, "%s", folder);
    (void)snprintf(programs.own, sizeof programs.own, "%s/node", folder);
    FILE *made = fopen(programs.own, "w");
    assert_non_null(made);
    assert_true(fputs("abc", made) >= 0);
    assert_int_equal(fclose(made), 0);
    const struct host_program *program =
        host_programs_take(&programs, here.machine, &error);
    assert_non_null(program);
    host_digest_bytes("abc", 3, digits);
    assert_string_equal(program->digest, digits);
    bool is_riscv = strcmp(here.machine, "riscv64") == 0;
    assert_null(
        host_programs_take(&programs, is_riscv ? "x86_64" : "riscv64", &error));
    assert_non_null(strstr(error.text, "/incode-node-"));
    assert_int_equal(unlink(programs.own), 0);
    assert_int_equal(rmdir(folder), 0);
    host_programs_free(&programs);
}

TEST(test_refused) {
    static const char *const bad[] = {"ssh = \"\"",
                                      "ssh = \"-oProxyCommand=x\"",
                                      "ssh = \"a b\"",
                                      "ssh = \"a;\\\"\"",
                                      "ssh = 7",
                                      "folder = \"/x\"",
                                      "ssh = \"a\"; folder = \"\"",
                                      "ssh = \"a\"; folder = \"x\\n\"",
                                      "ssh = \"a\"; board = \"mps2-an500\""};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        static struct host_cube_file other;
        struct host_error error = {0};
        char text[400];
        snprintf(text, sizeof text,
                 "dimension = 0; nodes = ( { node = 0; %s; } );\n"
                 "links = ( { node = 0; to = \"host\"; unix = \"x\"; } );\n",
                 bad[i]);
        assert_int_equal(host_cube_file_parse(&other, "t.cube", text, &error),
                         HOST_INPUT);
        assert_int_equal(strncmp(error.text, "t.cube:1: ", 10), 0);
        assert_non_null(strstr(error.text, "; "));
    }
}

TEST_GROUP(read_cube, free_cube)
