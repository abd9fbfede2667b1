/* Wires over TCP between machines: addresses, calls before anybody listens,
 * connections that break, and strangers. */
#include "wire_ends.h"

static const uint8_t other_key[SECURE_KEY_BYTES] = "another key";

TEST(addresses) {
    static const char *const good[] = {"127.0.0.1:7000", "[::1]:65535",
                                       "127.9.9.9:1"};
    static const char *const bad[] = {
        "127.0.0.1",    "127.0.0.1:",  "127.0.0.1:0", "127.0.0.1:65536",
        "localhost:7",  "::1:7",       "[::1:7",      "[::1]7",
        "127.0.0.1:7x", "1.2.3.4.5:7", ":7",          ""};
    struct tcp_address a;
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
        assert_int_equal(tcp_address_parse(&a, good[i]), 0);
        assert_null(tcp_address_path(&a));
    }
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        assert_int_equal(tcp_address_parse(&a, bad[i]), -1);
    assert_int_equal(tcp_address_parse(&a, "[2001:db8::7]:7000"), 0);
    assert_false(tcp_address_is_any(&a));
    assert_int_equal(tcp_address_parse(&a, "[::]:7000"), 0);
    assert_true(tcp_address_is_any(&a));
    assert_int_equal(tcp_address_parse(&a, "0.0.0.0:7000"), 0);
    assert_true(tcp_address_is_any(&a));
}

TEST(paths) {
    char path[TCP_PATH_MAX + 2];
    struct tcp_address a;
    memset(path, 'a', sizeof path);
    path[TCP_PATH_MAX + 1] = '\0';
    assert_int_equal(tcp_address_set_path(&a, path), -1);
    path[TCP_PATH_MAX] = '\0';
    assert_int_equal(tcp_address_set_path(&a, path), 0);
    assert_string_equal(tcp_address_path(&a), path);
    assert_false(tcp_address_is_any(&a));
    assert_int_equal(tcp_address_set_path(&a, ""), -1);
}

TEST(wires_that_break_go_on) {
    static struct end ends[2];
    static const int families[] = {AF_INET, AF_INET6};
    for (unsigned keyed = 0; keyed < 2; keyed++) {
        for (unsigned f = 0; f < 2; f++) {
            struct tcp_address at = free_address(families[f]);
            /* The caller is there first. */
            open_end(&ends[0], 0, &at, keyed ? key : NULL);
            for (unsigned i = 0; i < 20; i++) {
                step(&ends[0]);
                rest(1000);
            }
            assert_true(ends[0].wire.tcp.fd < 0);
            open_end(&ends[1], 1, &at, keyed ? key : NULL);
            assert_true(exchange(ends, 300));
            for (unsigned round = 0; round < 6; round++) {
                shutdown(ends[round % 2].wire.tcp.fd, SHUT_RDWR);
                assert_true(exchange(ends, 100));
            }
            assert_true(ends[1].wire.connections >= 7);
            assert_int_equal(link_statistics(ends[0].link)->sessions, 1);
            assert_int_equal(ends[1].wire.records.refused, 0);
            close_end(&ends[0]);
            close_end(&ends[1]);
        }
    }
}

/* One with another key that is gone is not spoken of any more: the end that
 * called it hears of that, the other after a while. */
TEST(another_key_that_is_gone_is_forgotten) {
    for (unsigned gone = 0; gone < 2; gone++) {
        static struct end ends[2];
        struct tcp_address at = free_address(AF_INET);
        struct tcp_wire *left = &ends[1 - gone].wire;
        open_end(&ends[1], 1, &at, key);
        open_end(&ends[0], 0, &at, other_key);
        for (uint64_t begin = clock_us(); !left->other_key;) {
            step(&ends[0]);
            step(&ends[1]);
            assert_true(clock_us() - begin < WAIT_US);
        }
        close_end(&ends[gone]);
        assert_true(left->other_key);
        left->other_key_us -= gone == 0 ? TCP_OTHER_KEY_US : 0;
        for (uint64_t begin = clock_us(); left->other_key;) {
            step(&ends[1 - gone]);
            assert_true(clock_us() - begin < TCP_OTHER_KEY_US);
        }
        close_end(&ends[1 - gone]);
    }
}

TEST(another_key_never_connects) {
    static struct end ends[2];
    struct tcp_address at = free_address(AF_INET);
    open_end(&ends[1], 1, &at, key);
    for (unsigned keyed = 2; keyed-- > 0;) {
        open_end(&ends[0], 0, &at, keyed ? other_key : NULL);
        /* Until both have seen it, where there is a key, and a while. */
        bool seen = false;
        for (uint64_t begin = clock_us(), now = begin;
             now - begin < (seen ? 300000 : WAIT_US); now = clock_us()) {
            step(&ends[0]);
            step(&ends[1]);
            seen = keyed == 0 ||
                   (ends[0].wire.other_key && ends[1].wire.strangers > 0);
        }
        assert_int_equal(ends[1].wire.connections, 0);
        assert_int_equal(ends[0].read + ends[1].read, 0);
        assert_int_equal(link_statistics(ends[1].link)->bytes_received, 0);
        assert_true(ends[0].wire.other_key == (keyed != 0));
        close_end(&ends[0]);
    }
    assert_true(ends[1].wire.strangers > 0);
    close_end(&ends[1]);
}

/* Where only one of the two has a key, either hears of that, whichever calls;
 * and forgets it when one comes who is right. */
TEST(a_lone_key_is_told_of) {
    static struct end ends[2];
    for (unsigned keyed = 0; keyed < 2; keyed++) {
        struct tcp_address at = free_address(AF_INET);
        open_end(&ends[1], 1, &at, keyed == 1 ? key : NULL);
        open_end(&ends[0], 0, &at, keyed == 0 ? key : NULL);
        for (uint64_t begin = clock_us(); !ends[0].wire.lone_key ||
                                          !ends[1].wire.lone_key ||
                                          ends[0].wire.pause_us <= 80000;) {
            step(&ends[0]);
            step(&ends[1]);
            assert_true(clock_us() - begin < WAIT_US);
        }
        for (unsigned who = 0; who < 2; who++) {
            struct tcp_wire_doubt doubt = tcp_wire_doubt(&ends[who].wire);
            assert_string_equal(doubt.what, who == keyed
                                                ? "answers, but has no key"
                                                : "answers, but wants a key");
            assert_string_equal(doubt.next, "give both ends the same key file");
        }
        assert_int_equal(ends[keyed].wire.connections, 0);
        close_end(&ends[0]);
        open_end(&ends[0], 0, &at, keyed == 1 ? key : NULL);
        assert_true(exchange(ends, 20));
        assert_null(tcp_wire_doubt(&ends[0].wire).what);
        assert_null(tcp_wire_doubt(&ends[1].wire).what);
        close_end(&ends[0]);
        close_end(&ends[1]);
    }
}

/* One who has the key and takes the wire for another, as a cube file may be
 * wrong, or somebody has led his call elsewhere: while nobody better is there
 * he is heard, as the link tells then who he is; one who is right takes his
 * place, and keeps it. */
TEST(one_who_is_led_elsewhere_ends_nothing) {
    static const struct secure_ends sees[3] = {
        {{0, 0}, {1, 0}}, {{1, 0}, {0, 0}}, {{2, 0}, {3, 0}}};
    static struct end ends[2], lost;
    struct tcp_address at = free_address(AF_INET);
    open_end(&ends[1], 1, &at, key);
    ends[1].wire.config.ends = &sees[1];
    for (unsigned round = 0; round < 2; round++) {
        open_end(&lost, 0, &at, key);
        lost.wire.config.ends = &sees[2];
        uint64_t begin = clock_us(), strangers = ends[1].wire.strangers;
        while (round == 0 ? ends[1].wire.connections == 0
                          : ends[1].wire.strangers < strangers + 3) {
            step(&lost);
            if (round != 0)
                step(&ends[0]);
            step(&ends[1]);
            assert_true(clock_us() - begin < WAIT_US);
        }
        if (round == 0) {
            open_end(&ends[0], 0, &at, key);
            ends[0].wire.config.ends = &sees[0];
        }
        assert_true(exchange(ends, 100));
        assert_int_equal(ends[1].wire.connections, 2);
        close_end(&lost);
    }
    close_end(&ends[0]);
    close_end(&ends[1]);
}

/* Strangers who say nothing, or noise, while two talk and lose their connection
 * now and then.  Those two are disturbed no more often than that, and look at
 * few strangers at a time. */
static void with_strangers(const uint8_t *with) {
    enum { STRANGERS = 60 };
    static struct end ends[2];
    static uint8_t noise[3000];
    int fds[STRANGERS];
    struct tcp_address at = free_address(AF_INET);
    assert_int_equal(getrandom(noise, sizeof noise, 0), sizeof noise);
    open_end(&ends[1], 1, &at, with);
    open_end(&ends[0], 0, &at, with);
    assert_true(exchange(ends, 20));
    for (unsigned i = 0; i < STRANGERS; i++)
        fds[i] = -1;
    uint64_t looks = 0;
    for (unsigned round = 0; round < 20; round++) {
        uint64_t begin = clock_us(), strangers = ends[1].wire.strangers;
        for (unsigned i = 0; i < STRANGERS; i++) {
            if (fds[i] >= 0)
                close(fds[i]);
            fds[i] = stranger(&at);
            step(&ends[0]);
            step(&ends[1]);
            if (i % 3 != 0) {
                size_t size = i % 3 == 1 ? sizeof noise : 32;
                (void)!write(fds[i], noise, size);
            }
        }
        while (ends[1].wire.strangers - strangers < 5) {
            assert_true(exchange(ends, 20));
            assert_true(clock_us() - begin < WAIT_US);
        }
        looks = (clock_us() - begin) / TCP_LOOK_US + 2;
        assert_true(ends[1].wire.strangers - strangers <=
                    looks * TCP_ACCEPTS_MAX + TCP_CANDIDATES_MAX);
        if (round % 5 == 4) {
            shutdown(ends[0].wire.tcp.fd, SHUT_RDWR);
            assert_true(exchange(ends, 20));
        }
    }
    unsigned open = 0;
    for (unsigned i = 0; i < TCP_CANDIDATES_MAX; i++)
        open += ends[1].wire.candidate[i].fd >= 0;
    assert_true(open <= TCP_CANDIDATES_MAX);
    assert_true(ends[1].wire.strangers >= 20 * 5);
    assert_true(with == NULL || ends[1].wire.connections == 5);
    assert_int_equal(link_statistics(ends[1].link)->sessions, 1);
    for (unsigned i = 0; i < STRANGERS; i++)
        close(fds[i]);
    uint64_t connections = ends[1].wire.connections;
    close_end(&ends[0]);
    close_end(&ends[1]);
    assert_true(connections <= 10);
}

TEST(strangers_change_nothing) {
    with_strangers(key);
}

TEST(strangers_without_a_key_change_nothing) {
    with_strangers(NULL);
}

/* What a caller says before it is answered: as many bytes as come. */
static size_t greeting_with(const uint8_t *with, uint8_t *bytes, size_t size) {
    static struct end end;
    struct tcp_address at = free_address(AF_INET);
    ssize_t got = 0;
    int listener = socket(AF_INET, SOCK_STREAM, 0);
    assert_true(listener >= 0);
    assert_int_equal(bind(listener, &at.to.any, at.size), 0);
    assert_int_equal(listen(listener, 1), 0);
    open_end(&end, 0, &at, with);
    step(&end);
    int fd = accept(listener, NULL, NULL);
    assert_true(fd >= 0);
    while (got <= 0) {
        step(&end);
        got = recv(fd, bytes, size, MSG_DONTWAIT);
    }
    close(fd);
    close(listener);
    close_end(&end);
    return (size_t)got;
}

enum { SILENT, SLOW, OTHER_KEY, HALF_RIGHT, ALL_KINDS };
enum { FLOOD = 400, OPENING_MAX = 256 };

struct flood {
    int kind, fd[FLOOD];
    size_t size[2];                  /* of a greeting with the other key, and */
    uint8_t opening[2][OPENING_MAX]; /* of the right one; random behind it */
    unsigned called;
};

/* So many strangers more; the first go.  Those that talk slowly say a byte. */
static void flood_on(struct flood *f, const struct tcp_address *at,
                     unsigned count) {
    while (count-- > 0) {
        unsigned i = f->called++ % FLOOD;
        unsigned kind =
            f->kind == ALL_KINDS ? i % ALL_KINDS : (unsigned)f->kind;
        unsigned right = kind == HALF_RIGHT;
        if (f->fd[i] >= 0)
            close(f->fd[i]);
        f->fd[i] = stranger(at);
        if (kind == HALF_RIGHT || kind == OTHER_KEY) {
            size_t size = right ? f->size[1] : OPENING_MAX;
            (void)!write(f->fd[i], f->opening[right], size);
        }
    }
    for (unsigned i = 0; i < FLOOD; i++) {
        bool slow = f->kind == SLOW || (f->kind == ALL_KINDS && i % 4 == SLOW);
        if (f->fd[i] >= 0 && slow)
            (void)!send(f->fd[i], f->opening[1], 1, MSG_NOSIGNAL);
    }
}

/* Hundreds come, three at each look of the one who listens; one with the key
 * comes behind them, and answers at every third look only.  It is taken within
 * so many looks. */
TEST(a_flood_keeps_nobody_out) {
    enum { LOOKS_MAX = 60 };
    static struct end ends[2];
    static struct flood f;
    assert_int_equal(getrandom(f.opening, sizeof f.opening, 0),
                     sizeof f.opening);
    f.size[0] = greeting_with(other_key, f.opening[0], OPENING_MAX);
    f.size[1] = greeting_with(key, f.opening[1], OPENING_MAX);
    for (f.kind = 0; f.kind <= ALL_KINDS; f.kind++) {
        struct tcp_address at = free_address(AF_INET);
        unsigned looks = 0;
        f.called = 0;
        memset(f.fd, -1, sizeof f.fd);
        open_end(&ends[1], 1, &at, key);
        flood_on(&f, &at, TCP_QUEUE_MAX / 2);
        for (; looks < 40; looks++) {
            rest(TCP_CROWD_US);
            flood_on(&f, &at, TCP_ACCEPTS_MAX);
            step(&ends[1]);
        }
        open_end(&ends[0], 0, &at, key);
        for (looks = 0; ends[1].wire.connections == 0; looks++) {
            rest(TCP_CROWD_US);
            flood_on(&f, &at, 3);
            step(&ends[1]);
            if (looks % 3 == 0)
                step(&ends[0]);
            if (looks == LOOKS_MAX)
                fail_msg("kind %d: not taken in %u looks", f.kind, looks);
        }
        assert_true(f.called > 200);
        for (unsigned i = 0; i < FLOOD; i++)
            close(f.fd[i]);
        close_end(&ends[0]);
        close_end(&ends[1]);
    }
}

/* Without a key, and with nobody better there, one who only listens is taken:
 * a node that does not know who it is; and gives way to one who greets. */
TEST(a_silent_caller_is_taken_for_want_of_a_better) {
    static struct end ends[2];
    struct tcp_address at = free_address(AF_INET);
    uint8_t byte;
    open_end(&ends[1], 1, &at, NULL);
    int silent = stranger(&at);
    uint64_t begin = clock_us();
    while (recv(silent, &byte, 1, MSG_DONTWAIT) != 1) {
        step(&ends[1]);
        assert_true(clock_us() - begin < WAIT_US);
    }
    assert_int_equal(ends[1].wire.connections, 1);
    open_end(&ends[0], 0, &at, NULL);
    assert_true(exchange(ends, 20));
    assert_int_equal(ends[1].wire.connections, 2);
    close(silent);
    close_end(&ends[0]);
    close_end(&ends[1]);
}

/* One that answers a call and proves nothing, as its bytes were lost, is called
 * again before it gives up itself. */
TEST(a_lost_proof_is_asked_for_again) {
    static struct end end;
    struct tcp_address at = free_address(AF_INET);
    unsigned calls = 0;
    int on = 1, listener = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0);
    assert_true(listener >= 0);
    (void)setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    assert_int_equal(bind(listener, &at.to.any, at.size), 0);
    assert_int_equal(listen(listener, 16), 0);
    open_end(&end, 0, &at, key);
    uint64_t begin = clock_us();
    while (calls < 3) {
        int fd = accept(listener, NULL, NULL);
        calls += fd >= 0; /* left open */
        step(&end);
        rest(1000);
        assert_true(clock_us() - begin < TCP_PROVE_US);
    }
    assert_true(clock_us() - begin > 2 * TCP_PROVE_MIN_US);
    assert_false(end.wire.other_key);
    close(listener);
    close_end(&end);
}

TEST(without_a_key_only_if_it_is_meant) {
    static struct tcp_wire wire;
    struct tcp_wire_config c = {.listens = true};
    c.address = free_address(AF_INET);
    for (unsigned i = 0; i < 2; i++) {
        c.listens = i == 0;
        assert_int_equal(tcp_wire_open(&wire, &c), -1);
        assert_int_equal(errno, EACCES);
    }
    c.insecure = true;
    assert_int_equal(tcp_wire_open(&wire, &c), 0);
    tcp_wire_close(&wire);
}

/* A board without random bytes gives its device and the number of its start;
 * one that has neither gets no wire, and nothing left open. */
TEST(openings_are_drawn_from_the_board) {
    static struct end ends[2];
    struct secure_source boards[2] = {{.device = "board 0", .boot = 7},
                                      {.device = "board 1", .boot = 1}};
    struct secure_source none = {.boot = 0};
    struct tcp_address at = free_address(AF_INET);
    for (unsigned i = 0; i < 2; i++) {
        open_end(&ends[i], i, &at, key);
        ends[i].wire.config.source = i == 0 ? &none : &boards[i];
    }
    for (unsigned round = 0; round < 100; round++) {
        step(&ends[0]);
        step(&ends[1]);
    }
    assert_int_equal(ends[0].read + ends[1].read, 0);
    ends[0].wire.config.source = &boards[0];
    assert_true(exchange(ends, 20));
    assert_true(boards[0].draws > 0 && boards[1].draws > 0);
    close_end(&ends[0]);
    close_end(&ends[1]);
}
