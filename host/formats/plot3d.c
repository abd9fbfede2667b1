/* PLOT3D grid files, binary: none of the variants says what it is, so each is
 * tried and the one that accounts for every byte of the file is taken.
 * Variants: byte order, Fortran record marks or not, one block or several,
 * float or double, iblank or not. */
#include <string.h>

#include "format.h"
#include "rows.h"

enum { BLOCKS_MAX = 65536 };

struct variant {
    bool big, marks, blocks, iblank;
    enum host_number type;
};

struct cursor {
    const struct host_source *source;
    struct variant v;
    size_t at;
    size_t record_end; /* within a record with marks */
};

static bool has(const struct cursor *c, uint64_t bytes) {
    return c->source->bytes - c->at >= bytes;
}

static bool whole(struct cursor *c, uint64_t *value) {
    if (!has(c, 4))
        return false;
    *value = host_whole_at(c->source->data + c->at, HOST_U32, c->v.big);
    c->at += 4;
    return true;
}

/* With marks every record's length stands before and after it. */
static bool open_record(struct cursor *c, uint64_t bytes) {
    uint64_t length;
    if (!c->v.marks)
        return has(c, bytes);
    return whole(c, &length) && length == bytes && has(c, bytes);
}

static bool close_record(struct cursor *c, uint64_t bytes) {
    uint64_t length;
    return !c->v.marks || (whole(c, &length) && length == bytes);
}

static bool dimensions(struct cursor *c, uint64_t *points) {
    uint64_t n = 1;
    for (int d = 0; d < 3; d++) {
        uint64_t side;
        if (!whole(c, &side) || side == 0 || side > UINT32_MAX / n)
            return false;
        n *= side;
    }
    *points = n;
    return true;
}

static int append_block(struct cursor *c, uint64_t n,
                        struct host_points *points, struct host_error *error) {
    const uint8_t *data = c->source->data + c->at;
    size_t bytes = host_number_bytes(c->v.type);
    for (uint64_t i = 0; i < n; i++) {
        double xyz[3];
        for (uint64_t d = 0; d < 3; d++) {
            xyz[d] =
                host_number_at(data + (d * n + i) * bytes, c->v.type, c->v.big);
        }
        if (host_points_append(points, xyz, 1, error) != 0)
            return error->code;
    }
    return 0;
}

/* Whether the file is of this variant, to the last byte; appends the points
 * where `points` is not NULL. */
static bool walk(const struct host_source *source, struct variant v,
                 struct host_points *points, struct host_error *error) {
    struct cursor c = {.source = source, .v = v};
    uint64_t blocks = 1;
    if (v.blocks &&
        (!open_record(&c, 4) || !whole(&c, &blocks) || !close_record(&c, 4) ||
         blocks == 0 || blocks > BLOCKS_MAX || !open_record(&c, 12 * blocks)))
        return false;
    if (!v.blocks && !open_record(&c, 12))
        return false;
    struct cursor sizes = c; /* read again, block by block */
    c.at += 12 * (size_t)blocks;
    if (!close_record(&c, 12 * blocks))
        return false;
    for (uint64_t b = 0; b < blocks; b++) {
        uint64_t n, each = 3 * host_number_bytes(v.type) + (v.iblank ? 4 : 0);
        if (!dimensions(&sizes, &n) || !open_record(&c, n * each))
            return false;
        if (points != NULL && append_block(&c, n, points, error) != 0)
            return false;
        c.at += (size_t)(n * each);
        if (!close_record(&c, n * each))
            return false;
    }
    return c.at == source->bytes;
}

static int read_plot3d(const struct host_source *source, struct host_mesh *mesh,
                       struct host_error *error) {
    for (unsigned bits = 0; bits < 32; bits++) {
        /* Of two variants that fit, marks are the better evidence, and
         * iblank is the rarer. */
        struct variant v = {.big = (bits & 1) != 0,
                            .blocks = (bits & 2) != 0,
                            .type = (bits & 4) != 0 ? HOST_F64 : HOST_F32,
                            .iblank = (bits & 8) != 0,
                            .marks = (bits & 16) == 0};
        if (walk(source, v, NULL, error)) {
            (void)walk(source, v, mesh->points, error);
            return error->code;
        }
    }
    return host_source_fail(source, error,
                            "no variant of PLOT3D accounts for every byte; "
                            "the file is cut short, or give a binary 3D grid");
}

const struct host_format host_format_plot3d = {
    .name = "PLOT3D",
    .extensions = {".x", ".p3d", ".bin"},
    .read_points = read_plot3d,
};
