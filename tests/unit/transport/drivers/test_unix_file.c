/* Wires at paths: their files, and who may be at the other end. */
#include "wire_ends.h"

#include <sys/stat.h>

#include "transport/drivers/unix_file.h"

static char directory[] = "/tmp/incode-unix.XXXXXX";

static int make_directory(void **unused) {
    (void)unused;
    return mkdtemp(directory) == NULL || chmod(directory, 0755) != 0;
}

static int remove_directory(void **unused) {
    (void)unused;
    return rmdir(directory);
}

static struct tcp_address path_address(const char *name) {
    char path[TCP_PATH_MAX + 1];
    struct tcp_address a;
    snprintf(path, sizeof path, "%s/%s", directory, name);
    assert_int_equal(tcp_address_set_path(&a, path), 0);
    return a;
}

TEST(a_path_is_a_wire) {
    static struct end ends[2];
    struct tcp_address at = path_address("wire");
    struct stat about;
    open_end(&ends[0], 0, &at, NULL); /* the caller is there first */
    for (unsigned i = 0; i < 20; i++) {
        step(&ends[0]);
        rest(1000);
    }
    open_end(&ends[1], 1, &at, NULL);
    assert_int_equal(lstat(tcp_address_path(&at), &about), 0);
    assert_int_equal(about.st_mode & 0777, 0600);
    assert_true(exchange(ends, 300));
    for (unsigned round = 0; round < 4; round++) {
        shutdown(ends[round % 2].wire.tcp.fd, SHUT_RDWR);
        assert_true(exchange(ends, 100));
    }
    assert_int_equal(link_statistics(ends[0].link)->sessions, 1);
    close_end(&ends[0]);
    close_end(&ends[1]);
    assert_int_equal(access(tcp_address_path(&at), F_OK), -1);
}

TEST(left_over_files_are_replaced_and_no_others) {
    static struct tcp_wire first, second;
    struct tcp_wire_config c = {.listens = true};
    c.address = path_address("socket");
    const char *path = tcp_address_path(&c.address);
    assert_int_equal(tcp_wire_open(&first, &c), 0);
    assert_int_equal(tcp_wire_open(&second, &c), -1);
    assert_int_equal(errno, EADDRINUSE);
    close(first.listener); /* as by a node that was killed */
    assert_int_equal(tcp_wire_open(&second, &c), 0);
    tcp_wire_close(&second);
    assert_int_equal(access(path, F_OK), -1);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fclose(file);
    assert_int_equal(tcp_wire_open(&second, &c), -1);
    assert_int_equal(errno, EEXIST);
    unix_file_remove(&c.address);
    assert_int_equal(unlink(path), 0);
}

/* Another user who gets past the file's rights is told by the kernel; either
 * way round. */
TEST(another_user_is_sent_away) {
    static struct end ends[2];
    static struct tcp_wire wire;
    struct tcp_wire_config c = {.listens = true};
    if (geteuid() != 0) {
        print_message("only root can be another user\n");
        skip();
    }
    struct tcp_address at = path_address("other");
    open_end(&ends[1], 1, &at, NULL);
    assert_int_equal(seteuid(65534), 0);
    int refused = stranger(&at), reason = errno;
    assert_int_equal(seteuid(0), 0);
    close(refused);
    assert_int_equal(reason, EACCES);
    assert_int_equal(chmod(tcp_address_path(&at), 0666), 0);
    assert_int_equal(seteuid(65534), 0);
    int fd = stranger(&at);
    assert_int_equal(seteuid(0), 0);
    for (unsigned i = 0; i < 1000 && ends[1].wire.strangers == 0; i++)
        step(&ends[1]);
    assert_int_equal(ends[1].wire.strangers, 1);
    assert_int_equal(ends[1].wire.connections, 0);
    close(fd);
    close_end(&ends[1]);
    /* root calls a path on which another user listens */
    c.address = path_address("theirs");
    assert_int_equal(chmod(directory, 0777), 0);
    assert_int_equal(seteuid(65534), 0);
    assert_int_equal(tcp_wire_open(&wire, &c), 0);
    assert_int_equal(seteuid(0), 0);
    open_end(&ends[0], 0, &c.address, NULL);
    for (unsigned i = 0; i < 1000 && !ends[0].wire.other_user; i++) {
        step(&ends[0]);
        rest(100);
    }
    assert_true(ends[0].wire.other_user);
    assert_int_equal(ends[0].wire.connections, 0);
    close_end(&ends[0]);
    tcp_wire_close(&wire);
}

TEST_GROUP(make_directory, remove_directory)
