/* The primitives of struct secure_suite (transport/secure.h) from libsodium. */
#ifndef TRANSPORT_DRIVERS_SECURE_SODIUM_H
#define TRANSPORT_DRIVERS_SECURE_SODIUM_H

#include "transport/secure.h"

extern const struct secure_suite secure_sodium;

/* The file with a cube's key: 64 hexadecimal digits.  A user who can write the
 * file, or read it, can join the cube.  So a file is refused if it belongs to
 * another user than this one or root, or if its group or others can write it.
 * If they can read it, the caller should warn.  After a key has been read, the
 * process leaves no core, and the user's other programs cannot read its memory.
 */

enum { KEY_FILE_MARK_MAX = 32 };

enum key_file_state {
    KEY_FILE_GOOD,
    KEY_FILE_SEEN,       /* good, but others can read it */
    KEY_FILE_WRITABLE,   /* its group or others can write it */
    KEY_FILE_FOREIGN,    /* belongs neither to this user nor to root */
    KEY_FILE_UNREADABLE, /* and errno */
    KEY_FILE_NO_KEY      /* not 64 digits */
};

/* What is wrong, and what to do; of KEY_FILE_GOOD, NULL. */
struct key_file_text {
    const char *what, *next;
};

/* key: SECURE_KEY_BYTES, filled where the state is one of the first two, else
 * zeros; the caller's to wipe. */
enum key_file_state key_file_read(const char *path, uint8_t *key);

/* The same of another secret, whose digits stand behind a mark, at most
 * KEY_FILE_MARK_MAX bytes, so that neither is taken for the other. */
enum key_file_state key_file_read_marked(const char *path, const char *mark,
                                         uint8_t *key);
struct key_file_text key_file_text(enum key_file_state state);

#endif
