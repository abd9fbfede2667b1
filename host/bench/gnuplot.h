/* Figures through gnuplot (Debian's gnuplot-nox): a script in, an SVG out.
 *
 * Memory: none.  Work: a process.
 *
 *     if (host_gnuplot_there("a.svg", &error) == 0)
 *         host_gnuplot_draw(script, "a.svg", &error);
 */
#ifndef HOST_BENCH_GNUPLOT_H
#define HOST_BENCH_GNUPLOT_H

#include <stdio.h>

#include "host/base/error.h"

/* 0; HOST_INPUT where there is no gnuplot, which the file needs. */
int host_gnuplot_there(const char *path, struct host_error *error);

/* What the script, from its beginning, writes to standard output becomes the
 * file.  0, HOST_INPUT where it cannot be made, or HOST_BROKEN where gnuplot
 * does not draw. */
int host_gnuplot_draw(FILE *script, const char *path, struct host_error *error);

#endif
