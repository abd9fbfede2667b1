#include "verify.h"

#include "host/base/memory.h"
#include "host/mesh/duplicates.h"

int host_verify(const struct host_points *points,
                const struct host_tetrahedra *tets, enum host_check_depth depth,
                struct host_check_report *report, struct host_error *error) {
    size_t rows = (size_t)points->count;
    uint32_t *lowest = host_map(rows * sizeof *lowest);
    struct host_sites sites = {
        .xyz = points->xyz, .lowest = lowest, .count = rows};
    if (lowest == NULL ||
        (rows > 0 && host_distinct_rows(points->xyz, rows, lowest) == 0)) {
        host_fail_memory(error, "the check");
    } else {
        host_check(&sites, tets, depth, NULL, report, error);
    }
    host_unmap(lowest, rows * sizeof *lowest);
    return error->code;
}
