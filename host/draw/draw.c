#include "draw.h"

#include <stdio.h>
#include <string.h>

#include "host/base/progress.h"
#include "host/base/text.h"
#include "host/formats/claims.h"
#include "host/formats/read.h"
#include "picture.h"

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
    if (host_section_make(&section, points, tets, plane, error) != 0) {
        return error->code;
    }
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
