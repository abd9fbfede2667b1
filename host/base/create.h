/* Files that nobody else has prepared: new ones, tables that are written over,
 * and those in a folder that is this user's alone.  No link is followed at the
 * last name of a path, so that a link that somebody has planted there leads
 * nowhere; links above it are the user's own choice.  tests/lint refuses other
 * ways of making a file or a folder in host/.
 *
 * Memory: none.  Work: a few system calls each.
 *
 *     int folder = host_folder_open("lab.cube.d", &error);
 *     int chip = host_folder_file(folder, "flash0", O_RDWR | O_CREAT);
 *     int key = host_create("lab.key", 0600);
 */
#ifndef HOST_CREATE_H
#define HOST_CREATE_H

#include <stdio.h>
#include <sys/types.h>

#include "host/base/error.h"

/* A new file, open for writing.  -1 and errno: EEXIST where anything is there,
 * be it a link to nothing. */
int host_create(const char *path, mode_t mode);

/* A file whose content is replaced, or a device, open for writing.  NULL and
 * errno: ELOOP where a link is there. */
FILE *host_create_over(const char *path);

/* A folder that belongs to this user and is closed to others, which is made
 * where nothing is there; its descriptor.  -1 with HOST_INPUT: it is a link, or
 * another user's, or others can enter it. */
int host_folder_open(const char *path, struct host_error *error);

/* The same, and the folders above it are made as far as they are missing. */
int host_folder_open_all(const char *path, struct host_error *error);

/* A plain file of this user's in such a folder, with the flags of open; one
 * that O_CREAT makes is closed to others.  -1 and errno: EPERM where what is
 * there is no plain file, or another user's, or has another name elsewhere. */
int host_folder_file(int folder, const char *name, int flags);

#endif
