/* Any bytes as a file of tetrahedra: rows, or an error that says so; and rows
 * can always be sorted and digested. */
#include <stdlib.h>

#include "file_name.h"
#include "host/formats/read.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* The first byte chooses the format. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    struct host_points points = {0};
    struct host_tetrahedra tets = {0};
    struct host_error error = {0};
    struct host_digest digest;
    char name[FILE_NAME_MAX];
    if (size == 0)
        return 0;
    file_name(HOST_READ_TETRAHEDRA, data[0], name);
    int code =
        host_tetrahedra_parse(name, data + 1, size - 1, &tets, &points, &error);
    if (code != error.code || (code != 0) != (error.text[0] != '\0'))
        abort();
    if (code == 0) {
        host_tetrahedra_sort(&tets);
        host_digest(&tets, &digest);
    }
    host_tetrahedra_free(&tets);
    host_points_free(&points);
    return 0;
}
