/* The names of the choices that a run leaves to the user, by their values, as
 * options, statistics and the simulator have them; a NULL behind the last.
 *
 * Memory: the tables.  Work: none.
 *
 *     for (int i = 0; host_indexes[i] != NULL; i++)
 *         puts(host_indexes[i]);
 */
#ifndef HOST_NAMES_H
#define HOST_NAMES_H

extern const char *const host_partitions[]; /* enum host_partition */
extern const char *const host_indexes[];    /* enum incode_index */
extern const char *const host_face_rules[]; /* enum incode_face_rule */
extern const char *const host_builds[];     /* enum incode_build */

#endif
