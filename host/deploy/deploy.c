#include "deploy.h"

#include <errno.h>
#include <nettle/sha2.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/utsname.h>
#include <unistd.h>

#include "board.h"
#include "host/base/node_set.h"
#include "host/base/options.h"
#include "host/base/text.h"

enum { PROGRAM_MAX = 64 << 20 };

/* As kernels name their machines, and as make nodes names its programs.  A
 * 64-bit kernel runs the static program of its own, whatever its system is. */
static const struct {
    const char *machine, *processor;
} names[] = {{"x86_64", "x86_64"}, {"aarch64", "aarch64"},
             {"arm64", "aarch64"}, {"armv7l", "armhf"},
             {"armv8l", "armhf"},  {"riscv64", "riscv64"}};

static const char *const processors[HOST_PROGRAMS_MAX] = {"x86_64", "aarch64",
                                                          "armhf", "riscv64"};

void host_digest_bytes(const void *bytes, size_t size,
                       char digits[HOST_SHA256_DIGITS + 1]) {
    struct sha256_ctx sha;
    uint8_t sum[SHA256_DIGEST_SIZE];
    sha256_init(&sha);
    sha256_update(&sha, size, bytes);
    sha256_digest(&sha, sizeof sum, sum);
    for (size_t i = 0; i < sizeof sum; i++)
        snprintf(digits + 2 * i, 3, "%02x", sum[i]);
}

int host_programs_open(struct host_programs *programs, const char *folder,
                       struct host_error *error) {
    char here[PATH_MAX - 32];
    memset(programs, 0, sizeof *programs);
    for (int i = 0; i < HOST_PROGRAMS_MAX; i++)
        programs->program[i].processor = processors[i];
    if (folder != NULL) {
        snprintf(programs->folder, sizeof programs->folder, "%s", folder);
        return 0;
    }
    ssize_t length = readlink("/proc/self/exe", here, sizeof here - 1);
    if (length <= 0) {
        return host_fail(error, HOST_BROKEN,
                         "/proc/self/exe: %s; is /proc "
                         "mounted?",
                         strerror(errno));
    }
    here[length] = '\0';
    *strrchr(here, '/') = '\0';
    snprintf(programs->folder, sizeof programs->folder, "%s/nodes", here);
    snprintf(programs->own, sizeof programs->own, "%s/incode-node", here);
    if (access(programs->folder, X_OK) != 0) {
        char installed[PATH_MAX];
        snprintf(installed, sizeof installed, "%s/../lib/incode", here);
        if (access(installed, X_OK) == 0)
            strcpy(programs->folder, installed);
    }
    return 0;
}

void host_programs_free(struct host_programs *programs) {
    for (int i = 0; i < HOST_PROGRAMS_MAX; i++) {
        free(programs->program[i].bytes);
        programs->program[i].bytes = NULL;
    }
}

static int read_program(struct host_program *program, FILE *file,
                        const char *path, struct host_error *error) {
    struct stat about;
    bool good = fstat(fileno(file), &about) == 0 && S_ISREG(about.st_mode) &&
                about.st_size > 0 && about.st_size <= PROGRAM_MAX;
    if (!good) {
        return host_fail(error, HOST_CUBE,
                         "%s: no program; make it with: make nodes", path);
    }
    program->size = (size_t)about.st_size;
    program->bytes = malloc(program->size);
    if (program->bytes == NULL)
        return host_fail_memory(error, "a node program");
    if (fread(program->bytes, 1, program->size, file) != program->size) {
        free(program->bytes);
        program->bytes = NULL;
        return host_fail(error, HOST_CUBE,
                         "%s: not readable to its end; make it with: make "
                         "nodes",
                         path);
    }
    host_digest_bytes(program->bytes, program->size, program->digest);
    return 0;
}

/* That of a machine; NULL: there is none. */
static struct host_program *program_of(struct host_programs *programs,
                                       const char *machine) {
    struct host_program *program = NULL;
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        for (int k = 0; k < HOST_PROGRAMS_MAX; k++) {
            bool mine = strcmp(names[i].machine, machine) == 0 &&
                        strcmp(names[i].processor, processors[k]) == 0;
            program = mine ? &programs->program[k] : program;
        }
    }
    return program;
}

static bool is_own(struct host_programs *programs,
                   const struct host_program *program) {
    struct utsname here;
    return programs->own[0] != '\0' && uname(&here) == 0 &&
           program_of(programs, here.machine) == program;
}

const struct host_program *host_programs_take(struct host_programs *programs,
                                              const char *machine,
                                              struct host_error *error) {
    struct host_program *program = program_of(programs, machine);
    char path[PATH_MAX + 64];
    if (program == NULL) {
        host_fail(error, HOST_CUBE,
                  "its processor is %.40s, for which there is no node program; "
                  "take a board with x86_64, aarch64, armv7l or riscv64",
                  machine);
        return NULL;
    }
    if (program->bytes != NULL)
        return program;
    snprintf(path, sizeof path, "%s/incode-node-%s", programs->folder,
             program->processor);
    FILE *file = fopen(path, "rbe");
    if (file == NULL && errno == ENOENT && is_own(programs, program)) {
        snprintf(path, sizeof path, "%s", programs->own);
        file = fopen(path, "rbe");
    }
    if (file == NULL) {
        host_fail(error, HOST_CUBE, "%s: %s; make it with: make nodes FOR=%s",
                  path, strerror(errno), program->processor);
        return NULL;
    }
    int status = read_program(program, file, path, error);
    (void)fclose(file);
    return status == 0 ? program : NULL;
}

/* --- deploy --------------------------------------------------------------- */

enum { DEPLOY_AT_ONCE = 64 };

struct deploy {
    struct host_deploy_job job;
    const char *cube, *nodes, *programs;
    bool quiet, ordered;
    struct host_error *error;
};

static void take_order(struct deploy *d, enum host_deploy_order order,
                       struct host_error *error) {
    if (d->ordered && d->job.order != order) {
        host_fail(error, HOST_USAGE,
                  "deploy: --status, --update and --remove are different "
                  "orders; give one of them");
    }
    d->ordered = true;
    d->job.order = order;
}

static void take_status(void *into, const char *value,
                        struct host_error *error) {
    (void)value;
    take_order(into, HOST_STATUS, error);
}

static void take_update(void *into, const char *value,
                        struct host_error *error) {
    (void)value;
    take_order(into, HOST_DEPLOY, error);
}

static void take_remove(void *into, const char *value,
                        struct host_error *error) {
    (void)value;
    take_order(into, HOST_REMOVE, error);
}

static const struct host_option rows[] = {
    {"cube", 0, "FILE",
     "The cube; its nodes that have ssh = \"USER@ADDRESS\" are those meant",
     HOST_AT(struct deploy, cube)},
    {"nodes", 0, "SET", "Only these, as in 0-3,7",
     HOST_AT(struct deploy, nodes)},
    {"update", 0, NULL,
     "Copy what differs from here, and start the node anew where anything did: "
     "the default",
     .take = take_update},
    {"status", 0, NULL, "Say what is there and whether it runs",
     .take = take_status},
    {"remove", 0, NULL, "Stop the node and take all of it away",
     .take = take_remove},
    {"dry-run", 0, NULL, "Look, and say what would be done; nothing changes",
     HOST_AT(struct deploy, job.dry_run)},
    {"programs", 0, "FOLDER",
     "Where the programs of make nodes are, incode-node-aarch64 and the like",
     HOST_AT(struct deploy, programs)},
    {"ssh-config", 0, "FILE", "Have ssh read this file, as with its -F",
     HOST_AT(struct deploy, job.ssh_config)},
    {"quiet", 'q', NULL, "Say only what is wrong",
     HOST_AT(struct deploy, quiet)},
    {0}};

/* --- which ---------------------------------------------------------------- */

/* Whether there is a program of that name: it is a package of its own. */
static int check_ssh(struct host_error *error) {
    static const char usual[] = "/usr/local/bin:/usr/bin:/bin";
    const char *path = getenv("PATH");
    char name[4096];
    for (const char *at = path == NULL ? usual : path; at != NULL;) {
        int length = (int)strcspn(at, ":");
        snprintf(name, sizeof name, "%.*s/ssh", length, at);
        if (access(name, X_OK) == 0)
            return 0;
        at = at[length] == ':' ? at + length + 1 : NULL;
    }
    return host_fail(error, HOST_BROKEN,
                     "ssh: not found; install the package openssh-client");
}

/* The nodes that are meant and have a board to log in to. */
static int choose(const struct deploy *d, const struct host_cube_file *file,
                  struct host_node_set *chosen) {
    struct host_node_set wanted;
    memset(chosen, 0, sizeof *chosen);
    host_node_set_all(&wanted, file->nodes);
    if (d->nodes != NULL &&
        host_node_set_parse(&wanted, d->nodes, file->nodes, d->error) != 0)
        return d->error->code;
    for (unsigned i = 0; i < file->nodes; i++) {
        bool there = host_cube_ssh(file, i) != NULL;
        if (host_node_set_has(&wanted, i) && there) {
            host_node_set_add(chosen, i);
        } else if (host_node_set_has(&wanted, i) && d->nodes != NULL) {
            return host_fail(d->error, HOST_INPUT,
                             "%s: node %u has no ssh; add { node = %u; ssh = "
                             "\"pi@10.0.0.11\"; } to nodes, or leave it out of "
                             "--nodes",
                             file->path, i, i);
        }
    }
    return host_node_set_count(chosen) > 0
               ? 0
               : host_fail(
                     d->error, HOST_INPUT,
                     "%s: no node has ssh; write nodes = ( { node = 0; ssh "
                     "= \"pi@10.0.0.11\"; }, .. );",
                     file->path);
}

/* --- all of them ---------------------------------------------------------- */

struct boards {
    struct host_deploy_board *board;
    unsigned count, begun;
};

/* Begins as many as there is room for; how many are at work. */
static unsigned begin_more(struct boards *boards, struct deploy *d) {
    unsigned at_work = 0;
    for (unsigned i = 0; i < boards->begun; i++)
        at_work += !boards->board[i].ended;
    while (boards->begun < boards->count && at_work < DEPLOY_AT_ONCE) {
        struct host_deploy_board *board = &boards->board[boards->begun++];
        at_work += host_board_begin(board, &d->job, board->node) == 0;
    }
    return at_work;
}

static void run(struct boards *boards, struct deploy *d,
                const struct host_deploy_lines *lines) {
    struct pollfd files[DEPLOY_AT_ONCE * HOST_BOARD_FILES];
    while (begin_more(boards, d) > 0) {
        unsigned count = 0, at = 0;
        for (unsigned i = 0; i < boards->begun; i++)
            count += host_board_files(&boards->board[i], files + count);
        if (poll(files, count, 1000) < 0 && errno != EINTR)
            continue;
        for (unsigned i = 0; i < boards->begun; i++) {
            struct pollfd mine[HOST_BOARD_FILES];
            unsigned n = host_board_files(&boards->board[i], mine);
            if (!boards->board[i].ended)
                host_board_step(&boards->board[i], &d->job, files + at, n);
            at += n;
        }
        host_deploy_lines_show(lines, boards->board, boards->count);
    }
}

/* Which failed, or do not run. */
static int conclude(const struct boards *boards, const struct deploy *d) {
    struct host_node_set failed = {{0}}, stopped = {{0}};
    char text[120], name[128];
    for (unsigned i = 0; i < boards->count; i++) {
        const struct host_deploy_board *board = &boards->board[i];
        if (board->error.code != 0)
            host_node_set_add(&failed, board->node);
        else if (d->job.order == HOST_STATUS && !board->running)
            host_node_set_add(&stopped, board->node);
    }
    if (host_node_set_count(&failed) > 0) {
        host_node_set_print(&failed, text, sizeof text);
        host_node_set_name(&failed, name, sizeof name);
        return host_fail(d->error, HOST_CUBE,
                         "%s: %u of %u board%s failed, %s; do what is said "
                         "above, and repeat it with --nodes %s",
                         d->cube, host_node_set_count(&failed), boards->count,
                         host_text_s(boards->count), name, text);
    }
    if (host_node_set_count(&stopped) > 0) {
        bool one = host_node_set_count(&stopped) == 1;
        host_node_set_print(&stopped, text, sizeof text);
        host_node_set_name(&stopped, name, sizeof name);
        return host_fail(d->error, HOST_CUBE,
                         "%s: %s %s not run; start %s with: incode deploy "
                         "--cube %s --nodes %s",
                         d->cube, name, one ? "does" : "do",
                         one ? "it" : "them", d->cube, text);
    }
    return 0;
}

static int deploy(struct deploy *d, const struct host_node_set *chosen) {
    struct host_deploy_lines lines;
    struct boards boards = {.count = host_node_set_count(chosen)};
    boards.board = calloc(boards.count, sizeof *boards.board);
    if (boards.board == NULL)
        return host_fail_memory(d->error, "the boards");
    for (unsigned i = 0, at = 0; i < d->job.file->nodes; i++) {
        if (host_node_set_has(chosen, i)) {
            boards.board[at].to = host_cube_ssh(d->job.file, i)->to;
            snprintf(boards.board[at].step, sizeof boards.board[at].step,
                     "waiting");
            boards.board[at++].node = i;
        }
    }
    (void)signal(SIGPIPE, SIG_IGN);
    host_deploy_lines_begin(&lines, boards.count, d->quiet);
    run(&boards, d, &lines);
    host_deploy_lines_end(&lines, boards.board, boards.count);
    int status = conclude(&boards, d);
    for (unsigned i = 0; i < boards.count; i++)
        host_board_free(&boards.board[i]);
    free(boards.board);
    return status;
}

int host_deploy(int argc, char **argv, struct host_error *error) {
    static const struct host_options options = {
        .rows = rows,
        .refusal = "one argument too many; give --cube FILE",
        .arguments = "",
        .about =
            "Puts the node program on boards with Linux, over ssh, and starts "
            "it there: under systemd, at every boot, where that runs.\v"
            "A cube file says where a node's board is:\n"
            "  nodes = ( { node = 0; ssh = \"pi@10.0.0.11\"; }, .. );\n"
            "ssh must be able to log in without a question: see "
            "ssh-copy-id(1).\n\n"
            "Example:\n"
            "  incode deploy --cube lab.cube --dry-run\n"
            "  incode deploy --cube lab.cube\n"
            "  incode run points.xyz --cube lab.cube"};
    static struct host_cube_file file;
    static struct host_programs programs;
    struct deploy d = {.error = error};
    struct host_node_set chosen;
    if (host_options_parse(&options, argc, argv, false, &d, NULL, error) != 0)
        return error->code;
    if (d.cube == NULL) {
        return host_fail(error, HOST_USAGE,
                         "deploy: --cube FILE is missing; write one with: "
                         "incode cube --new");
    }
    if (check_ssh(error) != 0 || host_cube_file_read(&file, d.cube, error) != 0)
        return error->code;
    d.job.file = &file;
    d.job.programs = &programs;
    int status = choose(&d, &file, &chosen);
    if (status == 0)
        status = host_programs_open(&programs, d.programs, error);
    if (status == 0)
        status = deploy(&d, &chosen);
    host_programs_free(&programs);
    host_cube_file_free(&file);
    return status;
}
