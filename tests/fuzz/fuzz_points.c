/* Any bytes as a file of points: finite points, or an error that says so. */
#include <math.h>
#include <stdlib.h>

#include "host/mesh/points.h"

static const char *const names[] = {
    "a.xyz", "a.csv", "a.node", "a.ply", "a.off", "a.npy", "a.vtk",   "a.vtu",
    "a.vtp", "a.vts", "a.p3d",  "a.x",   "a.bin", "a.txt", "a.xyz.gz"};

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* The first byte chooses the format. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct host_points points = {0};
    struct host_error error = {0};
    if (size == 0) {
        return 0;
    }
    const char *name = names[data[0] % (sizeof names / sizeof names[0])];
    int code = host_points_parse(name, data + 1, size - 1, &points, &error);
    if (code != error.code || (code != 0) != (error.text[0] != '\0') ||
        (code != 0 && points.count != 0)) {
        abort();
    }
    for (uint64_t i = 0; i < 3 * points.count; i++) {
        if (!isfinite(points.xyz[i])) {
            abort();
        }
    }
    host_points_free(&points);
    return 0;
}
