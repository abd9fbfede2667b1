/* Records between two who know a key: what they say arrives, and what anybody
 * changes, repeats, leaves out or invents is as good as lost. */
#include "secure_world.h"

static int send_all(struct world *w, unsigned who, const uint8_t *bytes,
                    size_t size) {
    struct link_pipe p = secure_records_pipe(&w->records[who]);
    size_t done = 0;
    for (unsigned i = 0; i < 100000 && done < size; i++) {
        int n = p.send(p.context, bytes + done, size - done);
        if (n < 0)
            return n;
        done += (size_t)n;
    }
    for (unsigned i = 0; i < 4000; i++) /* what is sealed */
        if (p.send(p.context, bytes, 0) < 0)
            return LINK_PIPE_CLOSED;
    return (int)done;
}

/* Bytes until none come, or LINK_PIPE_CLOSED. */
static int receive_all(struct world *w, unsigned who, uint8_t *bytes,
                       size_t size) {
    struct link_pipe p = secure_records_pipe(&w->records[who]);
    size_t done = 0;
    for (unsigned idle = 0; idle < 4000;) {
        int n = p.receive(p.context, bytes + done, size - done);
        if (n < 0)
            return n;
        idle = n == 0 ? idle + 1 : 0;
        done += (size_t)n;
    }
    return (int)done;
}

TEST(what_is_said_arrives) {
    static uint8_t said[20000], heard[20001];
    static const size_t mosts[] = {0, 1, 7, 100};
    for (size_t i = 0; i < sizeof said; i++)
        said[i] = (uint8_t)(i * 31 >> 3);
    for (size_t k = 0; k < 4; k++) {
        struct world *w = connected(9, mosts[k]);
        for (unsigned who = 0; who < 2; who++) {
            assert_int_equal(send_all(w, who, said, sizeof said), sizeof said);
            assert_int_equal(receive_all(w, 1 - who, heard, sizeof heard),
                             sizeof said);
            assert_memory_equal(said, heard, sizeof said);
        }
        /* Nothing of it is legible on the way. */
        for (size_t i = 0; i + 16 <= w->lanes[0].end; i++)
            assert_memory_not_equal(w->lanes[0].bytes + i, said + 1000, 16);
        free(w);
    }
}

/* A pipe that has room is given all: what it does not take, the link holds back
 * until it hears of room. */
TEST(all_that_fits_is_taken) {
    static uint8_t said[3 * SECURE_RECORD_MAX], heard[sizeof said];
    struct world *w = connected(2, 0);
    struct link_pipe p = secure_records_pipe(&w->records[0]);
    assert_int_equal(p.send(p.context, said, sizeof said), sizeof said);
    assert_int_equal(receive_all(w, 1, heard, sizeof heard), sizeof said);
    w->lanes[0].most = 100;
    assert_int_equal(p.send(p.context, said, sizeof said), SECURE_RECORD_MAX);
    free(w);
}

/* What is heard of three records, the first of which was lost. */
static void expect_two(struct world *w, const uint8_t *said, int size) {
    uint8_t heard[256];
    assert_int_equal(receive_all(w, 1, heard, sizeof heard), 1 + 2 * size);
    assert_int_equal(heard[0], 0);
    assert_memory_equal(heard + 1, said, (size_t)size);
    assert_memory_equal(heard + 1 + size, said, (size_t)size);
    assert_int_equal(w->records[1].records_in, 2);
}

/* Each byte of a record changed, or cut out, or twice there. */
TEST(a_changed_byte_loses_a_record) {
    uint8_t said[40] = "forty bytes that nobody may change";
    enum { RECORD = SECURE_HEAD_BYTES + sizeof said + 16 };
    for (size_t at = 0; at < 3 * RECORD; at++) {
        struct world *w = connected(5, at % 2 == 0 ? 0 : 9);
        struct lane *lane = &w->lanes[0];
        size_t begin = lane->end;
        assert_int_equal(send_all(w, 0, said, sizeof said), sizeof said);
        assert_int_equal(lane->end - begin, RECORD);
        uint8_t *byte = lane->bytes + begin + at % RECORD;
        size_t after = RECORD - at % RECORD;
        if (at < RECORD) {
            *byte ^= 1;
        } else if (at < 2 * RECORD) {
            memmove(byte, byte + 1, after - 1);
            lane->end--;
        } else {
            memmove(byte + 1, byte, after);
            lane->end++;
        }
        assert_int_equal(send_all(w, 0, said, sizeof said), sizeof said);
        assert_int_equal(send_all(w, 0, said, sizeof said), sizeof said);
        /* Its first byte before it, or its last behind it: it is whole. */
        if (at != 2 * RECORD && at != 3 * RECORD - 1)
            expect_two(w, said, sizeof said);
        free(w);
    }
}

/* What is missing of a record is not waited for where another one begins. */
TEST(a_record_cut_short_holds_up_none) {
    static uint8_t said[2000], heard[64];
    for (size_t left = 1; left < sizeof said; left += 99) {
        struct world *w = connected(6, 0);
        struct lane *lane = &w->lanes[0];
        size_t begin = lane->end;
        assert_int_equal(send_all(w, 0, said, sizeof said), sizeof said);
        lane->end = begin + left;
        assert_int_equal(receive_all(w, 1, heard, sizeof heard), 0);
        assert_int_equal(send_all(w, 0, said, 40), 40);
        assert_int_equal(receive_all(w, 1, heard, sizeof heard), 1 + 40);
        free(w);
    }
}

/* The record again, the next one first, one's own back, an earlier connection's
 * whole side. */
TEST(a_repeated_record_is_not_heard) {
    static uint8_t kept[ROOM];
    uint8_t said[16] = "once", heard[64];
    for (unsigned how = 0; how < 3; how++) {
        struct world *w = connected(7, 0);
        struct lane *lane = &w->lanes[0];
        size_t begin = lane->end, size = SECURE_HEAD_BYTES + sizeof said + 16;
        assert_int_equal(send_all(w, 0, said, sizeof said), sizeof said);
        assert_int_equal(send_all(w, 0, said, sizeof said), sizeof said);
        if (how == 0) {
            memcpy(lane->bytes + begin + size, lane->bytes + begin, size);
            assert_int_equal(receive_all(w, 1, heard, sizeof heard),
                             sizeof said);
            assert_int_equal(send_all(w, 0, said, sizeof said), sizeof said);
            lane->begin = begin;
        } else if (how == 1) {
            lane->begin += size;
        } else {
            memcpy(w->lanes[1].bytes + w->lanes[1].end, lane->bytes + begin,
                   size);
            w->lanes[1].end += size;
            assert_int_equal(receive_all(w, 0, heard, sizeof heard), 0);
            assert_int_equal(w->records[0].refused, 1);
            free(w);
            continue;
        }
        assert_int_equal(receive_all(w, 1, heard, sizeof heard),
                         1 + sizeof said);
        assert_int_equal(heard[0], 0);
        assert_memory_equal(heard + 1, said, sizeof said);
        free(w);
    }
    struct world *old = connected(7, 0);
    assert_int_equal(send_all(old, 0, said, sizeof said), sizeof said);
    size_t size = old->lanes[0].end;
    memcpy(kept, old->lanes[0].bytes, size);
    free(old);
    int status = 0;
    struct world *w = new_world(60, 0);
    memcpy(w->lanes[0].bytes, kept, size);
    w->lanes[0].end = size;
    for (unsigned i = 0; i < 10 && status == 0; i++)
        status = secure_shake(&w->shake[1], &w->pipes[1]);
    assert_int_equal(status, -1);
    free(w);
    /* An echo of what the end itself says. */
    w = new_world(61, 0);
    w->ends[1].in = w->ends[1].out;
    for (unsigned i = 0; i < 10 && status == 0; i++)
        status = secure_shake(&w->shake[1], &w->pipes[1]);
    assert_int_equal(status, -1);
    free(w);
}

static uint8_t draw(uint32_t *random) {
    *random = *random * 1664525u + 1013904223u;
    return (uint8_t)(*random >> 24);
}

TEST(noise_is_passed_over) {
    uint32_t random = 1;
    uint8_t said[8] = "silence", heard[64];
    for (unsigned round = 0; round < 300; round++) {
        int status = 0;
        struct world *w = round % 2 == 0 ? new_world(8, 0) : connected(8, 0);
        for (unsigned i = 0; i < 4000; i++)
            w->lanes[0].bytes[w->lanes[0].end++] = draw(&random);
        for (unsigned i = 0; i < 10 && status == 0 && round % 2 == 0; i++)
            status = secure_shake(&w->shake[1], &w->pipes[1]);
        if (round % 2 != 0) {
            assert_int_equal(send_all(w, 0, said, sizeof said), sizeof said);
            assert_int_equal(receive_all(w, 1, heard, sizeof heard),
                             sizeof said);
            assert_memory_equal(heard, said, sizeof said);
        } else {
            assert_int_equal(status, -1);
        }
        free(w);
    }
}

/* Noise without end, and heads of records that are none: the work is bounded,
 * and then the connection is over. */
TEST(noise_without_end_ends_it) {
    static const uint8_t heads[SECURE_HEAD_BYTES] = {0, 8, 0xff, 0xf7, 9};
    uint8_t byte;
    for (unsigned crafted = 0; crafted < 2; crafted++) {
        struct world *w = connected(8, 0);
        struct link_pipe p = secure_records_pipe(&w->records[1]);
        struct lane *lane = &w->lanes[0];
        uint32_t random = 4;
        size_t come = 0;
        int status = 0;
        while (status == 0 && come < 2 * SECURE_LOST_MAX) {
            lane->begin = 0;
            for (lane->end = 0; lane->end < ROOM; lane->end++) {
                lane->bytes[lane->end] = crafted != 0
                                             ? heads[lane->end % sizeof heads]
                                             : draw(&random);
            }
            for (unsigned i = 0; i < 100 && status == 0; i++)
                status = p.receive(p.context, &byte, 1);
            come += ROOM;
        }
        assert_int_equal(status, LINK_PIPE_CLOSED);
        assert_true(w->records[1].refused <=
                    SECURE_LOST_MAX / SECURE_RECORD_MAX + 1);
        assert_true((w->records[1].refused > 0) == (crafted != 0));
        assert_int_equal(w->records[1].records_in, 0);
        assert_int_equal(p.send(p.context, &byte, 1), LINK_PIPE_CLOSED);
        free(w);
    }
}

/* A record of some number, free of zeros: how long it is. */
static size_t make_record(uint8_t *bytes, unsigned number) {
    size_t size = 4 + number * 37 % 900;
    for (size_t i = 0; i < size; i++)
        bytes[i] = (uint8_t)(1 + (number * 7 + i) % 255);
    bytes[0] = (uint8_t)(1 + number % 255);
    return size;
}

/* Bytes that are damaged by chance: whole records are heard and no others, in
 * order, with a zero for each gap, and when it is over nothing is missing. */
TEST(damage_costs_what_it_touches) {
    enum { RECORDS = 200, CLEAN = 8 };
    static uint8_t said[1024], heard[1 << 18];
    for (uint32_t seed = 1; seed < 60; seed++) {
        struct world *w = connected(4, 0);
        struct lane *lane = &w->lanes[0];
        uint32_t random = seed;
        size_t end = 0;
        for (unsigned n = 0; n < RECORDS; n++) {
            size_t at = lane->end = lane->begin;
            assert_true(send_all(w, 0, said, make_record(said, n)) > 0);
            uint8_t *here =
                lane->bytes + at + draw(&random) % 100u % (lane->end - at);
            size_t left = (size_t)(lane->bytes + lane->end - here);
            size_t cut = 1 + draw(&random) % left;
            switch (n < RECORDS - CLEAN ? draw(&random) % 8 : 7) {
            case 0:
                *here ^= 4;
                break;
            case 1:
                memmove(here, here + cut, left - cut);
                lane->end -= cut;
                break;
            case 2:
                memmove(here + cut, here, left);
                lane->end += cut;
                break;
            default:
                break;
            }
            int got = receive_all(w, 1, heard + end, sizeof heard - end);
            assert_true(got >= 0);
            end += (size_t)got;
            if (lane->end > ROOM / 2) {
                assert_int_equal(lane->begin, lane->end);
                lane->begin = lane->end = 0;
            }
        }
        unsigned n = 0, found = 0, last = 0;
        for (size_t at = 0; at < end; n++) {
            bool gap = heard[at] == 0;
            at += gap;
            size_t size = make_record(said, n);
            while (gap && n + 1 < RECORDS &&
                   (end - at < size || memcmp(heard + at, said, size) != 0))
                size = make_record(said, ++n);
            assert_true(end - at >= size);
            assert_memory_equal(heard + at, said, size);
            at += size;
            found++;
            last = n;
        }
        assert_int_equal(last, RECORDS - 1);
        assert_true(found > RECORDS / 3);
        assert_int_equal(w->records[1].records_in, found);
        free(w);
    }
}
