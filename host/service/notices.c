#include "notices.h"

#include <stdarg.h>
#include <stdio.h>

#include "failure_detector.h"
#include "host/base/progress.h"

void host_notice_line(struct host_service *service, const char *line)
{
    struct host_service *s = service;
    if (s->machine->told != NULL) {
        s->machine->told(s->machine->context, line);
        return;
    }
    host_note("%s", line);
}

void host_notice(struct host_service *service, unsigned node,
                 const char *format, ...)
{
    char line[HOST_NOTICE_BYTES];
    va_list arguments;
    int at = snprintf(line, sizeof line, "node %u link %u: ", node,
                      host_detector_link(service, node));
    va_start(arguments, format);
    (void)vsnprintf(line + at, sizeof line - (size_t)at, format, arguments);
    va_end(arguments);
    host_notice_line(service, line);
}
