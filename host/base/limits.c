#include "limits.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "memory.h"
#include "parallel.h"
#include "progress.h"
#include "scratch.h"

static struct host_call call;
static struct host_scratch scratch;
static uint64_t reserved; /* bytes that were checked to be free */

/* Where to put aside what is not said. */
static const char *folder_for(const char *output) {
    static char folder[4096];
    const char *temporary = getenv("TMPDIR");
    if (temporary != NULL && temporary[0] != '\0')
        return temporary;
    if (output == NULL || strcmp(output, "-") == 0)
        return "/tmp";
    const char *slash = strrchr(output, '/');
    (void)snprintf(folder, sizeof folder, "%.*s",
                   slash == NULL ? 1 : (int)(slash - output) + 1,
                   slash == NULL ? "." : output);
    return folder;
}

/* Bytes that a command takes for each of its file: 170 for a point (incode.h),
 * which has 24 or more in most files, packed ones a fourth of that. */
enum { TAKEN = 7, UNPACKED = 4 };

/* Of the limit that a pipe has where none is given, arrays take so large a part
 * in memory before any is put aside: one in so many. */
enum { PIPE_FIRST = 2 };

/* The limit where none is given; 0: all fits.  *is_pipe: its input's size is
 * not known. */
static uint64_t limit_for(const char *input, bool *is_pipe) {
    struct stat about;
    uint64_t half = host_memory_available() / 2;
    bool standard = input != NULL && strcmp(input, "-") == 0;
    if (input == NULL ||
        (standard ? fstat(STDIN_FILENO, &about) : stat(input, &about)) != 0)
        return 0;
    *is_pipe = !S_ISREG(about.st_mode);
    size_t length = strlen(input), end = strlen(".gz");
    bool packed = length > end && strcasecmp(input + length - end, ".gz") == 0;
    uint64_t need = (uint64_t)about.st_size * TAKEN * (packed ? UNPACKED : 1);
    return !*is_pipe && need < half   ? 0
           : half > HOST_RESIDENT_MIN ? half
                                      : HOST_RESIDENT_MIN;
}

enum { PATIENCE_S = 10 };

/* Files that may be open at a time: an array each, besides all others. */
static void allow_files(void) {
    struct rlimit files;
    if (getrlimit(RLIMIT_NOFILE, &files) == 0 &&
        files.rlim_cur < 2 * HOST_SCRATCH_ARRAYS) {
        files.rlim_cur = files.rlim_max < 2 * HOST_SCRATCH_ARRAYS
                             ? files.rlim_max
                             : 2 * HOST_SCRATCH_ARRAYS;
        (void)setrlimit(RLIMIT_NOFILE, &files);
    }
}

/* A page of what is put aside is not to be had: its disk fails, or the file was
 * cut.  Ends the program as SIGTERM does, which removes unfinished outputs. */
static void on_fault(int number) {
    static const char what[] =
        ": what was put aside here cannot be read or written any more; look "
        "after its disk, or give another folder as --scratch DIR\n";
    (void)number;
    host_progress_erase();
    (void)!write(STDERR_FILENO, "incode: ", strlen("incode: "));
    (void)!write(STDERR_FILENO, scratch.directory, strlen(scratch.directory));
    (void)!write(STDERR_FILENO, what, sizeof what - 1);
    (void)kill(getpid(), SIGTERM);
    (void)sleep(PATIENCE_S); /* unless the signal is ignored */
    _exit(HOST_BROKEN);
}

static int begin_scratch(const char *folder, uint64_t memory, unsigned threads,
                         struct host_error *error) {
    const struct sigaction action = {.sa_handler = on_fault};
    uint64_t most = memory / HOST_RESIDENT_MIN;
    /* Each takes as much as one does. */
    call.threads = most < threads ? (unsigned)most : threads;
    if (host_scratch_begin(&scratch, folder, memory, call.threads, error) !=
        0) {
        call.threads = threads;
        return error->code;
    }
    call.scratch = &scratch;
    allow_files();
    (void)sigaction(SIGBUS, &action, NULL);
    return 0;
}

int host_limits_enter(const struct host_limits *limits, unsigned threads,
                      const char *input, const char *output,
                      struct host_error *error) {
    bool is_pipe = false;
    uint64_t memory =
        limits->memory > 0 ? limits->memory : limit_for(input, &is_pipe);
    const char *folder =
        limits->folder == NULL ? folder_for(output) : limits->folder;
    threads = threads == 0 ? host_processors() : threads;
    memset(&call, 0, sizeof call);
    reserved = 0;
    call.threads = threads;
    call.memory_max = UINT64_MAX;
    if (memory > 0 && begin_scratch(folder, memory, threads, error) != 0) {
        if (!is_pipe) /* which may bring little */
            return error->code;
        *error = (struct host_error){0};
    } else if (is_pipe) {
        scratch.memory_first = memory / PIPE_FIRST;
    }
    host_call_enter(&call);
    return 0;
}

uint64_t host_limits_memory(void) {
    return host_call() == &call && call.scratch != NULL ? scratch.resident_max
                                                        : 0;
}

uint64_t host_limits_reserved(dev_t device) {
    struct stat about;
    return host_call() == &call && call.scratch != NULL &&
                   stat(scratch.directory, &about) == 0 &&
                   about.st_dev == device
               ? reserved
               : 0;
}

int host_limits_check(uint64_t need, bool noted, struct host_error *error) {
    const double mb = 1e6;
    if (host_call() != &call || call.scratch == NULL)
        return 0;
    uint64_t room = host_scratch_free(&scratch) + scratch.bytes;
    if (need <= scratch.memory_first)
        return 0;
    reserved = need;
    if (room < need) {
        return host_fail(error, HOST_INPUT,
                         "%s: %.0f MB are free on its file system, and %.0f MB "
                         "may be put aside; free some, or give another as "
                         "--scratch DIR",
                         scratch.directory, (double)room / mb,
                         (double)need / mb);
    }
    if (noted) {
        host_note("up to %.0f MB are put aside in %s%s", (double)need / mb,
                  scratch.directory,
                  host_scratch_in_memory(&scratch)
                      ? ", which is itself in memory; a folder on a disk is "
                        "given as --scratch DIR"
                      : "");
    }
    return 0;
}

uint64_t host_limits_leave(void) {
    uint64_t most = 0;
    if (host_call() != &call)
        return 0;
    host_call_enter(NULL);
    if (call.scratch != NULL) {
        (void)signal(SIGBUS, SIG_DFL);
        most = scratch.bytes_max;
        host_scratch_end(&scratch);
    }
    return most;
}
