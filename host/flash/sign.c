#include "sign.h"

#include <assert.h>
#include <errno.h>
#include <limits.h>
#include <sodium.h>
#include <stdalign.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <unistd.h>

#include "node/loader/image.h"
#include "transport/drivers/sign_sodium.h"
#include "host/nodes/cube_file.h"
#include "transport/drivers/secure_sodium.h"
#include "transport/secure_wipe.h"
#include "host/base/options.h"
#include "host/base/text.h"
#include "host/formats/output.h"
#include "host/nodes/boards.h"
#include "node/version.h"

int host_image_open(struct host_image *file, const char *path,
                    struct host_error *error) {
    if (host_source_open_bounded(&file->source, path, LOADER_IMAGE_MAX,
                                 "an image", error) != 0)
        return error->code;
    size_t bytes = file->source.bytes;
    bool good =
        bytes >= LOADER_HEADER_BYTES &&
        loader_image_unpack(&file->image, file->source.data) == LOADER_GOOD;
    size_t all = LOADER_HEADER_BYTES + (good ? (size_t)file->image.bytes : 0);
    if (!good) {
        host_fail(error, HOST_INPUT,
                  "%s: no image, or one with a damaged header; make firmware "
                  "builds images, and incode sign makes one of a board's "
                  "binary",
                  path);
    } else if (bytes != all) {
        host_fail(error, HOST_INPUT,
                  "%s: %zu bytes, %s than the %zu that its header tells of; "
                  "copy or build it anew",
                  path, bytes, bytes < all ? "fewer" : "more", all);
    } else {
        return 0;
    }
    host_image_close(file);
    return error->code;
}

void host_image_close(struct host_image *file) {
    host_source_close(&file->source);
}

void host_image_digest(const uint8_t *header, const uint8_t *code, size_t size,
                       uint8_t digest[SIGN_DIGEST_BYTES]) {
    alignas(64) uint8_t hash[SIGN_HASH_BYTES];
    sign_sodium.begin(hash);
    sign_sodium.add(hash, header, LOADER_NAMED_BYTES);
    sign_sodium.add(hash, code, size);
    sign_sodium.end(hash, digest);
}

enum loader_fault host_image_fault(const struct host_image *file) {
    uint8_t digest[SIGN_DIGEST_BYTES];
    const uint8_t *header = file->source.data;
    host_image_digest(header, header + LOADER_HEADER_BYTES, file->image.bytes,
                      digest);
    return memcmp(digest, file->image.digest, sizeof digest) != 0
               ? LOADER_WRONG_DIGEST
               : loader_image_signed(header, &sign_sodium, file->image.key);
}

/* --- sign key ------------------------------------------------------------- */

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

/* As text: 2 * size digits, and 0. */
static void host_sign_hex(char *text, const uint8_t *bytes, size_t size) {
    (void)sodium_bin2hex(text, 2 * size + 1, bytes, size);
}

static void host_sign_key_wipe(struct host_sign_key *pair) {
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
        if (status != 0)
            (void)unlink(path);
    }
    host_sign_key_wipe(&pair);
    secure_wipe(secret, sizeof secret);
    return status;
}

int host_sign_key_make(const char *path, struct host_error *error) {
    uint8_t seed[SEED_BYTES];
    char public_path[PATH_MAX];
    if (name_public(public_path, path, error) != 0)
        return error->code;
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

/* HOST_INPUT: also of a file that others can read, or that is a cube's key. */
static int host_sign_key_read(struct host_sign_key *pair, const char *path,
                              struct host_error *error) {
    uint8_t seed[SEED_BYTES];
    enum key_file_state state = key_file_read_marked(path, MARK, seed);
    if (state == KEY_FILE_GOOD)
        make_pair(pair, seed);
    int status = state == KEY_FILE_GOOD ? 0 : refuse(path, state, error);
    secure_wipe(seed, sizeof seed);
    return status;
}

int host_sign_public_read(uint8_t public[SIGN_PUBLIC_BYTES], const char *path,
                          struct host_error *error) {
    uint8_t seed[SEED_BYTES];
    enum key_file_state state = key_file_read(path, public);
    if (state == KEY_FILE_GOOD || state == KEY_FILE_SEEN)
        return 0;
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

/* The signature of these bytes. */
static void host_sign_key_sign(const struct host_sign_key *pair,
                               const uint8_t *bytes, size_t size,
                               uint8_t signature[SIGN_BYTES]) {
    (void)crypto_sign_ed25519_detached(signature, NULL, bytes, size,
                                       pair->secret);
}

/* --- sign ----------------------------------------------------------------- */

enum { ADDRESS = 0x10000 }; /* that boards' images are linked for */

struct sign {
    const char *path, *key, *board, *version, *output;
    uint64_t number, address;
    bool has_number, has_address, no_way_back;
    struct host_error *error;
};

/* --- the arguments -------------------------------------------------------- */

static void take_value(const char *option, const char *value, uint64_t *number,
                       bool *given, struct host_error *error) {
    char *end = NULL;
    bool hex = strncmp(value, "0x", 2) == 0 && value[2] != '\0';
    unsigned long long all = hex ? strtoull(value, &end, 16) : 0;
    *given = true;
    if (hex && *end == '\0' && all <= UINT32_MAX)
        *number = all;
    else
        (void)host_option_number(option, value, 0, UINT32_MAX, number, error);
}

static void take_number(void *into, const char *value,
                        struct host_error *error) {
    struct sign *s = into;
    take_value("number", value, &s->number, &s->has_number, error);
}

static void take_address(void *into, const char *value,
                         struct host_error *error) {
    struct sign *s = into;
    take_value("address", value, &s->address, &s->has_address, error);
}

static void take_version(void *into, const char *value,
                         struct host_error *error) {
    bool printable = *value != '\0';
    for (const char *at = value; *at != '\0'; at++)
        printable = *at > ' ' && *at < 0x7f && printable;
    ((struct sign *)into)->version = value;
    if (!printable || strlen(value) > LOADER_VERSION_BYTES) {
        host_fail(error, HOST_USAGE,
                  "--version %s: not a word of 1 to %d letters, digits and "
                  "signs; give such a one",
                  value, (int)LOADER_VERSION_BYTES);
    }
}

static const struct host_option sign_rows[] = {
    {"key", 0, "FILE",
     "The secret half of a pair, as incode key --sign makes it",
     HOST_AT(struct sign, key)},
    {"board", 0, "NAME",
     "IMAGE is a board's binary, and of this one: it becomes an image",
     HOST_AT(struct sign, board)},
    {"version", 0, "TEXT",
     "For people. Default: the image's, or that of this program",
     .take = take_version},
    {"number", 0, "N",
     "How you count your images: a later one is larger. Default: the image's, "
     "or 1",
     .take = take_number},
    {"no-way-back", 0, NULL,
     "A board that has run this image takes none with a lower number",
     HOST_AT(struct sign, no_way_back)},
    {"address", 0, "A",
     "That the binary is linked for. Default: the image's, or 0x10000",
     .take = take_address},
    {"output", 'o', "FILE", "Write it there. Default: to IMAGE itself",
     HOST_AT(struct sign, output)},
    {0}};

static const struct host_option image_rows[] = {
    {"key", 0, "FILE.pub",
     "Is it signed with this pair? The exit status is 5 if not",
     HOST_AT(struct sign, key)},
    {0}};

static int check_board(const struct sign *s) {
    char allowed[HOST_BARE_NAMES];
    host_bare_names(allowed);
    return host_bare_named(s->board) != NULL
               ? 0
               : host_fail(s->error, HOST_USAGE,
                           "--board %s: no board without a system; allowed: %s",
                           s->board, allowed);
}

/* --- sign ----------------------------------------------------------------- */

/* What is no image is a board's binary, if that is said; but neither of these:
 * what was made of one would pass for an image, and come up on no board. */
static int check_binary(const struct sign *s,
                        const struct host_source *source) {
    static const char elf[] = "\177ELF", image[] = "incodeI1";
    if (s->board == NULL) {
        return host_fail(s->error, HOST_USAGE,
                         "%s: no image, or one with a damaged header; if it is "
                         "a board's binary, say which with --board NAME",
                         s->path);
    }
    if (source->bytes >= sizeof elf - 1 &&
        memcmp(source->data, elf, sizeof elf - 1) == 0) {
        return host_fail(s->error, HOST_INPUT,
                         "%s: an ELF file; make a binary of it with: objcopy "
                         "-O binary",
                         s->path);
    }
    if (source->bytes >= sizeof image - 1 &&
        memcmp(source->data, image, sizeof image - 1) == 0) {
        return host_fail(s->error, HOST_INPUT,
                         "%s: an image with a damaged header; copy or build it "
                         "anew",
                         s->path);
    }
    return 0;
}

/* What the image is to be, and where its code begins in the file. */
static int describe(const struct sign *s, const struct host_source *source,
                    struct loader_image *image, size_t *code) {
    bool old = source->bytes >= LOADER_HEADER_BYTES &&
               loader_image_unpack(image, source->data) == LOADER_GOOD;
    *code = old ? LOADER_HEADER_BYTES : 0;
    if (old && source->bytes - *code != image->bytes) {
        return host_fail(s->error, HOST_INPUT,
                         "%s: an image that is not whole; copy or build it "
                         "anew",
                         s->path);
    }
    if (!old && check_binary(s, source) != 0)
        return s->error->code;
    if (source->bytes - *code > LOADER_IMAGE_MAX - LOADER_HEADER_BYTES) {
        return host_fail(s->error, HOST_INPUT,
                         "%s: %zu bytes, and a board takes %d; give a board's "
                         "binary",
                         s->path, source->bytes, LOADER_IMAGE_MAX);
    }
    if (!old) {
        *image = (struct loader_image){.bytes = (uint32_t)source->bytes,
                                       .address = ADDRESS,
                                       .number = 1,
                                       .version = NODE_VERSION};
    }
    if (s->board != NULL) {
        memset(image->board, 0, sizeof image->board);
        snprintf(image->board, sizeof image->board, "%s", s->board);
    }
    if (s->version != NULL) {
        memset(image->version, 0, sizeof image->version);
        snprintf(image->version, sizeof image->version, "%s", s->version);
    }
    image->number = s->has_number ? (uint32_t)s->number : image->number;
    image->address = s->has_address ? (uint32_t)s->address : image->address;
    image->flags |= s->no_way_back ? LOADER_NO_WAY_BACK : 0;
    return 0;
}

/* An image is taken from somewhere else under its own digest alone. */
static int check_old(const struct sign *s, const struct host_source *source) {
    struct host_image old = {.source = *source};
    (void)loader_image_unpack(&old.image, source->data);
    return host_image_fault(&old) == LOADER_WRONG_DIGEST
               ? host_fail(s->error, HOST_INPUT,
                           "%s: its code is not what its header says; copy or "
                           "build it anew",
                           s->path)
               : 0;
}

static int make(const struct sign *s, const struct host_source *source,
                const struct host_sign_key *pair,
                uint8_t header[LOADER_HEADER_BYTES], size_t *code) {
    struct loader_image image;
    if (describe(s, source, &image, code) != 0 ||
        (*code > 0 && check_old(s, source) != 0))
        return s->error->code;
    loader_image_pack(&image, header);
    host_image_digest(header, source->data + *code, image.bytes, image.digest);
    memcpy(image.key, pair->public, sizeof image.key);
    loader_image_pack(&image, header);
    host_sign_key_sign(pair, header, LOADER_SIGNED_BYTES, image.signature);
    loader_image_pack(&image, header);
    return 0;
}

static int write_image(const struct sign *s, const struct host_source *source,
                       const uint8_t header[LOADER_HEADER_BYTES], size_t code) {
    struct host_output out;
    const char *path = s->output == NULL ? s->path : s->output;
    if (host_output_open(&out, path, s->error) != 0)
        return s->error->code;
    host_output_bytes(&out, header, LOADER_HEADER_BYTES);
    host_output_bytes(&out, source->data + code, source->bytes - code);
    (void)host_output_close(&out, 1, s->error);
    return host_output_commit(s->error);
}

int host_sign(int argc, char **argv, struct host_error *error) {
    static const struct host_options options = {
        .rows = sign_rows,
        .one = "IMAGE",
        .one_at = offsetof(struct sign, path),
        .needed = true,
        .arguments = "IMAGE --key FILE",
        .about =
            "Makes an image of a board's binary, or takes one as it is, and "
            "signs it: boards take what is signed with the pair whose public "
            "half their loader has.\v"
            "Example:\n"
            "  incode key --sign lab.sign\n"
            "  incode sign build/firmware/mps2-an500.img --key lab.sign "
            "--number 2"};
    struct sign s = {.error = error};
    struct host_source source;
    struct host_sign_key pair;
    uint8_t header[LOADER_HEADER_BYTES];
    size_t code;
    if (host_options_parse(&options, argc, argv, false, &s, NULL, error) != 0 ||
        (s.board != NULL && check_board(&s) != 0))
        return error->code;
    if (s.key == NULL) {
        return host_fail(error, HOST_USAGE,
                         "--key: is missing; give the secret half of a pair, "
                         "made with: incode key --sign FILE");
    }
    if (host_sign_key_read(&pair, s.key, error) != 0)
        return error->code;
    /* An ELF file is longer than its binary, and is told apart. */
    int status = host_source_open_bounded(
        &source, s.path, 16 * LOADER_IMAGE_MAX, "an image", error);
    if (status == 0) {
        status = make(&s, &source, &pair, header, &code);
        status = status == 0 ? write_image(&s, &source, header, code) : status;
        host_source_close(&source);
    }
    host_sign_key_wipe(&pair);
    return status;
}

/* --- image ---------------------------------------------------------------- */

static void print_hex(const char *name, const uint8_t *bytes, size_t size) {
    char text[2 * SIGN_BYTES + 1];
    host_sign_hex(text, bytes, size);
    printf("%-10s %s\n", name, text);
}

static void print_image(const struct loader_image *image) {
    host_say(stdout, "board      %s\n", image->board);
    host_say(stdout, "version    %s\n", image->version);
    printf("number     %u%s\n", image->number,
           (image->flags & LOADER_NO_WAY_BACK) != 0
               ? ": a board that has run it takes none with a lower one"
               : "");
    printf("code       %u byte%s, for address 0x%08x\n", image->bytes,
           host_text_s(image->bytes), image->address);
    print_hex("digest", image->digest, sizeof image->digest);
}

/* What to do about it, and the exit status. */
static int judge(const struct sign *s, const struct host_image *file,
                 const uint8_t wanted[SIGN_PUBLIC_BYTES]) {
    enum loader_fault fault = host_image_fault(file);
    if (fault == LOADER_UNSIGNED)
        printf("signed by  nobody\n");
    else
        print_hex("signed by", file->image.key, sizeof file->image.key);
    if (fault == LOADER_GOOD && s->key != NULL)
        fault = loader_image_signed(file->source.data, &sign_sodium, wanted);
    if (fault == LOADER_GOOD || (fault == LOADER_UNSIGNED && s->key == NULL))
        return 0;
    if (fault == LOADER_WRONG_DIGEST || fault == LOADER_WRONG_SIGNATURE) {
        return host_fail(s->error, HOST_UNVERIFIED,
                         "%s: %s; copy or build it anew", s->path,
                         loader_fault_text(fault));
    }
    return host_fail(s->error, HOST_UNVERIFIED,
                     "%s: %s; sign it with: incode sign %s --key FILE", s->path,
                     loader_fault_text(fault), s->path);
}

int host_image_show(int argc, char **argv, struct host_error *error) {
    static const struct host_options options = {
        .rows = image_rows,
        .one = "IMAGE",
        .one_at = offsetof(struct sign, path),
        .needed = true,
        .arguments = "IMAGE",
        .about = "Says what is in an image: board, version, number, digest, "
                 "and by whom it is signed. One that is damaged, or falsely "
                 "signed, is a failure."};
    struct sign s = {.error = error};
    struct host_image file;
    uint8_t wanted[SIGN_PUBLIC_BYTES];
    if (host_options_parse(&options, argc, argv, false, &s, NULL, error) != 0 ||
        (s.key != NULL && host_sign_public_read(wanted, s.key, error) != 0) ||
        host_image_open(&file, s.path, error) != 0)
        return error->code;
    print_image(&file.image);
    int status = judge(&s, &file, wanted);
    host_image_close(&file);
    return status;
}
