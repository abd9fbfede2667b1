#include "bench_scale.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "bench_scaling.h"
#include "bench_table.h"
#include "host/base/create.h"
#include "host/base/progress.h"

enum { SIZES_MAX = 16, NAME_MAX_BYTES = 4096, WORDS_MAX = 16, LIMIT_S = 86400 };

struct row {
    uint64_t points;
    struct host_trial free, limited; /* without a limit, and within it */
};

struct bench {
    const struct host_scale_options *options;
    FILE *csv;
    char folder[NAME_MAX_BYTES];
    char points[NAME_MAX_BYTES + 16], out[NAME_MAX_BYTES + 16];
    struct row row[SIZES_MAX];
    unsigned rows;
};

/* --- arguments ------------------------------------------------------------ */

static int parse_sizes(struct bench *b, struct host_error *error) {
    const char *at = b->options->sizes;
    char *end = NULL;
    do {
        errno = 0;
        unsigned long long n = strtoull(at, &end, 10);
        if (end == at || *at == '-' || errno != 0 || n < 4 || n >= UINT32_MAX ||
            (*end != ',' && *end != '\0') || b->rows == SIZES_MAX) {
            return host_fail(error, HOST_USAGE,
                             "--sizes %s: numbers of points from 4 to 2^32 - "
                             "2, at most %d, with commas between; give "
                             "1000000,10000000",
                             b->options->sizes, SIZES_MAX);
        }
        b->row[b->rows++].points = n;
        at = end + 1;
    } while (*end == ',');
    return 0;
}

/* --- runs ----------------------------------------------------------------- */

static int run(const struct bench *b, const char *const words[],
               struct host_trial *trial, struct host_error *error) {
    if (host_trial_run((char *const *)words, LIMIT_S, trial, error) != 0)
        return error->code;
    return !trial->late && trial->status == 0
               ? 0
               : host_fail(error, HOST_BROKEN,
                           "bench scale: %s in %s ended with status %d: %s; "
                           "run that alone",
                           words[1], b->folder, trial->status, trial->said);
}

static int triangulate(const struct bench *b, const char *memory,
                       struct host_trial *trial, struct host_error *error) {
    const char *words[WORDS_MAX] = {
        "/proc/self/exe", "run", b->points, "-q", "-o", b->out, "--stats", "-"};
    unsigned n = 8;
    if (memory != NULL) {
        words[n++] = "--host-memory", words[n++] = memory;
        words[n++] = "--scratch", words[n++] = b->folder;
    }
    int status = run(b, words, trial, error);
    (void)unlink(b->out);
    return status;
}

static int measure(struct bench *b, struct row *row, struct host_error *error) {
    char count[32], phase[64];
    struct host_trial made;
    const char *const words[] = {"/proc/self/exe",
                                 "gen",
                                 "uniform",
                                 count,
                                 "--seed",
                                 "1",
                                 "-o",
                                 b->points,
                                 "--host-memory",
                                 b->options->memory,
                                 "--scratch",
                                 b->folder,
                                 NULL};
    (void)snprintf(count, sizeof count, "%llu",
                   (unsigned long long)row->points);
    (void)snprintf(phase, sizeof phase, "%s points", count);
    host_progress_phase(phase, NULL);
    if (run(b, words, &made, error) == 0 &&
        triangulate(b, NULL, &row->free, error) == 0)
        (void)triangulate(b, b->options->memory, &row->limited, error);
    (void)unlink(b->points);
    if (error->code == 0 &&
        strcmp(row->free.digest, row->limited.digest) != 0) {
        host_fail(error, HOST_BROKEN,
                  "bench scale: %s points have other tetrahedra within %s; "
                  "please report this fault",
                  count, b->options->memory);
    }
    return error->code;
}

/* --- rows ----------------------------------------------------------------- */

/* Of each point: seconds of so many, or bytes. */
static double each(double all, const struct row *row) {
    return all / (double)row->points;
}

static void put_head(const struct bench *b) {
    host_progress_erase();
    printf("Uniform points, .npy to .npy, on all threads: without a limit, and "
           "within %s.  us\na point of the whole program without its check, "
           "bytes a point of resident memory\n(the check included) and of "
           "scratch files, and MB of both.\n\n"
           "%11s %11s %-9s %8s %6s %7s %7s %8s %8s\n",
           b->options->memory, "points", "tetrahedra", "limit", "s", "us",
           "memory", "scratch", "MB", "MB");
    (void)fflush(stdout);
    if (b->csv != NULL) {
        fputs("points,tetrahedra,limit,seconds,peak_bytes,scratch_bytes\n",
              b->csv);
    }
}

static void put_trial(const struct bench *b, const struct row *row,
                      const struct host_trial *t, const char *limit) {
    double peak = (double)t->peak_bytes, scratch = (double)t->scratch_bytes;
    host_progress_erase();
    printf("%11llu %11llu %-9s %8.2f %6.2f %7.1f %7.1f %8.0f %8.0f\n",
           (unsigned long long)row->points, (unsigned long long)t->tetrahedra,
           limit, t->run_s, 1e6 * each(t->run_s, row), each(peak, row),
           each(scratch, row), 1e-6 * peak, 1e-6 * scratch);
    (void)fflush(stdout);
    if (b->csv != NULL) {
        fprintf(b->csv, "%llu,%llu,%s,%.6g,%llu,%llu\n",
                (unsigned long long)row->points,
                (unsigned long long)t->tetrahedra, limit, t->run_s,
                (unsigned long long)t->peak_bytes,
                (unsigned long long)t->scratch_bytes);
    }
}

/* Two panels: time, and memory and scratch. */
static int draw(const struct bench *b, struct host_error *error) {
    static const char form[] = "with linespoints pointtype 7 pointsize 0.5";
    FILE *plot = tmpfile();
    if (plot == NULL) {
        return host_fail(error, HOST_BROKEN, "%s: %s; free memory",
                         b->options->svg, strerror(errno));
    }
    fprintf(plot, "$p << END\n");
    for (unsigned i = 0; i < b->rows; i++) {
        const struct row *r = &b->row[i];
        fprintf(plot, "%llu %.6g %.6g %.6g %.6g %.6g\n",
                (unsigned long long)r->points, 1e6 * each(r->free.run_s, r),
                1e6 * each(r->limited.run_s, r),
                each((double)r->free.peak_bytes, r),
                each((double)r->limited.peak_bytes, r),
                each((double)r->limited.scratch_bytes, r));
    }
    fprintf(plot,
            "END\nset terminal svg size 1000,520 dynamic\n"
            "set multiplot layout 1,2\nset logscale x\nset yrange [0:*]\n"
            "set key below\nset xlabel \"points\"\nset format x \"10^{%%L}\"\n"
            "set title \"us a point, file to file\"\n"
            "plot $p using 1:2 %s title \"without a limit\", $p using 1:3 %s "
            "title \"within %s\"\n"
            "set title \"bytes a point\"\n"
            "plot $p using 1:4 %s title \"memory\", $p using 1:5 %s title "
            "\"memory within %s\", $p using 1:6 %s title \"scratch\"\n"
            "unset multiplot\n",
            form, form, b->options->memory, form, form, b->options->memory,
            form);
    int status = host_gnuplot_draw(plot, b->options->svg, error);
    (void)fclose(plot);
    if (status == 0)
        printf("\nDrawn in %s.\n", b->options->svg);
    return status;
}

/* --- all ------------------------------------------------------------------ */

static int make_folder(struct bench *b, struct host_error *error) {
    const char *folder = b->options->folder;
    folder = folder != NULL ? folder : getenv("TMPDIR");
    int n = snprintf(b->folder, sizeof b->folder, "%s/incode-scale-XXXXXX",
                     folder == NULL ? "/tmp" : folder);
    errno = ENAMETOOLONG;
    if (n < 0 || (size_t)n >= sizeof b->folder || mkdtemp(b->folder) == NULL) {
        return host_fail(error, HOST_INPUT,
                         "%s: %s; give another folder as --scratch DIR",
                         b->folder, strerror(errno));
    }
    (void)snprintf(b->points, sizeof b->points, "%s/points.npy", b->folder);
    (void)snprintf(b->out, sizeof b->out, "%s/out.npy", b->folder);
    return 0;
}

static int measure_all(struct bench *b, struct host_error *error) {
    put_head(b);
    for (unsigned i = 0; i < b->rows && error->code == 0; i++) {
        struct row *row = &b->row[i];
        if (measure(b, row, error) == 0) {
            put_trial(b, row, &row->free, "none");
            put_trial(b, row, &row->limited, b->options->memory);
        }
    }
    host_progress_erase();
    return error->code == 0 && b->options->svg != NULL ? draw(b, error)
                                                       : error->code;
}

int host_bench_scale(const struct host_scale_options *options,
                     struct host_error *error) {
    struct bench *b = calloc(1, sizeof *b);
    if (b == NULL)
        return host_fail_memory(error, "the rows");
    b->options = options;
    if (parse_sizes(b, error) == 0 &&
        (options->svg == NULL ||
         host_gnuplot_there(options->svg, error) == 0)) {
        if (options->csv != NULL &&
            (b->csv = host_create_over(options->csv)) == NULL) {
            host_fail(error, HOST_INPUT, "%s: %s; choose another file",
                      options->csv, strerror(errno));
        } else if (make_folder(b, error) == 0) {
            host_progress_begin(true);
            (void)measure_all(b, error);
            host_progress_end();
            (void)rmdir(b->folder);
        }
    }
    if (b->csv != NULL) {
        bool well = ferror(b->csv) == 0;
        if ((fclose(b->csv) != 0 || !well) && error->code == 0) {
            host_fail(error, HOST_BROKEN, "%s: %s; choose another place",
                      options->csv, strerror(errno));
        }
    }
    free(b);
    return error->code;
}
