/* Files of laser scanners.  .las, versions 1.0 to 1.4 (ASPRS, LAS
 * Specification 1.4 R15, 2019: Tables 3 and 7 to 17): x, y and z of every point
 * record, also of those that are marked as withheld, for rows are numbered by
 * records.  What LASzip has compressed (.laz, or a .las with its mark) is not
 * read, nor is .e57 (ASTM E2807). */
#include <string.h>

#include "format.h"
#include "rows.h"

#define COMPRESSED                                                             \
    "LAS whose points LASzip has compressed, which is not read; unpack them "  \
    "with laszip -i IN.laz -o OUT.las (of LAStools) or pdal translate IN.laz " \
    "OUT.las (PDAL of conda-forge); Debian 12 has neither"

#define SCANS                                                                  \
    "E57 (ASTM E2807), which is not read; convert it with pdal translate "     \
    "IN.e57 OUT.las (PDAL of conda-forge, with its plugin for E57) or "        \
    "e572las -i IN.e57 -o OUT.las (of LAStools); Debian 12 has neither, and "  \
    "its CloudCompare reads no E57"

/* Where fields are. */
enum {
    AT_MAJOR = 24,
    AT_MINOR = 25,
    AT_HEADER_BYTES = 94, /* 2 */
    AT_OFFSET = 96,       /* of the records; 4 */
    AT_FORMAT = 104,
    AT_LENGTH = 105,    /* of a record; 2 */
    AT_FEW = 107,       /* number of records, up to 2^32 - 1; 4 */
    AT_SCALE = 131,     /* 8 each, as all that follow */
    AT_SHIFT = 155,     /* an offset, in the specification's words */
    AT_MANY = 247,      /* number of records, since 1.4 */
    HEADER_BYTES = 227, /* up to 1.3 as far as it is read */
    HEADER_BYTES_4 = 375,
    MARKS_OF_LASZIP = 0xc0,
    FORMATS = 11
};

struct las {
    unsigned minor, format;
    uint64_t offset, length, count;
    double scale[3], shift[3];
};

static uint64_t field(const struct host_source *source, size_t at,
                      enum host_number type) {
    return host_whole_at(source->data + at, type, false);
}

static bool is_laz(const uint8_t *data, size_t bytes) {
    return bytes > AT_FORMAT && memcmp(data, "LASF", 4) == 0 &&
           (data[AT_FORMAT] & MARKS_OF_LASZIP) != 0;
}

static bool is_e57(const uint8_t *data, size_t bytes) {
    static const char signature[] = "ASTM-E57";
    return bytes >= strlen(signature) &&
           memcmp(data, signature, strlen(signature)) == 0;
}

/* What is known of versions and of formats. */
static int check_known(const struct host_source *source, const struct las *las,
                       struct host_error *error) {
    if (source->data[AT_MAJOR] != 1 || las->minor > 4) {
        return host_fail(error, HOST_INPUT,
                         "%s: LAS %u.%u, where 1.0 to 1.4 are read; convert it "
                         "to one of these",
                         source->path, source->data[AT_MAJOR], las->minor);
    }
    if (las->format >= FORMATS) {
        return host_fail(error, HOST_INPUT,
                         "%s: point record format %u, where 0 to 10 are read; "
                         "convert it to one of these",
                         source->path, las->format);
    }
    return 0;
}

static int cut_short(const struct host_source *source, const struct las *las,
                     uint64_t points, struct host_error *error) {
    return host_fail(error, HOST_INPUT,
                     "%s: %llu points where its header tells of %llu; the "
                     "file is cut short, get it whole",
                     source->path, (unsigned long long)points,
                     (unsigned long long)las->count);
}

/* Whether all records are behind the header, and within the file as far as its
 * size is known. */
static int check_bounds(const struct host_source *source, const struct las *las,
                        struct host_error *error) {
    const unsigned header_bytes =
        las->minor < 4 ? HEADER_BYTES : HEADER_BYTES_4;
    static const uint8_t least[FORMATS] = {20, 28, 26, 34, 57, 63,
                                           30, 36, 38, 59, 67};
    uint64_t header = field(source, AT_HEADER_BYTES, HOST_U16);
    if (header < header_bytes || las->offset < header ||
        las->length < least[las->format]) {
        return host_fail(error, HOST_INPUT,
                         "%s: a header of %llu bytes, points from byte %llu "
                         "on, %llu bytes each: LAS 1.%u with format %u has "
                         "%u, and %u or more; the file is damaged, get it "
                         "again",
                         source->path, (unsigned long long)header,
                         (unsigned long long)las->offset,
                         (unsigned long long)las->length, las->minor,
                         las->format, header_bytes, least[las->format]);
    }
    uint64_t room = las->offset > source->bytes
                        ? 0
                        : (source->bytes - las->offset) / las->length;
    return source->feed == NULL && las->count > room
               ? cut_short(source, las, room, error)
               : 0;
}

/* Points of 1.0 come behind two bytes of a signature, which some writers do not
 * count in the offset; nothing comes behind the points. */
static int skip_signature(const struct host_source *source, struct las *las,
                          const uint8_t **at, const uint8_t **end,
                          struct host_error *error) {
    static const uint8_t signature[] = {0xdd, 0xcc};
    if (las->minor != 0)
        return 0;
    if (host_source_all(source, at, end, error) != 0)
        return error->code;
    uint64_t bytes = (uint64_t)(*end - *at);
    if (las->offset + 2 <= bytes &&
        bytes - las->offset == las->count * las->length + 2 &&
        memcmp(*at + las->offset, signature, 2) == 0)
        las->offset += 2;
    return 0;
}

/* Skips so many bytes; false if the file ends before. */
static bool skip(const struct host_source *source, uint64_t bytes,
                 const uint8_t **at, const uint8_t **end) {
    while ((uint64_t)(*end - *at) < bytes) {
        bytes -= (uint64_t)(*end - *at);
        *at = *end;
        if (!host_source_more(source, at, end))
            return false;
    }
    *at += bytes;
    return true;
}

static int read_header(const struct host_source *source, struct las *las,
                       struct host_error *error) {
    if (source->bytes < HEADER_BYTES || memcmp(source->data, "LASF", 4) != 0) {
        return host_source_fail(source, error,
                                "no LAS file, or less than its header; get it "
                                "whole, or give one in this format");
    }
    las->minor = source->data[AT_MINOR];
    las->format = source->data[AT_FORMAT];
    las->offset = field(source, AT_OFFSET, HOST_U32);
    las->length = field(source, AT_LENGTH, HOST_U16);
    las->count = field(source, AT_FEW, HOST_U32);
    if (check_known(source, las, error) != 0)
        return error->code;
    if (las->minor == 4 && source->bytes >= AT_MANY + 8) {
        uint64_t few = las->count, many = field(source, AT_MANY, HOST_U64);
        if (few != 0 && many != 0 && few != many) {
            return host_fail(error, HOST_INPUT,
                             "%s: its header tells of %llu points and of %llu; "
                             "the file is damaged, get it again",
                             source->path, (unsigned long long)few,
                             (unsigned long long)many);
        }
        las->count = many != 0 ? many : few;
    }
    for (size_t d = 0; d < 3; d++) {
        const uint8_t *of = source->data + 8 * d;
        las->scale[d] = host_number_at(of + AT_SCALE, HOST_F64, false);
        las->shift[d] = host_number_at(of + AT_SHIFT, HOST_F64, false);
    }
    return check_bounds(source, las, error);
}

static int read_las(const struct host_source *source, struct host_mesh *mesh,
                    struct host_error *error) {
    struct las las = {0};
    if (read_header(source, &las, error) != 0)
        return error->code;
    const uint8_t *at = source->data, *end = source->data + source->bytes;
    if (skip_signature(source, &las, &at, &end, error) != 0)
        return error->code;
    if (!skip(source, las.offset, &at, &end))
        return cut_short(source, &las, 0, error);
    for (uint64_t i = 0; i < las.count; i++, at += las.length) {
        double xyz[3];
        while ((uint64_t)(end - at) < las.length)
            if (!host_source_more(source, &at, &end))
                return cut_short(source, &las, i, error);
        for (size_t d = 0; d < 3; d++) {
            double whole = host_number_at(at + 4 * d, HOST_I32, false);
            xyz[d] = whole * las.scale[d] + las.shift[d]; /* both rounded */
        }
        if (host_points_append(mesh->points, xyz, 1, error) != 0)
            return error->code;
    }
    return 0;
}

const struct host_format host_format_las = {
    .name = "LAS",
    .extensions = {".las"},
    .read_points = read_las,
    .pieces = true,
};

const struct host_format host_format_laz = {
    .name = "LASzip",
    .extensions = {".laz"},
    .unread = COMPRESSED,
    .recognises = is_laz,
};

const struct host_format host_format_e57 = {
    .name = "E57",
    .extensions = {".e57"},
    .unread = SCANS,
    .recognises = is_e57,
};
