/* What the parts of the cube file's reader share: its settings as libconfig has
 * them (cube_values.c), its links (cube_wires.c), its boards (cube_boards.c)
 * and the lines to them (cube_pins.c).
 *
 * Memory: none.  Work: that of the setting; all wires, where wires are
 * compared.
 *
 *     int window = 0;
 *     if (!host_cube_take_number(root, "window", 1, 64, &window))
 *         return host_cube_wrong(&file, root, &error, "window: give 1 to 64");
 */
#ifndef HOST_CUBE_READER_H
#define HOST_CUBE_READER_H

#include <libconfig.h>

#include "cube_file.h"

/* Whether the library can be given a text: HOST_INPUT with the line where it
 * asks for other files, or for more than any cube file has.  Work: a pass. */
int host_cube_scan(const char *path, const char *text,
                   struct host_error *error);

/* HOST_INPUT with the line of a setting; NULL: the first. */
int host_cube_wrong(const struct host_cube_file *file,
                    const config_setting_t *where, struct host_error *error,
                    const char *what);

/* A member that is not one of `names`, which NULL ends, is a mistake in
 * writing. */
int host_cube_check_names(const struct host_cube_file *file,
                          const config_setting_t *group,
                          const char *const names[], struct host_error *error);

/* Whether it is a whole number from lo to hi. */
bool host_cube_is_number(const config_setting_t *setting, int lo, int hi,
                         int *value);

/* The same of a member, which may be left out: *value stays as it is. */
bool host_cube_take_number(const config_setting_t *group, const char *name,
                           int lo, int hi, int *value);

/* "HOST:PORT", "[ADDRESS]:PORT": looked up once, before the run. */
int host_cube_resolve(const struct host_cube_file *file,
                      const config_setting_t *where,
                      struct tcp_address *address, struct host_error *error);

/* A file's name as it is to be opened, beside the cube file unless it begins
 * with a slash: 0, or -1 where it is none, or does not fit. */
int host_cube_beside(const struct host_cube_file *file,
                     const config_setting_t *where, char *path, size_t size);

/* As it is written, in numbers; a path as it is. */
void host_cube_print_address(const struct tcp_address *address, char *text,
                             size_t size);

/* What the nodes run on: one board for all, or by name for some. */
int host_cube_read_boards(struct host_cube_file *file,
                          const config_setting_t *root,
                          struct host_error *error);

/* Whether bare boards have the wires and the memory that they need, when all
 * else is read.  Sets what their UARTs are set to. */
int host_cube_check_boards(struct host_cube_file *file,
                           const config_setting_t *root,
                           struct host_error *error);

/* Makes room for the pins of so many entries of `nodes`: 0, or HOST_BROKEN. */
int host_cube_make_pins(struct host_cube_file *file, unsigned entries,
                        struct host_error *error);

/* Adds the reset and boot line of an entry of `nodes`. */
int host_cube_read_pins(struct host_cube_file *file,
                        const config_setting_t *group, unsigned node,
                        struct host_error *error);

/* Adds what DTR and RTS of a wire's port do, and sets what they are beside. */
int host_cube_read_modem(struct host_cube_file *file,
                         const config_setting_t *group,
                         struct host_cube_wire *wire, struct host_error *error);

/* Adds the wire of a group to file->wire, which has room for it. */
int host_cube_read_wire(struct host_cube_file *file, config_setting_t *group,
                        struct host_error *error);

/* Whether each wire of the cube is there once, and the host's. */
int host_cube_check_wires(const struct host_cube_file *file,
                          const config_setting_t *list,
                          struct host_error *error);

/* Whether no two links share an end. */
int host_cube_check_ends(const struct host_cube_file *file,
                         struct host_error *error);

/* The wire between two nodes, either way round, and how many there are. */
const struct host_cube_wire *
host_cube_between(const struct host_cube_file *file, unsigned a, unsigned b,
                  unsigned *count);

/* Of an entry of `nodes`: `ssh` and `folder`; of the whole file: that nobody
 * else starts such a node. */
int host_cube_read_ssh(struct host_cube_file *file,
                       const config_setting_t *group, unsigned node,
                       struct host_error *error);
int host_cube_check_ssh(const struct host_cube_file *file,
                        struct host_error *error);

#endif
