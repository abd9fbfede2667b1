#include "limit.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "host/base/progress.h"
#include "host/formats/write.h"

/* Where to put aside what is not said: where the first output goes, else /tmp.
 */
static const char *scratch_folder(const struct host_run_options *options) {
    static char folder[HOST_PATH_MAX];
    const char *temporary = getenv("TMPDIR");
    const char *output = options->outputs > 0 ? options->output[0] : "-";
    if (options->scratch != NULL)
        return options->scratch;
    if (temporary != NULL && temporary[0] != '\0')
        return temporary;
    const char *slash = strrchr(output, '/');
    if (strcmp(output, "-") == 0)
        return "/tmp";
    (void)snprintf(folder, sizeof folder, "%.*s",
                   slash == NULL ? 1 : (int)(slash - output) + 1,
                   slash == NULL ? "." : output);
    return folder;
}

int host_limit_begin(const struct host_run_options *options,
                     struct host_call *call, struct host_scratch *scratch,
                     struct host_error *error) {
    *call = (struct host_call){
        .threads = options->threads == 0 ? host_processors() : options->threads,
        .memory_max = UINT64_MAX};
    if (options->host_memory > 0) {
        /* Each takes as much as one does. */
        uint64_t most = options->host_memory / HOST_RESIDENT_MIN;
        call->threads = most < call->threads ? (unsigned)most : call->threads;
        if (host_scratch_begin(scratch, scratch_folder(options),
                               options->host_memory, call->threads, error) != 0)
            return error->code;
        call->scratch = scratch;
    }
    if (options->direct)
        host_call_enter(call);
    return 0;
}

int host_limit_check(const struct host_run_options *options,
                     const struct host_scratch *scratch, uint64_t points,
                     struct host_error *error) {
    /* At most the tetrahedra of a volume twice over, and the points in order.
     */
    enum { POINT_BYTES = 320 };
    const double mb = 1e6;
    uint64_t need = points * POINT_BYTES;
    uint64_t room = host_scratch_free(scratch) + scratch->bytes;
    if (room < need) {
        return host_fail(error, HOST_INPUT,
                         "%s: %.0f MB are free on its file system, and %.0f MB "
                         "may be put aside; free some, or give another as "
                         "--scratch DIR",
                         scratch->directory, (double)room / mb,
                         (double)need / mb);
    }
    if (!options->quiet)
        host_note("up to %.0f MB are put aside in %s", (double)need / mb,
                  scratch->directory);
    return 0;
}

void host_limit_end(struct host_call *call, struct host_run_result *result) {
    host_call_enter(NULL);
    if (call->scratch != NULL) {
        result->scratch_bytes = call->scratch->bytes_max;
        host_scratch_end(call->scratch);
    }
}
