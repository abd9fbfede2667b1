/* Signing pairs and images as files: what is made is good, and what is not is
 * refused with a way on. */

#include <sys/stat.h>
#include <unistd.h>

#include "host/flash/sign.h"
#include "host/nodes/cube_file.h"
#include "transport/bytes.h"
#include "transport/drivers/sign_sodium.h"
#include "transport/frame.h"
#include "tests/unit/test.h"

enum { CODE = 5000, WORDS_MAX = 16 };

static char folder[] = "/tmp/incode-sign.XXXXXX";
static struct host_error error;

/* A file's name in the folder; a few at a time. */
static const char *in(const char *name) {
    static char names[8][96];
    static unsigned next;
    char *at = names[next++ % 8];
    snprintf(at, sizeof names[0], "%s/%s", folder, name);
    return at;
}

static void put(const char *name, const void *bytes, size_t size) {
    FILE *file = fopen(in(name), "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

static int set_up(void **unused) {
    uint8_t code[CODE];
    (void)unused;
    assert_non_null(mkdtemp(folder));
    for (unsigned i = 0; i < CODE; i++)
        code[i] = (uint8_t)(i * 7);
    put("code", code, sizeof code);
    assert_int_equal(host_sign_key_make(in("lab"), &error), 0);
    assert_int_equal(host_sign_key_make(in("other"), &error), 0);
    assert_int_equal(host_key_make(in("cube"), &error), 0);
    return 0;
}

static int tear_down(void **unused) {
    static const char *const names[] = {"code", "lab",   "lab.pub",  "other",
                                        "cube", "image", "other.pub"};
    (void)unused;
    for (unsigned i = 0; i < sizeof names / sizeof names[0]; i++)
        assert_int_equal(unlink(in(names[i])), 0);
    return rmdir(folder);
}

/* incode sign WORD..., up to NULL; argp may put them in another order. */
static int sign(const char *const *words) {
    static char name[] = "incode sign";
    static char copies[WORDS_MAX][128];
    char *argv[WORDS_MAX + 2] = {name};
    int argc = 1;
    for (; words[argc - 1] != NULL; argc++) {
        snprintf(copies[argc - 1], sizeof copies[0], "%s", words[argc - 1]);
        argv[argc] = copies[argc - 1];
    }
    error = (struct host_error){0};
    return host_sign(argc, argv, &error);
}

/* of `code`, by `key` */
static void make_image(const char *key) {
    const char *const words[] = {in("code"),  "--key",      in(key),
                                 "--board",   "mps2-an500", "--number",
                                 "5",         "--version",  "1.2",
                                 "--output",  in("image"),  "--no-way-back",
                                 "--address", "0x20000",    NULL};
    assert_int_equal(sign(words), 0);
}

static enum loader_fault signed_by(const char *public) {
    struct host_image file;
    uint8_t key[SIGN_PUBLIC_BYTES];
    error = (struct host_error){0};
    assert_int_equal(host_sign_public_read(key, in(public), &error), 0);
    assert_int_equal(host_image_open(&file, in("image"), &error), 0);
    enum loader_fault fault = host_image_fault(&file);
    if (fault == LOADER_GOOD)
        fault = loader_image_signed(file.source.data, &sign_sodium, key);
    host_image_close(&file);
    return fault;
}

TEST(a_binary_becomes_an_image) {
    struct host_image file;
    make_image("lab");
    assert_int_equal(host_image_open(&file, in("image"), &error), 0);
    assert_int_equal(file.image.bytes, CODE);
    assert_int_equal(file.image.number, 5);
    assert_int_equal(file.image.address, 0x20000);
    assert_int_equal(file.image.flags, LOADER_NO_WAY_BACK);
    assert_string_equal(file.image.board, "mps2-an500");
    assert_string_equal(file.image.version, "1.2");
    assert_int_equal(file.source.data[LOADER_HEADER_BYTES + 3], 21);
    host_image_close(&file);
    assert_int_equal(signed_by("lab.pub"), LOADER_GOOD);
    assert_int_equal(signed_by("other.pub"), LOADER_WRONG_KEY);
}

TEST(an_image_is_signed_anew_in_its_place) {
    struct host_image file;
    make_image("lab");
    const char *const words[] = {in("image"), "--key", in("other"), NULL};
    assert_int_equal(sign(words), 0);
    assert_int_equal(signed_by("lab.pub"), LOADER_WRONG_KEY);
    assert_int_equal(signed_by("other.pub"), LOADER_GOOD);
    assert_int_equal(host_image_open(&file, in("image"), &error), 0);
    assert_int_equal(file.image.number, 5);
    assert_string_equal(file.image.version, "1.2");
    assert_int_equal(file.source.bytes, LOADER_HEADER_BYTES + CODE);
    host_image_close(&file);
}

/* "abc", as b2sum -l 256 has it. */
TEST(the_digest_is_blake2b_of_name_and_code) {
    static const uint8_t expected[SIGN_DIGEST_BYTES] = {
        0xbd, 0xdd, 0x81, 0x3c, 0x63, 0x42, 0x39, 0x72, 0x31, 0x71, 0xef,
        0x3f, 0xee, 0x98, 0x57, 0x9b, 0x94, 0x96, 0x4e, 0x3b, 0xb1, 0xcb,
        0x3e, 0x42, 0x72, 0x62, 0xc8, 0xc0, 0x68, 0xd5, 0x23, 0x19};
    _Alignas(64) uint8_t hash[SIGN_HASH_BYTES];
    uint8_t digest[SIGN_DIGEST_BYTES];
    sign_sodium.begin(hash);
    sign_sodium.add(hash, "a", 1);
    sign_sodium.add(hash, "bc", 2);
    sign_sodium.end(hash, digest);
    assert_memory_equal(digest, expected, sizeof digest);
}

TEST(false_code_and_false_signatures_are_found) {
    struct host_image file;
    uint8_t bytes[LOADER_HEADER_BYTES + CODE];
    struct loader_image image;
    make_image("lab");
    assert_int_equal(host_image_open(&file, in("image"), &error), 0);
    memcpy(bytes, file.source.data, sizeof bytes);
    host_image_close(&file);
    bytes[LOADER_HEADER_BYTES + CODE - 1] ^= 1;
    put("image", bytes, sizeof bytes);
    assert_int_equal(signed_by("lab.pub"), LOADER_WRONG_DIGEST);
    const char *const words[] = {in("image"), "--key", in("lab"), NULL};
    assert_int_equal(sign(words), HOST_INPUT);
    bytes[LOADER_HEADER_BYTES + CODE - 1] ^= 1;
    assert_int_equal(loader_image_unpack(&image, bytes), LOADER_GOOD);
    image.signature[10] ^= 1;
    loader_image_pack(&image, bytes);
    put("image", bytes, sizeof bytes);
    assert_int_equal(signed_by("lab.pub"), LOADER_WRONG_SIGNATURE);
    memset(image.key, 0, sizeof image.key);
    loader_image_pack(&image, bytes);
    put("image", bytes, sizeof bytes);
    assert_int_equal(signed_by("lab.pub"), LOADER_UNSIGNED);
}

/* What a board's loader has against it; slots.h has the rules, incoming.c the
 * order. */
static enum loader_fault refusal(const uint8_t *bytes, size_t size,
                                 const uint8_t key[SIGN_PUBLIC_BYTES]) {
    struct loader_image image;
    uint8_t digest[SIGN_DIGEST_BYTES];
    enum loader_fault fault = loader_image_unpack(&image, bytes);
    if (fault != LOADER_GOOD || image.bytes != size - LOADER_HEADER_BYTES)
        return LOADER_NO_IMAGE;
    fault = loader_image_signed(bytes, &sign_sodium, key);
    host_image_digest(bytes, bytes + LOADER_HEADER_BYTES, image.bytes, digest);
    return fault == LOADER_GOOD &&
                   memcmp(digest, image.digest, sizeof digest) != 0
               ? LOADER_WRONG_DIGEST
               : fault;
}

/* The CRC is no secret: who changes a bit makes it right again. */
TEST(every_bit_of_an_image_is_held) {
    enum { CRC = LOADER_HEADER_BYTES - 4, SIZE = LOADER_HEADER_BYTES + CODE };
    struct host_image file;
    uint8_t bytes[SIZE], whole[SIZE], key[SIGN_PUBLIC_BYTES];
    make_image("lab");
    assert_int_equal(host_sign_public_read(key, in("lab.pub"), &error), 0);
    assert_int_equal(host_image_open(&file, in("image"), &error), 0);
    memcpy(whole, file.source.data, SIZE);
    host_image_close(&file);
    assert_int_equal(refusal(whole, SIZE, key), LOADER_GOOD);
    for (unsigned bit = 0; bit < 8 * SIZE; bit += bit < 8 * 512 ? 1 : 61) {
        memcpy(bytes, whole, SIZE);
        bytes[bit / 8] ^= (uint8_t)(1u << bit % 8);
        assert_int_not_equal(refusal(bytes, SIZE, key), LOADER_GOOD);
        if (bit / 8 < CRC) {
            bytes_put32(bytes + CRC, frame_crc32c(0, bytes, CRC));
            assert_int_not_equal(refusal(bytes, SIZE, key), LOADER_GOOD);
        }
    }
}

/* At every length, and with a byte too many. */
TEST(an_image_that_is_not_whole_is_refused) {
    struct host_image file;
    uint8_t bytes[LOADER_HEADER_BYTES + CODE + 1] = {0};
    make_image("lab");
    assert_int_equal(host_image_open(&file, in("image"), &error), 0);
    memcpy(bytes, file.source.data, sizeof bytes - 1);
    host_image_close(&file);
    for (size_t size = 0; size <= sizeof bytes; size++) {
        if (size == sizeof bytes - 1 || (size % 97 != 0 && size < CODE))
            continue;
        error = (struct host_error){0};
        put("image", bytes, size);
        assert_int_equal(host_image_open(&file, in("image"), &error),
                         HOST_INPUT);
        assert_non_null(strstr(error.text, "; "));
    }
    error = (struct host_error){0};
    assert_int_equal(host_image_open(&file, in("no"), &error), HOST_INPUT);
}

TEST(a_file_without_an_end_is_no_image) {
    const char *const words[] = {"/dev/zero", "--key",      in("lab"),
                                 "--board",   "mps2-an500", NULL};
    struct host_image file;
    error = (struct host_error){0};
    assert_int_equal(host_image_open(&file, "/dev/zero", &error), HOST_INPUT);
    assert_non_null(strstr(error.text, "the most that an image has; "));
    assert_int_equal(sign(words), HOST_INPUT);
    assert_non_null(strstr(error.text, "the most that an image has; "));
}

static void refuses_key(const char *name, const char *what) {
    const char *const words[] = {in("image"), "--key", in(name), NULL};
    assert_int_equal(sign(words), HOST_INPUT);
    assert_non_null(strstr(error.text, what));
    assert_non_null(strstr(error.text, "; "));
}

TEST(keys_of_the_other_kind_are_refused) {
    uint8_t public[SIGN_PUBLIC_BYTES];
    make_image("lab");
    refuses_key("cube", "a cube's key");
    refuses_key("lab.pub", "a public half");
    refuses_key("code", "not a key");
    refuses_key("no", "No such file");
    error = (struct host_error){0};
    assert_int_equal(host_sign_public_read(public, in("lab"), &error),
                     HOST_INPUT);
    assert_non_null(strstr(error.text, "secret half"));
}

TEST(a_secret_half_is_its_owner_s_alone) {
    struct stat about;
    make_image("lab");
    assert_int_equal(stat(in("lab"), &about), 0);
    assert_int_equal(about.st_mode & 07777, 0600);
    assert_int_equal(chmod(in("lab"), 0640), 0);
    refuses_key("lab", "read by others");
    assert_int_equal(chmod(in("lab"), 0602), 0);
    refuses_key("lab", "written by others");
    assert_int_equal(chmod(in("lab"), 0600), 0);
}

/* Neither half replaces a file, and one alone is not left. */
TEST(a_pair_is_made_whole_or_not_at_all) {
    error = (struct host_error){0};
    assert_int_equal(host_sign_key_make(in("lab"), &error), HOST_INPUT);
    put("new.pub", "", 0);
    error = (struct host_error){0};
    assert_int_equal(host_sign_key_make(in("new"), &error), HOST_INPUT);
    assert_int_equal(access(in("new"), F_OK), -1);
    assert_int_equal(unlink(in("new.pub")), 0);
    error = (struct host_error){0};
    assert_int_equal(host_sign_key_make("/no/such/folder/key", &error),
                     HOST_INPUT);
}

TEST(wrong_usage_is_told) {
    static const char *const wrong[][2] = {
        {"--board", "linux"},
        {"--board", "mps3"},
        {"--number", "-1"},
        {"--number", "4294967296"},
        {"--address", "0x"},
        {"--address", "0x1g"},
        {"--version", ""},
        {"--version", "a\nb"},
        {"--version", "0123456789012345678901234"}};
    for (unsigned i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        const char *const words[] = {in("code"),  "--key",     in("lab"),
                                     wrong[i][0], wrong[i][1], NULL};
        assert_int_equal(sign(words), HOST_USAGE);
        assert_non_null(strstr(error.text, "; "));
    }
    const char *const no_board[] = {in("code"), "--key", in("lab"), NULL};
    assert_int_equal(sign(no_board), HOST_USAGE);
    const char *const no_key[] = {in("code"), NULL};
    assert_int_equal(sign(no_key), HOST_USAGE);
}

TEST_GROUP(set_up, tear_down)
