/* What the links of a cube may run over, one row a kind of wire, by which
 * --link, statistics and messages name it.
 *
 * Memory: the table.  Work: none.
 *
 *     for (unsigned i = 0; host_link_name(i) != NULL; i++)
 *         printf("%s: %s\n", host_link_name(i), host_links[i].help);
 */
#ifndef HOST_LINKS_H
#define HOST_LINKS_H

enum host_wire_kind { HOST_WIRE_TCP, HOST_WIRE_SERIAL, HOST_WIRE_MPI };

enum { HOST_WIRE_KINDS = HOST_WIRE_MPI + 1 };

struct host_link_row {
    const char *name;
    const char *help; /* what it is, in one line */
    /* Both ends of a wire as open files of this machine: 0, or -1 with errno;
     * NULL: this machine makes none. */
    int (*pair)(int fds[2]);
    const char *needs; /* what the machine may not allow of it */
};

/* By enum host_wire_kind. */
extern const struct host_link_row host_links[HOST_WIRE_KINDS];

/* NULL past the last. */
const char *host_link_name(unsigned i);

#endif
