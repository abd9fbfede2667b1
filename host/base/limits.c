#include "limits.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#include "memory.h"
#include "parallel.h"
#include "progress.h"
#include "scratch.h"

static struct host_call call;
static struct host_scratch scratch;

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

/* The limit where none is given; 0: all fits. */
static uint64_t limit_for(const char *input) {
    struct stat about;
    uint64_t half = host_memory_available() / 2;
    if (input == NULL || stat(input, &about) != 0 || !S_ISREG(about.st_mode))
        return 0;
    size_t length = strlen(input), end = strlen(".gz");
    bool packed = length > end && strcasecmp(input + length - end, ".gz") == 0;
    uint64_t need = (uint64_t)about.st_size * TAKEN * (packed ? UNPACKED : 1);
    return need < half                ? 0
           : half > HOST_RESIDENT_MIN ? half
                                      : HOST_RESIDENT_MIN;
}

int host_limits_enter(const struct host_limits *limits, unsigned threads,
                      const char *input, const char *output,
                      struct host_error *error) {
    uint64_t memory = limits->memory > 0 ? limits->memory : limit_for(input);
    uint64_t most = memory / HOST_RESIDENT_MIN;
    const char *folder =
        limits->folder == NULL ? folder_for(output) : limits->folder;
    threads = threads == 0 ? host_processors() : threads;
    memset(&call, 0, sizeof call);
    call.threads = threads;
    call.memory_max = UINT64_MAX;
    if (memory > 0) {
        /* Each takes as much as one does. */
        call.threads = most < threads ? (unsigned)most : threads;
        if (host_scratch_begin(&scratch, folder, memory, call.threads, error) !=
            0)
            return error->code;
        call.scratch = &scratch;
    }
    host_call_enter(&call);
    return 0;
}

uint64_t host_limits_memory(void) {
    return host_call() == &call && call.scratch != NULL ? scratch.resident_max
                                                        : 0;
}

int host_limits_check(uint64_t need, bool noted, struct host_error *error) {
    const double mb = 1e6;
    if (host_call() != &call || call.scratch == NULL)
        return 0;
    uint64_t room = host_scratch_free(&scratch) + scratch.bytes;
    if (room < need) {
        return host_fail(error, HOST_INPUT,
                         "%s: %.0f MB are free on its file system, and %.0f MB "
                         "may be put aside; free some, or give another as "
                         "--scratch DIR",
                         scratch.directory, (double)room / mb,
                         (double)need / mb);
    }
    if (noted)
        host_note("up to %.0f MB are put aside in %s", (double)need / mb,
                  scratch.directory);
    return 0;
}

uint64_t host_limits_leave(void) {
    uint64_t most = 0;
    if (host_call() != &call)
        return 0;
    host_call_enter(NULL);
    if (call.scratch != NULL) {
        most = scratch.bytes_max;
        host_scratch_end(&scratch);
    }
    return most;
}
