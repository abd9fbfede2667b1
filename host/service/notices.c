#include "notices.h"

#include <stdarg.h>
#include <stdio.h>

#include "failure_detector.h"
#include "host/base/progress.h"

void host_notice_line(struct host_service *service, const char *line) {
    struct host_service *s = service;
    if (s->machine->told != NULL) {
        s->machine->told(s->machine->context, line);
        return;
    }
    host_note("%s", line);
}

static void notice(struct host_service *s, unsigned node, unsigned link,
                   const char *format, va_list arguments) {
    char line[HOST_NOTICE_BYTES];
    int at = snprintf(line, sizeof line, "node %u link %u: ", node, link);
    (void)vsnprintf(line + at, sizeof line - (size_t)at, format, arguments);
    host_notice_line(s, line);
}

void host_notice(struct host_service *service, unsigned node,
                 const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    notice(service, node, host_detector_link(service, node), format, arguments);
    va_end(arguments);
}

void host_notice_of(struct host_service *service, unsigned node, unsigned link,
                    const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    notice(service, node, link, format, arguments);
    va_end(arguments);
}
