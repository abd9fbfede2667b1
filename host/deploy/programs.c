#include "programs.h"

#include <errno.h>
#include <nettle/sha2.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/utsname.h>
#include <unistd.h>

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
    for (size_t i = 0; i < sizeof sum; i++) {
        snprintf(digits + 2 * i, 3, "%02x", sum[i]);
    }
}

int host_programs_open(struct host_programs *programs, const char *folder,
                       struct host_error *error) {
    char here[PATH_MAX - 32];
    memset(programs, 0, sizeof *programs);
    for (int i = 0; i < HOST_PROGRAMS_MAX; i++) {
        programs->program[i].processor = processors[i];
    }
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
        if (access(installed, X_OK) == 0) {
            strcpy(programs->folder, installed);
        }
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
    if (program->bytes == NULL) {
        return host_fail_memory(error, "a node program");
    }
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
    if (program->bytes != NULL) {
        return program;
    }
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
