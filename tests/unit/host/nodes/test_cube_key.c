/* A cube's key: a file of its own, for its owner alone, or none. */

#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "host/nodes/cube_file.h"
#include "transport/drivers/secure_sodium.h"
#include "tests/unit/test.h"

static char directory[] = "/tmp/incode-key.XXXXXX";
static char path[64];

static int set_up(void **unused) {
    (void)unused;
    assert_non_null(mkdtemp(directory));
    snprintf(path, sizeof path, "%s/cube.key", directory);
    return 0;
}

static int tear_down(void **unused) {
    (void)unused;
    return rmdir(directory);
}

TEST(a_key_is_for_its_owner_alone) {
    static const mode_t masks[] = {0, 022, 0777};
    uint8_t key[3][SECURE_KEY_BYTES];
    struct stat about;
    for (unsigned i = 0; i < 3; i++) {
        struct host_error error = {0};
        mode_t before = umask(masks[i]);
        int status = host_key_make(path, &error);
        umask(before);
        assert_int_equal(status, 0);
        assert_int_equal(stat(path, &about), 0);
        assert_int_equal(about.st_mode & 07777, 0600);
        assert_int_equal(about.st_size, 2 * SECURE_KEY_BYTES + 1);
        assert_int_equal(key_file_read(path, key[i]), KEY_FILE_GOOD);
        assert_int_equal(unlink(path), 0);
    }
    assert_memory_not_equal(key[0], key[1], SECURE_KEY_BYTES);
    assert_memory_not_equal(key[1], key[2], SECURE_KEY_BYTES);
}

TEST(a_file_that_is_there_stays) {
    uint8_t key[SECURE_KEY_BYTES], same[SECURE_KEY_BYTES];
    struct host_error error = {0};
    char link[80];
    assert_int_equal(host_key_make(path, &error), 0);
    assert_int_equal(key_file_read(path, key), KEY_FILE_GOOD);
    assert_int_equal(host_key_make(path, &error), HOST_INPUT);
    assert_non_null(strstr(error.text, "is there already"));
    assert_int_equal(key_file_read(path, same), KEY_FILE_GOOD);
    assert_memory_equal(key, same, SECURE_KEY_BYTES);
    assert_int_equal(unlink(path), 0);
    /* nor is one made behind a link */
    snprintf(link, sizeof link, "%s.link", path);
    assert_int_equal(symlink(path, link), 0);
    error = (struct host_error){0};
    assert_int_equal(host_key_make(link, &error), HOST_INPUT);
    assert_int_equal(access(path, F_OK), -1);
    assert_int_equal(unlink(link), 0);
}

/* A disk without room for it: as a limit of the size of files shows it. */
TEST(what_cannot_be_written_leaves_nothing) {
    struct rlimit before, none;
    struct host_error error = {0};
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    none = before;
    none.rlim_cur = 10; /* a part of it can be */
    void (*handler)(int) = signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &none), 0);
    int status = host_key_make(path, &error);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    (void)signal(SIGXFSZ, handler);
    assert_int_equal(status, HOST_INPUT);
    assert_non_null(strstr(error.text, "; "));
    assert_int_equal(access(path, F_OK), -1);
    error = (struct host_error){0};
    assert_int_equal(host_key_make("/no/such/folder/key", &error), HOST_INPUT);
}

TEST_GROUP(set_up, tear_down)
