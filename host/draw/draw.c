#include "draw.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "host/base/progress.h"
#include "host/base/text.h"
#include "host/formats/write.h"
#include "host/formats/read.h"
#include "picture.h"
#include "host/base/options.h"

/* No output may be a file that is read. */
static int check_claims(const struct host_draw_options *options,
                        struct host_error *error) {
    struct host_claims claims = {0};
    host_claims_read(&claims, options->points, error);
    host_claims_read(&claims, options->tets, error);
    host_claims_write(&claims, "-o ", options->output, NULL, error);
    host_claims_free(&claims);
    return error->code == 0 ? host_output_probe(options->output, error)
                            : error->code;
}

/* What was drawn, where standard output does not have the picture itself. */
static void report(const struct host_draw_options *options,
                   const struct host_picture *picture,
                   struct host_plane plane) {
    FILE *file = strcmp(options->output, "-") == 0 ? stderr : stdout;
    host_say(file, "%s: %u x %u pixels, %llu tetrahedra cut by %c = %.9g\n",
             options->output, picture->width, picture->height,
             (unsigned long long)picture->section->count, "xyz"[plane.axis],
             plane.at);
    if (picture->merged > 0) {
        host_say(file,
                 "of these, %llu are smaller than a pixel: a pixel has the "
                 "mean colour of those in it; a larger --width shows more\n",
                 (unsigned long long)picture->merged);
    }
}

static int draw(const struct host_draw_options *options,
                const struct host_points *points,
                const struct host_tetrahedra *tets, struct host_error *error) {
    struct host_section section = {0};
    struct host_output out;
    struct host_plane plane = host_plane_through_middle(points);
    if (options->axis >= 0) {
        plane.axis = (unsigned)options->axis;
        plane.at = host_plane_middle(points, plane.axis);
    }
    plane.at = options->has_at ? options->at : plane.at;
    if (host_section_make(&section, points, tets, plane, error) != 0)
        return error->code;
    struct host_picture picture = host_picture_of(&section, options->width);
    if (host_output_open(&out, options->output, error) == 0) {
        host_picture_format(options->output)->write(&out, &picture, error);
        host_output_close(&out, 1, error);
    }
    if (error->code == 0 && !options->quiet) {
        host_progress_end();
        report(options, &picture, plane);
    }
    host_section_free(&section);
    return error->code;
}

int host_draw(const struct host_draw_options *options,
              struct host_error *error) {
    struct host_points points = {0};
    struct host_tetrahedra tets = {0};
    host_progress_begin(!options->quiet);
    if (check_claims(options, error) == 0 &&
        host_points_read(options->points, &points, error) == 0 &&
        host_tetrahedra_read(options->tets, &tets, NULL, error) == 0 &&
        host_rows_check(options->tets, &tets, &points, error) == 0) {
        host_progress_phase("drawing", NULL);
        draw(options, &points, &tets, error);
    }
    host_progress_end();
    host_points_free(&points);
    host_tetrahedra_free(&tets);
    return host_output_commit(error);
}

/* --- arguments ------------------------------------------------------------ */

enum { WIDTH = 640 };

static void take_axis(void *into, const char *value, struct host_error *error) {
    struct host_draw_options *o = into;
    const char *axis = strlen(value) == 1 ? strchr("xyz", value[0]) : NULL;
    if (axis == NULL) {
        host_fail(error, HOST_USAGE, "--axis %s: not an axis; allowed: x, y, z",
                  value);
        return;
    }
    o->axis = value[0] - 'x';
}

static void take_at(void *into, const char *value, struct host_error *error) {
    struct host_draw_options *o = into;
    char *end = NULL;
    o->at = strtod(value, &end);
    o->has_at = true;
    if (end == value || *end != '\0' || !isfinite(o->at)) {
        host_fail(error, HOST_USAGE,
                  "--at %s: not a coordinate; give a number, as in 0.5", value);
    }
}

static void take_argument(void *into, const char *value,
                          struct host_error *error) {
    struct host_draw_options *o = into;
    if (o->points == NULL) {
        o->points = value;
    } else if (o->tets == NULL) {
        o->tets = value;
    } else {
        host_fail(error, HOST_USAGE,
                  "%s: one argument too many; give POINTS, TETS and -o FILE",
                  value);
    }
}

static int check(const struct host_draw_options *options,
                 struct host_error *error) {
    char formats[64];
    host_picture_formats(formats, sizeof formats);
    if (error->code == 0 && options->tets == NULL) {
        return host_fail(error, HOST_USAGE,
                         "POINTS TETS: too few arguments; give both, as in "
                         "incode draw a.xyz a.ele -o a.svg");
    }
    if (error->code == 0 && options->output == NULL) {
        return host_fail(error, HOST_USAGE,
                         "-o FILE: missing; give a name that ends in %s, or -",
                         formats);
    }
    if (error->code == 0 && host_picture_format(options->output) == NULL) {
        return host_fail(error, HOST_USAGE,
                         "-o %s: no format of pictures has this extension; "
                         "use %s, or -",
                         options->output, formats);
    }
    return error->code;
}

int host_draw_arguments(int argc, char **argv,
                        struct host_draw_options *options,
                        struct host_error *error) {
    static const struct host_option rows[] = {
        {"output", 'o', "FILE",
         "Write the picture to FILE, .svg or .png; - is .svg on standard "
         "output",
         HOST_AT(struct host_draw_options, output)},
        {"axis", 0, "x|y|z",
         "The plane is at right angles to this axis. Default: the one along "
         "which the points extend least, or z",
         .take = take_axis},
        {"at", 0, "COORDINATE",
         "Where on that axis the plane is. Default: the middle",
         .take = take_at},
        {"width", 0, "PIXELS", "Of the picture, 16 to 8192. Default: 640",
         HOST_AT(struct host_draw_options, width), .least = HOST_PICTURE_MIN,
         .most = HOST_PICTURE_MAX},
        HOST_LIMITS_ROWS(struct host_draw_options, limits.memory,
                         limits.folder),
        {"quiet", 'q', NULL, "Print nothing but errors",
         HOST_AT(struct host_draw_options, quiet)},
        {0}};
    static const struct host_options mine = {
        .rows = rows,
        .argument = take_argument,
        .arguments = "POINTS TETS",
        .about =
            "Draws a plane section through the triangulation TETS of POINTS: "
            "each tetrahedron that the plane cuts, the smaller the bluer.  "
            "Points on the plane count as above it.  An .svg has one path a "
            "colour, and tetrahedra below a pixel share one.\v"
            "Examples:\n"
            "  incode draw a.xyz a.ele -o a.svg\n"
            "  incode draw a.xyz a.vtu -o a.png --axis x --at 0.25 --width "
            "1600"};
    *options = (struct host_draw_options){.axis = -1, .width = WIDTH};
    int status =
        host_options_parse(&mine, argc, argv, false, options, NULL, error);
    return status != 0 ? status : check(options, error);
}
