#include "bench_class.h"

#include <stdio.h>
#include <string.h>

static const struct host_bench_class classes[] = {
    {.name = "uniform",
     .title = "evenly spread points; sequential, one node of 4M",
     .made = {{.kind = "uniform", .n = 20000, .ratio = 2.5},
              {.kind = "uniform", .n = 100000, .ratio = 2.5},
              {.kind = "uniform", .n = 1000000, .ratio = 3, .large = true}},
     .way = HOST_WAY_ALONE,
     .summary = {2.5, 2.5, 10}},
    {.name = "files",
     .title = "whole programs by the clock, .npy to .npy; default options",
     .made = {{.kind = "uniform", .n = 100000},
              {.kind = "uniform", .n = 1000000, .ratio = 2}},
     .way = HOST_WAY_USUAL,
     .wall = true,
     .whole = true},
    {.name = "volumes",
     .title = "other volumes; sequential, one node of 4M; step: a tetrahedron "
              "against Uniform's",
     .made = {{.kind = "uniform", .n = 20000},
              {.kind = "bubbles", .n = 20000, .step = 1.5},
              {.kind = "bluntfin", .n = 40960, .step = 2},
              {.kind = "rotated", .n = 1000000, .step = 3, .large = true}},
     .way = HOST_WAY_ALONE,
     .first = true},
    {.name = "real",
     .title = "files of 5,000 points or more; sequential, one node of 4M",
     .files = HOST_FILES_MANY,
     .way = HOST_WAY_ALONE,
     .ratio = 1,
     .summary = {2}},
    {.name = "small",
     .title = "files of fewer points; sequential, one node of 4M",
     .files = HOST_FILES_FEW,
     .way = HOST_WAY_ALONE,
     .extra_ms = 5},
    {.name = "thin",
     .title = "a shell and a terrain; default options, against 64M",
     .made = {{.kind = "shell", .n = 200000}, {.kind = "terrain", .n = 160000}},
     .way = HOST_WAY_USUAL,
     .other = HOST_WAY_ROOMY,
     .versus = "/ 64M",
     .versus_most = 1.5,
     .pages_most = 4},
    {.name = "growth",
     .title = "surfaces of one kind; sequential, one node of 4M, against "
              "512K; step: against half the points",
     .made = {{.kind = "sphere", .n = 12500, .ratio = 1},
              {.kind = "sphere", .n = 25000, .ratio = 1, .step = 2.4},
              {.kind = "sphere", .n = 50000, .ratio = 1, .step = 2.4},
              {.kind = "sphere", .n = 100000, .ratio = 1, .step = 2.4},
              {.kind = "cylinder", .n = 12500},
              {.kind = "cylinder", .n = 25000, .step = 2.4},
              {.kind = "cylinder", .n = 50000, .step = 2.4},
              {.kind = "cylinder", .n = 100000, .step = 2.4},
              {.kind = "torus", .n = 12500},
              {.kind = "torus", .n = 25000, .step = 2.4},
              {.kind = "torus", .n = 50000, .step = 2.4},
              {.kind = "torus", .n = 100000, .step = 2.4}},
     .way = HOST_WAY_ALONE,
     .other = HOST_WAY_NARROW,
     .narrower = true,
     .versus = "512K /",
     .versus_most = 3},
    {.name = "extremes",
     .title = "all scales, and skew lines; sequential, one node of 4M",
     .made = {{.kind = "scales", .n = 3000, .seconds = 5},
              {.kind = "lines", .n = 2000, .seconds = 5}},
     .way = HOST_WAY_ALONE},
    {.name = "cube",
     .title = "files of 5,000 points or more by the clock; spatial, 8 nodes of "
              "512K, against 1M",
     .files = HOST_FILES_MANY,
     .way = HOST_WAY_CUBE,
     .other = HOST_WAY_CUBE_2,
     .wall = true,
     .means = true,
     .versus = "/ 1M",
     .versus_most = 4,
     .ratio = 0.05,
     .summary = {1.0 / 3}},
};

enum { CLASSES = sizeof classes / sizeof classes[0] };

/* Goals of sets that are known by name: surfaces, and those that are hard. */
static const struct {
    const char *name;
    double ratio;
} goals[] = {{"bunny", 1.5},       {"globe_terrain", 1.5},
             {"tank", 1.5},        {"terrain", 1.5},
             {"bullet", 1.5},      {"wing_layers", 0.5},
             {"axial_stage", 0.5}, {"torus", 0.5},
             {"trajectory", 0.5},  {"buildings_crop", 0.5}};

static const char *const ways[HOST_WAYS][7] = {
    [HOST_WAY_ALONE] = {"--strategy", "sequential", "--nodes", "1", "--memory",
                        "4M"},
    [HOST_WAY_NARROW] = {"--strategy", "sequential", "--nodes", "1", "--memory",
                         "512K"},
    [HOST_WAY_ROOMY] = {"--memory", "64M"},
    [HOST_WAY_CUBE] = {"--strategy", "spatial", "--nodes", "8", "--memory",
                       "512K"},
    [HOST_WAY_CUBE_2] = {"--strategy", "spatial", "--nodes", "8", "--memory",
                         "1M"},
};

const struct host_bench_class *host_bench_class_row(unsigned i) {
    return i < CLASSES ? &classes[i] : NULL;
}

const struct host_bench_class *host_bench_class_named(const char *name) {
    for (unsigned i = 0; i < CLASSES; i++) {
        if (strcmp(name, classes[i].name) == 0) {
            return &classes[i];
        }
    }
    return NULL;
}

const char *host_bench_class_names(void) {
    static char names[256];
    size_t used = 0;
    for (unsigned i = 0; i < CLASSES; i++) {
        used += (size_t)snprintf(names + used, sizeof names - used, "%s%s",
                                 i == 0 ? "" : ", ", classes[i].name);
    }
    return names;
}

const char *const *host_bench_way_options(enum host_bench_way way) {
    return ways[way];
}

double host_bench_goal(const struct host_bench_class *c, const char *name,
                       bool *named) {
    *named = false;
    for (unsigned i = 0; i < sizeof goals / sizeof goals[0]; i++) {
        if (strcmp(name, goals[i].name) == 0) {
            *named = true;
            return c->wall ? c->ratio : goals[i].ratio;
        }
    }
    return c->ratio;
}
