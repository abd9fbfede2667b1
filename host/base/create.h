/* Creates files that no other user can have prepared: new files, tables that
 * are written over, and files in a folder that only this user can enter.  A
 * link is not followed if it is the last name of a path, so a link that another
 * user has planted there has no effect.  Links in the folders above are the
 * user's own choice.  tests/lint refuses other ways of making a file or folder
 * in host/. */
#ifndef HOST_CREATE_H
#define HOST_CREATE_H

#include <fcntl.h> /* the flags of open */
#include <stdio.h>
#include <sys/types.h>

#include "error.h"

/* A new file, open for writing.  -1 and errno: EEXIST if the name exists, even
 * as a link to nothing. */
int host_create(const char *path, mode_t mode);

/* A file whose content is replaced, or a device, open for writing.  NULL and
 * errno: ELOOP if the name is a link. */
FILE *host_create_over(const char *path);

/* The descriptor of a folder that belongs to this user and is closed to others;
 * the folder is made if it does not exist.  -1 with HOST_INPUT: it is a link or
 * no folder, belongs to another user, or others can enter it. */
int host_folder_open(const char *path, struct host_error *error);

/* The same; missing folders above it are made, too. */
int host_folder_open_all(const char *path, struct host_error *error);

/* Opens a plain file of this user's in such a folder, with the flags of open; a
 * file that O_CREAT makes is closed to others.  -1 and errno: EPERM if the file
 * is not plain, belongs to another user, or has a second name. */
int host_folder_file(int folder, const char *name, int flags);

#endif
