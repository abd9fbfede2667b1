#include "bench_boards_count.h"

#include <dirent.h>
#include <errno.h>
#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *const host_room_names[HOST_ROOMS] = {
    [HOST_ROOM_PREDICATES] = "predicates", [HOST_ROOM_DOUBLES] = "doubles",
    [HOST_ROOM_SEARCH] = "search",         [HOST_ROOM_COMPLEX] = "complex",
    [HOST_ROOM_POINTS] = "points",         [HOST_ROOM_COPYING] = "copying",
    [HOST_ROOM_LINKS] = "links",           [HOST_ROOM_NODE] = "node",
    [HOST_ROOM_BOARD] = "board",
};

/* The first with which an object's path begins, in its board's folder. */
static const struct {
    const char *path;
    enum host_room room;
} rooms[] = {
    {"incode/predicates/", HOST_ROOM_PREDICATES},
    {"incode/apex/", HOST_ROOM_SEARCH},
    {"incode/pages/", HOST_ROOM_SEARCH},
    {"incode/front/", HOST_ROOM_COMPLEX},
    {"incode/complex/", HOST_ROOM_COMPLEX},
    {"incode/", HOST_ROOM_POINTS},
    {"transport/", HOST_ROOM_LINKS},
    {"node/", HOST_ROOM_NODE},
    {"boards/bare/memory.o", HOST_ROOM_COPYING},
    {"boards/bare/sqrt.o", HOST_ROOM_DOUBLES},
    {"boards/", HOST_ROOM_BOARD},
};

struct function {
    uint64_t from, bytes;
    enum host_room room;
};

/* In ascending order. */
struct functions {
    struct function *all;
    size_t count;
};

/* Behind the last "/firmware/BOARD/"; NULL: it is none of the firmware's. */
static const char *in_board(const char *path) {
    static const char firmware[] = "/firmware/";
    const char *found = NULL;
    for (const char *at = path; (at = strstr(at, firmware)) != NULL; at++) {
        found = at;
    }
    found = found == NULL ? NULL : strchr(found + sizeof firmware - 1, '/');
    return found == NULL ? NULL : found + 1;
}

static bool room_of(const char *path, enum host_room *room) {
    const char *object = in_board(path);
    for (size_t i = 0; object != NULL && i < sizeof rooms / sizeof rooms[0];
         i++) {
        if (strncmp(object, rooms[i].path, strlen(rooms[i].path)) == 0) {
            *room = rooms[i].room;
            return true;
        }
    }
    *room = HOST_ROOM_DOUBLES;
    return strstr(path, "libgcc.a(") != NULL;
}

static int by_address(const void *a, const void *b) {
    const struct function *f = a, *g = b;
    return (f->from > g->from) - (f->from < g->from);
}

static bool keep(struct functions *functions, struct function function) {
    enum { STEP = 1024 };
    if (functions->count % STEP == 0) {
        struct function *more =
            realloc(functions->all, (functions->count + STEP) * sizeof *more);
        if (more == NULL) {
            return false;
        }
        functions->all = more;
    }
    functions->all[functions->count++] = function;
    return true;
}

/* " .text.NAME  0xADDRESS  0xBYTES  OBJECT", the name on a line of its own
 * where it is long. */
static bool read_map(FILE *file, struct functions *functions) {
    char line[4096], object[4096];
    bool laid_out = false, code = false;
    struct function function;
    while (fgets(line, sizeof line, file) != NULL) {
        const char *at = strstr(line, " 0x");
        laid_out |= strncmp(line, "Linker script and memory map", 28) == 0;
        if (line[0] == ' ' && line[1] == '.') {
            code = strncmp(line, " .text", 6) == 0 ||
                   strncmp(line, " .vectors", 9) == 0;
        }
        if (laid_out && code && at != NULL &&
            sscanf(at, " 0x%" SCNx64 " 0x%" SCNx64 " %4095s", &function.from,
                   &function.bytes, object) == 3 &&
            function.bytes > 0 && room_of(object, &function.room) &&
            !keep(functions, function)) {
            return false;
        }
    }
    if (functions->count > 0) {
        qsort(functions->all, functions->count, sizeof *functions->all,
              by_address);
    }
    return functions->count > 0;
}

/* What lies in no function is the board's. */
static enum host_room room_at(const struct functions *functions,
                              uint64_t address) {
    size_t low = 0, high = functions->count;
    while (high - low > 1) {
        size_t middle = (low + high) / 2;
        if (functions->all[middle].from <= address) {
            low = middle;
        } else {
            high = middle;
        }
    }
    const struct function *function = &functions->all[low];
    return address - function->from < function->bytes ? function->room
                                                      : HOST_ROOM_BOARD;
}

static void add(FILE *file, const struct functions *functions,
                double counted[HOST_ROOMS]) {
    uint64_t block[3]; /* address, instructions, times: struct count */
    while (fread(block, sizeof block, 1, file) == 1 && block[1] != 0) {
        if (block[0] >= functions->all[0].from) { /* else it is the loader's */
            counted[room_at(functions, block[0])] +=
                (double)block[1] * (double)block[2];
        }
    }
}

static int add_folder(const char *folder, const struct functions *functions,
                      double counted[HOST_ROOMS], struct host_error *error) {
    char path[8192];
    struct dirent *entry;
    DIR *open_folder = opendir(folder);
    if (open_folder == NULL) {
        return host_fail(error, HOST_BROKEN, "%s: %s; run it again", folder,
                         strerror(errno));
    }
    while ((entry = readdir(open_folder)) != NULL && error->code == 0) {
        if (strstr(entry->d_name, ".count") == NULL) {
            continue;
        }
        (void)snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
        FILE *file = fopen(path, "rbe");
        if (file == NULL) {
            host_fail(error, HOST_BROKEN, "%s: %s; run it again", path,
                      strerror(errno));
            continue;
        }
        add(file, functions, counted);
        (void)fclose(file);
        (void)remove(path);
    }
    (void)closedir(open_folder);
    return error->code;
}

int host_boards_count(const char *map, const char *folder,
                      double counted[HOST_ROOMS], struct host_error *error) {
    struct functions functions = {NULL, 0};
    FILE *file = fopen(map, "re");
    bool good = file != NULL && read_map(file, &functions);
    if (file != NULL) {
        (void)fclose(file);
    }
    if (!good) {
        host_fail(error, HOST_BROKEN,
                  "%s: no map of a linker; make it with: make firmware", map);
    } else {
        (void)add_folder(folder, &functions, counted, error);
    }
    free(functions.all);
    return error->code;
}
