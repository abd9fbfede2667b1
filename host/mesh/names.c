#include "names.h"

#include <stddef.h>

#include "incode/triangulator.h"
#include "order.h"

const char *const host_partitions[] = {
    [HOST_ADAPTIVE] = "adaptive", [HOST_UNIFORM] = "uniform", NULL};
const char *const host_indexes[] = {
    [INCODE_NAIVE] = "naive", [INCODE_GRID] = "grid", [INCODE_KD] = "kd", NULL};
const char *const host_face_rules[] = {
    [INCODE_FACE_OWN] = "own", [INCODE_FACE_PAPER] = "paper", NULL};
const char *const host_builds[] = {[INCODE_BUILD_AUTO] = "auto",
                                   [INCODE_BUILD_FACES] = "faces",
                                   [INCODE_BUILD_POINTS] = "points",
                                   NULL};
