#include "error.h"

#include <stdarg.h>
#include <stdio.h>

int host_fail(struct host_error *error, int code, const char *format, ...)
{
    if (error->code != 0) {
        return error->code;
    }
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(error->text, sizeof error->text, format, arguments);
    va_end(arguments);
    error->code = code;
    for (char *c = error->text; *c != '\0'; c++) {
        if ((unsigned char)*c < 0x20 || *c == 0x7f) {
            *c = '?'; /* one line, whatever a file name or token holds */
        }
    }
    return code;
}

int host_fail_memory(struct host_error *error, const char *what)
{
    return host_fail(error, HOST_BROKEN,
                     "host: no memory for %s; free some memory or take a "
                     "machine with more",
                     what);
}
