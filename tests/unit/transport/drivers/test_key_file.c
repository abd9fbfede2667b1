/* Files with keys: who can write one is no stranger, so that it is refused;
 * what is no key is told; and a process that has one leaves no copies. */
#include <errno.h>
#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/unit/transport/own_stack.h"
#include "transport/drivers/secure_sodium.h"

static const char digits[] =
    "000102030405060708090a0b0c0d0e0f101112131415161718191a1b1c1d1e1f\n";

static char folder[] = "/tmp/incode-key.XXXXXX";
static char path[64];

static int make_folder(void **unused) {
    (void)unused;
    if (mkdtemp(folder) == NULL)
        return -1;
    snprintf(path, sizeof path, "%s/cube.key", folder);
    return 0;
}

static int remove_folder(void **unused) {
    (void)unused;
    (void)unlink(path);
    return rmdir(folder);
}

static void make_file(const char *text, mode_t mode) {
    FILE *stream = fopen(path, "w");
    assert_non_null(stream);
    assert_true(fputs(text, stream) >= 0);
    assert_int_equal(fclose(stream), 0);
    assert_int_equal(chmod(path, mode), 0);
}

/* With every right of its group and of others. */
TEST(others_that_can_write_it_are_refused) {
    static const uint8_t none[SECURE_KEY_BYTES];
    for (unsigned rights = 0; rights < 64; rights++) {
        uint8_t key[SECURE_KEY_BYTES] = {7};
        make_file(digits, 0600 | rights);
        enum key_file_state state = key_file_read(path, key);
        bool written = (rights & 022) != 0, read = (rights & 044) != 0;
        assert_int_equal(state, written ? KEY_FILE_WRITABLE
                                : read  ? KEY_FILE_SEEN
                                        : KEY_FILE_GOOD);
        assert_true((key_file_text(state).what == NULL) ==
                    (state == KEY_FILE_GOOD));
        if (written)
            assert_memory_equal(key, none, sizeof none);
        for (uint8_t i = 0; !written && i < sizeof key; i++)
            assert_int_equal(key[i], i);
    }
}

/* Root's is as good as one's own, another user's is not, whatever its rights.
 */
TEST(another_users_is_refused) {
    static const uint8_t none[SECURE_KEY_BYTES];
    uint8_t key[SECURE_KEY_BYTES] = {7};
    if (geteuid() != 0) {
        print_message("only root can give a file away\n");
        skip();
    }
    make_file(digits, 0600);
    assert_int_equal(chmod(folder, 0755), 0);
    assert_int_equal(chown(path, 65534, 65534), 0);
    assert_int_equal(key_file_read(path, key), KEY_FILE_FOREIGN);
    assert_memory_equal(key, none, sizeof none);
    assert_non_null(
        strstr(key_file_text(KEY_FILE_FOREIGN).what, "another user"));
    assert_int_equal(seteuid(65534), 0);
    enum key_file_state own = key_file_read(path, key);
    assert_int_equal(seteuid(0), 0);
    assert_int_equal(own, KEY_FILE_GOOD);
    assert_int_equal(chown(path, 0, 0), 0);
    assert_int_equal(chmod(path, 0644), 0);
    assert_int_equal(seteuid(65534), 0);
    enum key_file_state roots = key_file_read(path, key);
    assert_int_equal(seteuid(0), 0);
    assert_int_equal(roots, KEY_FILE_SEEN);
    assert_int_equal(unlink(path), 0);
}

TEST(what_is_no_key_is_told) {
    static const uint8_t none[SECURE_KEY_BYTES];
    static const char *const texts[] = {"", "00", "no key", NULL};
    uint8_t key[SECURE_KEY_BYTES] = {7};
    char text[sizeof digits];
    for (unsigned i = 0; texts[i] != NULL; i++) {
        make_file(texts[i], 0600);
        assert_int_equal(key_file_read(path, key), KEY_FILE_NO_KEY);
        assert_memory_equal(key, none, sizeof none);
    }
    for (unsigned i = 0; i < 64; i++) {
        memcpy(text, digits, sizeof text);
        text[i] = 'g';
        make_file(text, 0600);
        assert_int_equal(key_file_read(path, key), KEY_FILE_NO_KEY);
        assert_memory_equal(key, none, sizeof none);
    }
    assert_int_equal(key_file_read(folder, key), KEY_FILE_UNREADABLE);
    assert_int_equal(errno, EISDIR);
    assert_int_equal(unlink(path), 0);
    assert_int_equal(key_file_read(path, key), KEY_FILE_UNREADABLE);
    assert_int_equal(errno, ENOENT);
    assert_non_null(
        strstr(key_file_text(KEY_FILE_UNREADABLE).next, "incode key FILE"));
    /* A pipe that nobody writes to is not waited for. */
    assert_int_equal(mkfifo(path, 0600), 0);
    assert_int_equal(key_file_read(path, key), KEY_FILE_NO_KEY);
    assert_int_equal(unlink(path), 0);
}

static uint8_t read_to[SECURE_KEY_BYTES];
static enum key_file_state read_state;

static void read_on_stack(void) {
    read_state = key_file_read(path, read_to);
}

TEST(a_key_leaves_no_core_and_no_copy) {
    static const struct rlimit some = {1 << 20, 1 << 20};
    struct rlimit core;
    make_file(digits, 0600);
    assert_int_equal(prctl(PR_SET_DUMPABLE, 1), 0);
    (void)setrlimit(RLIMIT_CORE, &some);
    read_on_stack(); /* what is called for the first time is looked for */
    run_on_stack(read_on_stack);
    assert_int_equal(read_state, KEY_FILE_GOOD);
    assert_false(
        holds(stack, sizeof stack, (const uint8_t *)digits, sizeof digits));
    assert_false(holds(stack, sizeof stack, read_to, sizeof read_to));
    assert_int_equal(prctl(PR_GET_DUMPABLE), 0);
    assert_int_equal(getrlimit(RLIMIT_CORE, &core), 0);
    assert_int_equal(core.rlim_cur + core.rlim_max, 0);
}

TEST_GROUP(make_folder, remove_folder)
