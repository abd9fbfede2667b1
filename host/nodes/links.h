/* What the links of a cube may run over, one row a kind of wire, by which
 * --link, statistics and messages name it, and which says how it differs.
 *
 * Memory: the table.  Work: none.
 *
 *     for (unsigned i = 0; host_link_name(i) != NULL; i++)
 *         printf("%s: %s\n", host_link_name(i), host_link_row(i)->help);
 */
#ifndef HOST_LINKS_H
#define HOST_LINKS_H

#include <stdbool.h>

struct host_link {
    const char *name;
    const char *help; /* what it is, in one line */
    /* Both ends of a wire as open files of this machine: 0, or -1 with errno;
     * NULL: this machine makes none. */
    int (*pair)(int fds[2]);
    const char *needs; /* what the machine may not allow of it */
    bool terminals;    /* ends are terminals, opened by name as a port would be,
                          and may be closed and opened again */
    bool ranks;        /* the nodes are ranks, which mpirun starts */
};

/* Row i of those that --link knows, the first being the default; NULL past the
 * last. */
const struct host_link *host_link_row(unsigned i);
const char *host_link_name(unsigned i);

/* Of those, or of those that only a cube file or a board has (`unix`, `mixed`,
 * `uart`); NULL: there is none of that name. */
const struct host_link *host_link_named(const char *name);

#endif
