/* Where a name leads in the end, by the kernel's own word: links are followed
 * by it alone, so that one which the system does not follow (another user's in
 * a sticky directory, or on a mount without links) is not followed here.
 *
 * Memory: a name.  Work: a handful of system calls.
 *
 *     char *target = host_target("out.vtu");
 *     if (target == NULL)
 *         return host_fail(&error, HOST_INPUT, "%s", strerror(errno));
 */
#ifndef HOST_TARGET_H
#define HOST_TARGET_H

#include <stdbool.h>
#include <sys/stat.h>

/* What `path` is in the end, links followed, also those that lead to where
 * nothing is yet (there a file is made and removed at once).  To be freed; NULL
 * with errno where the kernel does not follow it. */
char *host_target(const char *path);

/* Whether `name` is this very file, and no link to it. */
bool host_is_file(const struct stat *file, const char *name);

#endif
