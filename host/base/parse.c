#include "parse.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

int host_parse_number(const char *text, uint64_t lo, uint64_t hi,
                      uint64_t *number)
{
    char *end;
    errno = 0;
    if (*text < '0' || *text > '9') {
        return -1;
    }
    unsigned long long value = strtoull(text, &end, 10);
    if (errno != 0 || *end != '\0' || value < lo || value > hi) {
        return -1;
    }
    *number = value;
    return 0;
}

int host_parse_bytes(const char *text, uint64_t *bytes)
{
    char *end;
    errno = 0;
    if (*text < '0' || *text > '9') {
        return -1;
    }
    unsigned long long value = strtoull(text, &end, 10);
    unsigned shift = 0;
    if (*end != '\0') {
        static const char units[] = "KMG";
        const char *unit = strchr(units, *end >= 'a' ? *end - 32 : *end);
        if (unit == NULL) {
            return -1;
        }
        shift = 10 * (unsigned)(unit - units + 1);
        end += strcmp(end + 1, "iB") == 0 ? 3 : 1;
    }
    if (errno != 0 || *end != '\0' || value > UINT64_MAX >> 20 >> shift) {
        return -1;
    }
    *bytes = (uint64_t)value << shift;
    return 0;
}
