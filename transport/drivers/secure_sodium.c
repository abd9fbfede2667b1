#include "secure_sodium.h"

#include <errno.h>
#include <fcntl.h>
#include <sodium.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "transport/secure_wipe.h"
#include "transport/check.h"

/* libsodium leaves parts of keys on the stack: it is wiped where its functions
 * had their frames. */
static __attribute__((noinline)) void burn_stack(void) {
    uint8_t below[2048];
    secure_wipe(below, sizeof below);
}

static void hash(uint8_t out[SECURE_KEY_BYTES],
                 const uint8_t key[SECURE_KEY_BYTES], const uint8_t *in,
                 size_t size) {
    (void)crypto_generichash_blake2b(out, SECURE_KEY_BYTES, in, size, key,
                                     SECURE_KEY_BYTES);
    burn_stack();
}

/* libsodium tells a point of a small order by its status, and may leave `out`
 * as it was. */
static void x25519(uint8_t out[SECURE_KEY_BYTES],
                   const uint8_t secret[SECURE_KEY_BYTES],
                   const uint8_t point[SECURE_KEY_BYTES]) {
    if (crypto_scalarmult_curve25519(out, secret, point) != 0)
        memset(out, 0, SECURE_KEY_BYTES);
    burn_stack();
}

static void make_nonce(uint8_t nonce[12], uint64_t counter) {
    memset(nonce, 0, 12);
    for (unsigned i = 0; i < 8; i++)
        nonce[4 + i] = (uint8_t)(counter >> 8 * i);
}

static void seal(uint8_t *out, const uint8_t *in, size_t size,
                 const uint8_t ad[SECURE_HEAD_BYTES], uint64_t counter,
                 const uint8_t key[SECURE_KEY_BYTES]) {
    uint8_t nonce[12];
    make_nonce(nonce, counter);
    (void)crypto_aead_chacha20poly1305_ietf_encrypt(
        out, NULL, in, size, ad, SECURE_HEAD_BYTES, NULL, nonce, key);
    burn_stack();
}

static bool open_sealed(uint8_t *out, const uint8_t *in, size_t size,
                        const uint8_t ad[SECURE_HEAD_BYTES], uint64_t counter,
                        const uint8_t key[SECURE_KEY_BYTES]) {
    uint8_t nonce[12];
    make_nonce(nonce, counter);
    int status = crypto_aead_chacha20poly1305_ietf_decrypt(
        out, NULL, NULL, in, size + SECURE_TAG_BYTES, ad, SECURE_HEAD_BYTES,
        nonce, key);
    burn_stack();
    return status == 0;
}

const struct secure_suite secure_sodium = {
    .hash = hash, .x25519 = x25519, .seal = seal, .open = open_sealed};

/* --- key file ------------------------------------------------------------- */

enum { DIGITS = 2 * SECURE_KEY_BYTES, TEXT = KEY_FILE_MARK_MAX + DIGITS };

/* As many as there are, up to size; -1 and errno. */
static ssize_t read_all(int fd, char *text, size_t size) {
    size_t have = 0;
    ssize_t got = 1;
    while (have < size && got > 0) {
        got = read(fd, text + have, size - have);
        have += got > 0 ? (size_t)got : 0;
    }
    return got < 0 ? -1 : (ssize_t)have;
}

static bool read_digits(const char text[DIGITS], uint8_t *key) {
    static const char digits[] = "0123456789abcdef";
    for (unsigned i = 0; i < DIGITS; i++) {
        const char *at = memchr(digits, text[i], sizeof digits - 1);
        if (at == NULL)
            return false;
        key[i / 2] = (uint8_t)(key[i / 2] << 4 | (at - digits));
    }
    return true;
}

/* A key that is in memory is not to come to a disk with a core, nor to another
 * program of the user's. */
static void forbid_dumps(void) {
    const struct rlimit none = {0, 0};
    (void)setrlimit(RLIMIT_CORE, &none);
    (void)prctl(PR_SET_DUMPABLE, 0);
}

static enum key_file_state read_key(int fd, const char *mark, uint8_t *key) {
    struct stat about;
    char text[TEXT];
    size_t before = strlen(mark);
    LINK_ASSERT(before <= KEY_FILE_MARK_MAX);
    if (fstat(fd, &about) != 0)
        return KEY_FILE_UNREADABLE;
    if (S_ISDIR(about.st_mode)) {
        errno = EISDIR;
        return KEY_FILE_UNREADABLE;
    }
    if (!S_ISREG(about.st_mode))
        return KEY_FILE_NO_KEY;
    if (about.st_uid != geteuid() && about.st_uid != 0)
        return KEY_FILE_FOREIGN;
    if ((about.st_mode & (S_IWGRP | S_IWOTH)) != 0)
        return KEY_FILE_WRITABLE;
    ssize_t got = read_all(fd, text, before + DIGITS);
    bool whole = got == (ssize_t)before + DIGITS &&
                 memcmp(text, mark, before) == 0 &&
                 read_digits(text + before, key);
    secure_wipe(text, sizeof text);
    if (!whole)
        return got < 0 ? KEY_FILE_UNREADABLE : KEY_FILE_NO_KEY;
    return (about.st_mode & (S_IRGRP | S_IROTH)) != 0 ? KEY_FILE_SEEN
                                                      : KEY_FILE_GOOD;
}

enum key_file_state key_file_read_marked(const char *path, const char *mark,
                                         uint8_t *key) {
    forbid_dumps();
    /* A pipe's other end is not waited for. */
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    enum key_file_state state =
        fd < 0 ? KEY_FILE_UNREADABLE : read_key(fd, mark, key);
    int reason = errno;
    if (fd >= 0)
        close(fd);
    if (state != KEY_FILE_GOOD && state != KEY_FILE_SEEN)
        secure_wipe(key, SECURE_KEY_BYTES);
    errno = reason;
    return state;
}

enum key_file_state key_file_read(const char *path, uint8_t *key) {
    return key_file_read_marked(path, "", key);
}

struct key_file_text key_file_text(enum key_file_state state) {
    static const struct key_file_text texts[] = {
        [KEY_FILE_SEEN] = {"can be read by others, who can join the cube then",
                           "chmod 600 it"},
        [KEY_FILE_WRITABLE] = {"can be written by others than its owner",
                               "chmod 600 it, and see that it is still yours"},
        [KEY_FILE_FOREIGN] = {"belongs to another user, who can change it",
                              "give a file of your own or of root, with a key "
                              "that you trust"},
        [KEY_FILE_UNREADABLE] = {"cannot be read",
                                 "give the key's file, or make one with: "
                                 "incode key FILE"},
        [KEY_FILE_NO_KEY] = {"not a file of 64 hexadecimal digits",
                             "make one with: incode key FILE"}};
    return texts[state];
}
