/* `incode bench paper`: Tables 1 to 7 and figure 11 of Cignoni, Laforenza,
 * Perego, Scopigno and Montani (1995), each beside the paper's own figures
 * (paper_figures.h), relation (1) of section 4.3, and the project's goals.
 * Table 1 is measured; all others are run in virtual time (virtual_run.h) on
 * the machines of model.h, and the model is held against real runs on this
 * machine.
 *
 * Memory: that of a run.  Work: some minutes; `quick` takes a tenth of the
 * points, and less than one.
 *
 *     struct host_paper_options options = {.tables = "2", .nodes_max = 256};
 *     if (host_bench_paper(&options, &error) != 0)
 *         return error.code;
 */
#ifndef HOST_BENCH_PAPER_H
#define HOST_BENCH_PAPER_H

#include <stdbool.h>

#include "host/base/error.h"

struct host_paper_options {
    /* Of host_paper_tables, separated by commas; NULL: all. */
    const char *tables;
    const char *strategy; /* this one alone; NULL: all that there are */
    const char *csv, *svg, *bluntfin; /* files, or NULL */
    unsigned nodes_max;
    bool quick;
    bool large; /* Uniform 1,000,000 on 1,024 nodes, too */
};

/* What can be asked for, separated by commas: the numbers of tables, 11 for the
 * figure, `relation`, `check` for the model's, and `goals`. */
extern const char host_paper_tables[];

/* 0, or what a run ends with. */
int host_bench_paper(const struct host_paper_options *options,
                     struct host_error *error);

#endif
