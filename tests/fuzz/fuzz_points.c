/* Any bytes as a file of points: finite points, or an error that says so. */
#include <math.h>
#include <stdlib.h>

#include "file_name.h"
#include "host/formats/read.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* The first byte chooses the format. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    struct host_points points = {0};
    struct host_error error = {0};
    char name[FILE_NAME_MAX];
    if (size == 0)
        return 0;
    file_name(HOST_READ_POINTS, data[0], name);
    int code = host_points_parse(name, data + 1, size - 1, &points, &error);
    if (code != error.code || (code != 0) != (error.text[0] != '\0') ||
        (code != 0 && points.count != 0))
        abort();
    for (uint64_t i = 0; i < 3 * points.count; i++)
        if (!isfinite(points.xyz[i]))
            abort();
    host_points_free(&points);
    return 0;
}
