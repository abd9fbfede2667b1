#include "error.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "parallel.h"
#include "scratch.h"
#include "text.h"

int host_fail(struct host_error *error, int code, const char *format, ...) {
    if (error->code != 0)
        return error->code;
    char raw[sizeof error->text];
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(raw, sizeof raw, format, arguments);
    va_end(arguments);
    error->code = code;
    /* One line, whatever a name, a token or a node's fault holds. */
    host_text_printable(error->text, sizeof error->text, raw);
    return code;
}

int host_fail_memory(struct host_error *error, const char *what) {
    const struct host_call *call = host_call();
    if (call != NULL && call->scratch != NULL && call->scratch->failure != 0) {
        const struct host_scratch *scratch = call->scratch;
        return host_fail(
            error, HOST_INPUT,
            "%s: no room for %s, %llu bytes beside the %llu that "
            "are put aside here (%s); free some on its file "
            "system, or give another as --scratch DIR",
            scratch->directory, what, (unsigned long long)scratch->wanted,
            (unsigned long long)scratch->bytes, strerror(scratch->failure));
    }
    return host_fail(error, HOST_BROKEN,
                     "host: no memory for %s; free some memory or take a "
                     "machine with more",
                     what);
}

/* --- clock ---------------------------------------------------------------- */

uint64_t host_now_us(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
}
