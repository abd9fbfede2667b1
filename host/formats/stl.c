/* .stl, binary or text: the three corners of each facet are points, so that
 * most come several times.  A binary file may begin with "solid" as text does;
 * its number of facets accounts for every byte, which that of a text cannot. */
#include "format.h"
#include "rows.h"
#include "scan.h"

enum {
    HEADER_BYTES = 80,
    START_BYTES = HEADER_BYTES + 4,
    NORMAL_BYTES = 12,
    CORNER_BYTES = 12,
    FACET_BYTES = NORMAL_BYTES + 3 * CORNER_BYTES + 2
};

static int read_binary(const struct host_source *source, uint64_t facets,
                       struct host_points *points, struct host_error *error) {
    const uint8_t *facet = source->data + START_BYTES;
    for (; facets > 0; facets--, facet += FACET_BYTES)
        if (host_append_numbers(points, facet + NORMAL_BYTES, 3, CORNER_BYTES,
                                HOST_F32, false, error) != 0)
            return error->code;
    return 0;
}

/* --- text ----------------------------------------------------------------- */

static int expect(struct host_scan *s, const char *word, const char *otherwise,
                  struct host_error *error) {
    return host_scan_skip_blank_lines(s) && host_scan_take(s, word)
               ? 0
               : host_scan_fail(s, s->at, error, otherwise);
}

/* Behind the word "facet".  A normal may be anything, also NaN. */
static int take_facet(struct host_scan *s, struct host_points *points,
                      struct host_error *error) {
    char word[8];
    double xyz[3];
    int status = expect(s, "normal", "'normal' is due; correct it", error);
    for (int d = 0; d < 3 && status == 0; d++) {
        (void)host_scan_skip_blank_lines(s);
        host_scan_word(s, word, sizeof word);
    }
    if (status != 0 ||
        expect(s, "outer", "'outer loop' is due; correct it", error) != 0 ||
        expect(s, "loop", "'loop' is due; correct it", error) != 0)
        return error->code;
    for (int corner = 0; corner < 3; corner++) {
        if (expect(s, "vertex",
                   "'vertex' is due, three times a facet; correct it, or get "
                   "the file whole",
                   error) != 0)
            return error->code;
        for (int d = 0; d < 3; d++)
            if (host_scan_double_anywhere(s, &xyz[d], error) != 0)
                return error->code;
        if (host_points_append(points, xyz, 1, error) != 0)
            return error->code;
    }
    return expect(s, "endloop", "'endloop' is due; correct it", error) != 0
               ? error->code
               : expect(s, "endfacet", "'endfacet' is due; correct it", error);
}

static int read_text(struct host_scan s, struct host_points *points,
                     struct host_error *error) {
    bool open = false;
    while (host_scan_skip_blank_lines(&s)) {
        if (host_scan_take(&s, "solid") || host_scan_take(&s, "endsolid")) {
            open = !open;
            host_scan_next_line(&s); /* a name, which may be anything */
        } else if (expect(&s, "facet",
                          "'facet' or 'endsolid' is due; correct it",
                          error) != 0 ||
                   take_facet(&s, points, error) != 0) {
            return error->code;
        }
    }
    return !open ? 0
                 : host_scan_fail(&s, s.at, error,
                                  "the file ends before 'endsolid'; it is cut "
                                  "short, get it whole");
}

/* --- either --------------------------------------------------------------- */

static int read_stl(const struct host_source *source, struct host_mesh *mesh,
                    struct host_error *error) {
    uint64_t facets = 0;
    bool whole = source->bytes >= START_BYTES;
    if (whole)
        facets = host_whole_at(source->data + HEADER_BYTES, HOST_U32, false);
    if (whole && source->bytes - START_BYTES == FACET_BYTES * facets)
        return read_binary(source, facets, mesh->points, error);
    struct host_scan s =
        host_scan_start(source->path, source->data, source->bytes);
    const uint64_t due = START_BYTES + FACET_BYTES * facets;
    struct host_scan first = s;
    if (host_scan_skip_blank_lines(&first) && host_scan_take(&first, "solid"))
        return read_text(s, mesh->points, error);
    return host_fail(error, HOST_INPUT,
                     "%s: neither text that begins with 'solid', nor binary: "
                     "%zu bytes where %llu facets take %llu; get the file "
                     "whole, or give one in this format",
                     source->path, source->bytes, (unsigned long long)facets,
                     (unsigned long long)due);
}

const struct host_format host_format_stl = {
    .name = "STL",
    .extensions = {".stl"},
    .read_points = read_stl,
};
