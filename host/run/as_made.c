#include "as_made.h"

#include "host/formats/write.h"
#include "state.h"

static struct host_row_output output[HOST_OUTPUTS_MAX];
static unsigned outputs;
static uint64_t made;
static bool streams;

int host_as_made_check(const struct host_run_options *options,
                       struct host_error *error) {
    char name[HOST_PATH_MAX];
    for (unsigned i = 0; i < options->outputs; i++) {
        const char *path = options->output[i];
        if (options->row_order == HOST_AS_MADE &&
            host_write_file(path, 1, name, sizeof name) != NULL) {
            return host_fail(
                error, HOST_USAGE,
                "%s: the files beside it number tetrahedra in canonical order; "
                "leave --order as-made out, or write another format, or .ele "
                "to standard output: -o - > %s",
                path, path);
        }
    }
    return 0;
}

/* The sink: by any thread, one at a time. */
static void put(void *context, const uint32_t (*v)[4], uint64_t count) {
    (void)context;
    for (unsigned i = 0; i < outputs; i++) {
        host_rows_put(&output[i], v, count);
        if (output[i].out.failure != 0)
            host_call()->cancelled = true; /* the rest is of no use */
    }
    made += count;
}

int host_as_made_fail(struct host_error *error) {
    struct host_error why = {0};
    for (unsigned i = 0; i < outputs; i++)
        if (output[i].out.failure != 0)
            host_rows_close(&output[i], &why);
    if (why.code != 0)
        *error = why;
    return error->code;
}

int host_as_made_begin(const struct host_run_options *options,
                       const struct host_points *points,
                       struct host_direct_sums *sums,
                       struct host_error *error) {
    bool can = options->row_order == HOST_AS_MADE && options->stats == NULL &&
               options->verifying != HOST_VERIFY_ALWAYS &&
               !host_state_is_resumed(options->state);
    for (unsigned i = 0; i < options->outputs; i++)
        can = can && host_rows_can(options->output[i]);
    if (!can)
        return 0;
    for (; outputs < options->outputs; outputs++)
        if (host_rows_open(&output[outputs], options->output[outputs], points,
                           error) != 0)
            return error->code;
    streams = true;
    sums->sink =
        (struct host_sink){.put = put, .lock = PTHREAD_MUTEX_INITIALIZER};
    return 0;
}

bool host_as_made_end(struct host_tetrahedra *tets,
                      struct host_run_result *result,
                      struct host_error *error) {
    enum { BLOCK = 1 << 12 };
    for (unsigned i = 0; i < outputs; i++)
        host_rows_close(&output[i], error);
    if (streams)
        result->tetrahedra = made;
    for (uint64_t i = 0; i < tets->count; i += BLOCK) {
        uint64_t n = tets->count - i < BLOCK ? tets->count - i : BLOCK;
        host_tetrahedra_canonical(tets->v + i, n);
        host_call_trim((size_t)n * sizeof *tets->v);
    }
    return streams;
}
