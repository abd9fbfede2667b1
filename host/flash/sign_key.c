#include "sign_key.h"

#include <assert.h>
#include <errno.h>
#include <limits.h>
#include <sodium.h>
#include <stdio.h>
#include <string.h>
#include <sys/random.h>
#include <unistd.h>

#include "host/nodes/cube_key.h"
#include "transport/drivers/key_file.h"
#include "transport/secure_wipe.h"

#define MARK "incode-sign "

enum {
    SEED_BYTES = SECURE_KEY_BYTES,
    MARK_BYTES = sizeof MARK - 1,
    SECRET_TEXT = MARK_BYTES + 2 * SEED_BYTES + 1,
    PUBLIC_TEXT = 2 * SIGN_PUBLIC_BYTES + 1
};

static_assert(MARK_BYTES <= (int)KEY_FILE_MARK_MAX, "a mark fits");
static_assert(SEED_BYTES == crypto_sign_ed25519_SEEDBYTES, "bytes of a seed");
static_assert((int)HOST_SIGN_SECRET_BYTES == crypto_sign_ed25519_SECRETKEYBYTES,
              "bytes of a secret half");
static_assert((int)SECURE_KEY_BYTES == (int)SIGN_PUBLIC_BYTES,
              "a key's file holds a public half");

void host_sign_hex(char *text, const uint8_t *bytes, size_t size) {
    (void)sodium_bin2hex(text, 2 * size + 1, bytes, size);
}

void host_sign_key_wipe(struct host_sign_key *pair) {
    secure_wipe(pair->secret, sizeof pair->secret);
}

static void make_pair(struct host_sign_key *pair,
                      const uint8_t seed[SEED_BYTES]) {
    (void)crypto_sign_ed25519_seed_keypair(pair->public, pair->secret, seed);
}

static int name_public(char name[PATH_MAX], const char *path,
                       struct host_error *error) {
    int size = snprintf(name, PATH_MAX, "%s.pub", path);
    if (size >= PATH_MAX) {
        return host_fail(error, HOST_INPUT,
                         "%s: too long a name for FILE.pub beside it; give a "
                         "shorter one",
                         path);
    }
    return access(name, F_OK) == 0
               ? host_fail(error, HOST_INPUT,
                           "%s: is there already, and may be of a key in use; "
                           "give another name",
                           name)
               : 0;
}

/* The secret half first: where that is not written, there is no other. */
static int write_pair(const char *path, const char *public_path,
                      const uint8_t seed[SEED_BYTES],
                      struct host_error *error) {
    struct host_sign_key pair;
    char secret[SECRET_TEXT + 1] = MARK, public[PUBLIC_TEXT + 1];
    make_pair(&pair, seed);
    host_sign_hex(secret + MARK_BYTES, seed, SEED_BYTES);
    host_sign_hex(public, pair.public, sizeof pair.public);
    secret[SECRET_TEXT - 1] = '\n';
    public[PUBLIC_TEXT - 1] = '\n';
    int status = host_key_write(path, secret, SECRET_TEXT, 0600, error);
    if (status == 0) {
        status = host_key_write(public_path, public, PUBLIC_TEXT, 0644, error);
        if (status != 0) {
            (void)unlink(path);
        }
    }
    host_sign_key_wipe(&pair);
    secure_wipe(secret, sizeof secret);
    return status;
}

int host_sign_key_make(const char *path, struct host_error *error) {
    uint8_t seed[SEED_BYTES];
    char public_path[PATH_MAX];
    if (name_public(public_path, path, error) != 0) {
        return error->code;
    }
    if (getrandom(seed, sizeof seed, 0) != (ssize_t)sizeof seed) {
        return host_fail(
            error, HOST_BROKEN,
            "%s: %s; the kernel gives no random numbers, try again", path,
            strerror(errno));
    }
    int status = write_pair(path, public_path, seed, error);
    secure_wipe(seed, sizeof seed);
    return status;
}

/* What is wrong with a secret half's file; the other commands are told of the
 * key that they may have been given instead. */
static int refuse(const char *path, enum key_file_state state,
                  struct host_error *error) {
    int reason = errno;
    uint8_t key[SECURE_KEY_BYTES];
    enum key_file_state as_cube = key_file_read(path, key);
    secure_wipe(key, sizeof key);
    switch (state) {
    case KEY_FILE_SEEN:
        return host_fail(error, HOST_INPUT,
                         "%s: can be read by others, who can sign with it "
                         "then; chmod 600 it, and make another pair if they "
                         "may have",
                         path);
    case KEY_FILE_UNREADABLE:
        return host_fail(error, HOST_INPUT,
                         "%s: %s; give a key's file, or make a pair with: "
                         "incode key --sign FILE",
                         path, strerror(reason));
    case KEY_FILE_WRITABLE:
    case KEY_FILE_FOREIGN:
        return host_fail(error, HOST_INPUT, "%s: %s; %s", path,
                         key_file_text(state).what, key_file_text(state).next);
    default:
        return host_fail(
            error, HOST_INPUT,
            "%s: %s; give the secret half of a pair, made with: incode key "
            "--sign FILE",
            path,
            as_cube == KEY_FILE_GOOD || as_cube == KEY_FILE_SEEN
                ? "a cube's key, or a public half, and not what images are "
                  "signed with"
                : "not a key that images are signed with");
    }
}

int host_sign_key_read(struct host_sign_key *pair, const char *path,
                       struct host_error *error) {
    uint8_t seed[SEED_BYTES];
    enum key_file_state state = key_file_read_marked(path, MARK, seed);
    if (state == KEY_FILE_GOOD) {
        make_pair(pair, seed);
    }
    int status = state == KEY_FILE_GOOD ? 0 : refuse(path, state, error);
    secure_wipe(seed, sizeof seed);
    return status;
}

int host_sign_public_read(uint8_t public[SIGN_PUBLIC_BYTES], const char *path,
                          struct host_error *error) {
    uint8_t seed[SEED_BYTES];
    enum key_file_state state = key_file_read(path, public);
    if (state == KEY_FILE_GOOD || state == KEY_FILE_SEEN) {
        return 0;
    }
    int reason = errno;
    bool secret = state == KEY_FILE_NO_KEY &&
                  key_file_read_marked(path, MARK, seed) < KEY_FILE_WRITABLE;
    secure_wipe(seed, sizeof seed);
    return host_fail(error, HOST_INPUT,
                     "%s: %s; give the public half of a pair, FILE.pub", path,
                     secret ? "the secret half of a pair"
                     : state == KEY_FILE_UNREADABLE
                         ? strerror(reason)
                         : key_file_text(state).what);
}

void host_sign_key_sign(const struct host_sign_key *pair, const uint8_t *bytes,
                        size_t size, uint8_t signature[SIGN_BYTES]) {
    (void)crypto_sign_ed25519_detached(signature, NULL, bytes, size,
                                       pair->secret);
}
