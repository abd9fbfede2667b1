/* Any bytes as a file of tetrahedra: rows, or an error that says so; and rows
 * can always be sorted and digested. */
#include <stdlib.h>

#include "host/mesh/points.h"
#include "host/mesh/tetrahedra.h"

static const char *const names[] = {"a.ele", "a.vtu",  "a.vtk",
                                    "a.msh", "a.mesh", "a.npy"};

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* The first byte chooses the format. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct host_points points = {0};
    struct host_tetrahedra tets = {0};
    struct host_error error = {0};
    struct host_digest digest;
    if (size == 0) {
        return 0;
    }
    const char *name = names[data[0] % (sizeof names / sizeof names[0])];
    int code =
        host_tetrahedra_parse(name, data + 1, size - 1, &tets, &points, &error);
    if (code != error.code || (code != 0) != (error.text[0] != '\0')) {
        abort();
    }
    if (code == 0) {
        host_tetrahedra_sort(&tets);
        host_digest(&tets, &digest);
    }
    host_tetrahedra_free(&tets);
    host_points_free(&points);
    return 0;
}
