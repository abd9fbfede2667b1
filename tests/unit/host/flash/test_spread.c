/* An image on its way to boards, over a session that is played: boards with
 * a loader, in a time of their own, that are off, restart, lose messages,
 * refuse and fall back. */
#include "played_boards.h"

/* --- a transfer ----------------------------------------------------------- */

static uint8_t image[BYTES];
static struct host_spread spread;
static struct host_spread_options options;
static struct host_error error;
static unsigned serials;

static bool make_serial(void *unused, uint8_t serial[NODE_SERIAL_BYTES]) {
    (void)unused;
    fill(serial, (uint8_t)++serials, NODE_SERIAL_BYTES);
    return true;
}

static void say(void *unused, const char *line) {
    size_t used = strlen(said);
    (void)unused;
    snprintf(said + used, sizeof said - used, "%s\n", line);
}

/* Four boards that run the old image. */
static int prepare(void **unused) {
    struct loader_image header = {.bytes = BYTES - LOADER_HEADER_BYTES,
                                  .board = "mps2-an500"};
    (void)unused;
    for (unsigned i = 0; i < BYTES; i++)
        image[i] = (uint8_t)(i * i >> 3);
    fill(header.digest, NEW, sizeof header.digest);
    loader_image_pack(&header, image);
    machine = (struct host_machine){.nodes = NODES,
                                    .dimension = 2,
                                    .epoch = 77,
                                    .serial_baud = 921600,
                                    .now_us = tell_time};
    session = (struct host_session){.machine = &machine, .node = seen};
    memset(seen, 0, sizeof seen);
    memset(off_until_us, 0, sizeof off_until_us);
    error = (struct host_error){0};
    said[0] = '\0';
    now_us = 5000;
    random_state = 1;
    queued = loss = serials = asks_lost = 0;
    lose_power_at = 0;
    lost = false;
    for (unsigned i = 0; i < NODES; i++) {
        board[i] = (struct board){.on = true,
                                  .kind = NODE_KIND_PROGRAM,
                                  .name = "mps2-an500",
                                  .digest = OLD};
        fill(board[i].serial, 9, NODE_SERIAL_BYTES);
    }
    options = (struct host_spread_options){.image = image,
                                           .bytes = BYTES,
                                           .patience_us = 30000000,
                                           .serial = make_serial,
                                           .say = say};
    host_node_set_all(&options.nodes, NODES);
    return 0;
}

static int run(void) {
    for (unsigned i = 0; i < NODES; i++)
        if (board[i].on && !seen[i].there)
            come_up(i);
    assert_int_equal(host_spread_open(&spread, &session, &options, &error), 0);
    int status = host_spread_look(&spread, &error);
    for (unsigned step = 0; status == 0 && !host_spread_over(&spread); step++) {
        assert_true(step < 100000);
        status = host_spread_step(&spread, 50000, &error);
    }
    status = status == 0 ? host_spread_run(&spread, &error) : status;
    return status == 0 ? host_spread_result(&spread, &error) : status;
}

static void is_in(unsigned i, enum host_spread_phase phase) {
    if (spread.node[i].phase != phase) {
        print_error("node %u: %s, expected: %s (%s)\n", i,
                    host_spread_phase_text(spread.node[i].phase),
                    host_spread_phase_text(phase), spread.node[i].text);
    }
    assert_int_equal(spread.node[i].phase, phase);
    if (phase == HOST_SPREAD_DONE) {
        assert_int_equal(board[i].digest, NEW);
        assert_int_equal(board[i].kind, NODE_KIND_PROGRAM);
    }
}

static void all_are_in(enum host_spread_phase phase) {
    for (unsigned i = 0; i < NODES; i++)
        is_in(i, phase);
}

/* What goes with a generation is not waited for. */
TEST_WITH(a_lost_generation_costs_no_wait, prepare, NULL) {
    uint64_t seconds[2];
    for (unsigned i = 0; i < 2; i++) {
        (void)prepare(NULL);
        machine.serial_baud = 115200;
        asks_lost = 6 * i;
        assert_int_equal(run(), 0);
        all_are_in(HOST_SPREAD_DONE);
        assert_int_equal(asks_lost, 0);
        seconds[i] = now_us / 1000000;
        host_spread_close(&spread);
    }
    print_message("%llu s, and %llu s with losses\n",
                  (unsigned long long)seconds[0],
                  (unsigned long long)seconds[1]);
    assert_true(seconds[1] <= seconds[0] + 3);
}

TEST_WITH(every_block_goes_once_to_all, prepare, NULL) {
    assert_int_equal(run(), 0);
    all_are_in(HOST_SPREAD_DONE);
    assert_int_equal(spread.sent, BLOCKS);
    for (unsigned i = 0; i < NODES; i++) {
        assert_int_equal(board[i].restarts, 1);
        assert_int_equal(board[i].boots, 1);
        assert_int_equal(board[i].blocks, BLOCKS);
    }
    assert_string_equal(said, "");
    host_spread_close(&spread);
}

/* What broken transfers have left is not sent again; what one lacks alone goes
 * to it alone. */
TEST_WITH(only_what_is_lacking_is_sent, prepare, NULL) {
    for (unsigned i = 0; i < NODES; i++)
        memset(board[i].map, 0xff, 1); /* blocks 0 .. 7 */
    board[2].map[0] = 0xf7;            /* but for 3 */
    assert_int_equal(run(), 0);
    all_are_in(HOST_SPREAD_DONE);
    assert_int_equal(spread.sent, BLOCKS - 7);
    assert_int_equal(board[2].blocks, BLOCKS - 7);
    assert_int_equal(board[1].blocks, BLOCKS - 8);
    host_spread_close(&spread);
}

TEST_WITH(nodes_that_are_left_out_are_left_alone, prepare, NULL) {
    options.nodes = (struct host_node_set){{0}};
    host_node_set_add(&options.nodes, 1);
    assert_int_equal(run(), 0);
    is_in(1, HOST_SPREAD_DONE);
    for (unsigned i = 0; i < NODES; i++) {
        assert_int_equal(board[i].restarts, i == 1);
        assert_int_equal(board[i].begins, i == 1);
    }
    host_spread_close(&spread);
}

TEST_WITH(what_is_lost_is_sent_again, prepare, NULL) {
    loss = 30;
    assert_int_equal(run(), 0);
    all_are_in(HOST_SPREAD_DONE);
    assert_true(spread.sent > BLOCKS);
    assert_true(spread.sent < 4 * BLOCKS);
    host_spread_close(&spread);
}

TEST_WITH(where_the_image_is_nothing_happens, prepare, NULL) {
    for (unsigned i = 0; i < NODES; i++)
        board[i].digest = NEW;
    assert_int_equal(run(), 0);
    all_are_in(HOST_SPREAD_HAS);
    for (unsigned i = 0; i < NODES; i++)
        assert_int_equal(board[i].restarts, 0);
    host_spread_close(&spread);
    (void)prepare(NULL);
    board[1].digest = NEW; /* again: verified and started anew */
    options.again = true;
    assert_int_equal(run(), 0);
    is_in(1, HOST_SPREAD_DONE);
    assert_int_equal(board[1].restarts, 1);
    assert_int_equal(board[1].blocks, 0);
    assert_int_equal(board[1].boots, 1);
    host_spread_close(&spread);
}

/* A board in its loader as it has nothing else, or as it was told to wait. */
TEST_WITH(empty_boards_are_filled_and_named, prepare, NULL) {
    for (unsigned i = 0; i < NODES; i++) {
        board[i].kind = NODE_KIND_LOADER;
        board[i].digest = 0;
        fill(board[i].serial, i == 3 ? 5 : 0, NODE_SERIAL_BYTES);
    }
    board[3].stay = true;
    board[3].digest = OLD;
    assert_int_equal(run(), 0);
    all_are_in(HOST_SPREAD_DONE);
    assert_int_equal(serials, 3);
    for (unsigned i = 0; i < NODES; i++) {
        assert_int_equal(board[i].restarts, 0);
        assert_int_equal(board[i].serial[0], i == 3 ? 5 : i + 1);
    }
    host_spread_close(&spread);
}

TEST_WITH(who_refuses_has_its_old_image_back, prepare, NULL) {
    board[2].refuses = LOADER_WRONG_KEY;
    assert_int_equal(run(), HOST_INPUT);
    is_in(2, HOST_SPREAD_REFUSED);
    assert_int_equal(board[2].kind, NODE_KIND_PROGRAM);
    assert_int_equal(board[2].digest, OLD);
    is_in(0, HOST_SPREAD_DONE);
    assert_non_null(strstr(error.text, "node 2: refuses the image: it is "
                                       "signed with another key; sign it"));
    host_spread_close(&spread);
}

TEST_WITH(every_refusal_says_what_to_do, prepare, NULL) {
    for (unsigned f = LOADER_GOOD + 1; f <= LOADER_FAULTS; f++) {
        (void)prepare(NULL);
        for (unsigned i = 0; i < NODES; i++)
            board[i].refuses = (enum loader_fault)f;
        assert_int_equal(run(), HOST_INPUT);
        all_are_in(HOST_SPREAD_REFUSED);
        assert_non_null(strstr(error.text, "nodes 0-3: refuses"));
        assert_non_null(strstr(error.text, "; "));
        host_spread_close(&spread);
    }
}

static const char *known_board(void *unused, unsigned node) {
    (void)unused;
    return node == 1 ? "raspi3b" : node == 2 ? "linux" : "mps2-an500";
}

TEST_WITH(other_boards_are_passed_over_or_refused, prepare, NULL) {
    for (unsigned known = 0; known < 2; known++) {
        (void)prepare(NULL);
        board[1].name = "raspi3b";
        board[1].no_loader = true;
        board[2].name = "linux";
        board[2].kind = NODE_KIND_PROCESS;
        board[3].no_loader = true;
        options.board = known != 0 ? known_board : NULL;
        assert_int_equal(run(), HOST_INPUT);
        is_in(0, HOST_SPREAD_DONE);
        is_in(1, known != 0 ? HOST_SPREAD_PASSED : HOST_SPREAD_REFUSED);
        is_in(2, known != 0 ? HOST_SPREAD_PASSED : HOST_SPREAD_REFUSED);
        is_in(3, HOST_SPREAD_REFUSED);
        for (unsigned i = 1; i < NODES; i++)
            assert_int_equal(board[i].restarts, 0);
        assert_true((strstr(said, "incode deploy") != NULL) == (known == 0));
        host_spread_close(&spread);
    }
}

TEST_WITH(who_is_off_is_waited_for, prepare, NULL) {
    board[3].on = false;
    off_until_us[3] = 12000000;
    assert_int_equal(run(), 0);
    all_are_in(HOST_SPREAD_DONE);
    assert_non_null(strstr(said, "node 3: is not heard; waits for up to 30 s"));
    host_spread_close(&spread);
}

TEST_WITH(who_stays_off_is_named_and_the_others_are_done, prepare, NULL) {
    board[1].on = board[3].on = false;
    assert_int_equal(run(), HOST_CUBE);
    is_in(0, HOST_SPREAD_DONE);
    is_in(1, HOST_SPREAD_LOST);
    is_in(2, HOST_SPREAD_DONE);
    is_in(3, HOST_SPREAD_LOST);
    assert_string_equal(error.text, "nodes 1,3: is not heard; turn it on");
    assert_true(now_us < 40000000);
    host_spread_close(&spread);
}

/* Whatever block it was at: it goes on from there. */
TEST_WITH(lost_power_loses_nothing_that_is_written, prepare, NULL) {
    for (uint32_t at = 1; at <= BLOCKS; at++) {
        (void)prepare(NULL);
        lose_power_at = at;
        assert_int_equal(run(), 0);
        all_are_in(HOST_SPREAD_DONE);
        assert_int_equal(board[0].blocks, BLOCKS);
        assert_int_equal(board[1].blocks, BLOCKS);
        host_spread_close(&spread);
    }
}

TEST_WITH(an_image_that_does_not_come_up_is_told, prepare, NULL) {
    board[0].end = FALLS_BACK;
    board[1].end = STAYS;
    assert_int_equal(run(), HOST_CUBE);
    is_in(0, HOST_SPREAD_FELL_BACK);
    is_in(1, HOST_SPREAD_FELL_BACK);
    is_in(2, HOST_SPREAD_DONE);
    assert_non_null(strstr(spread.node[0].text,
                           "went back to the old: started 3 times, last "
                           "fault: watchdog; "));
    assert_non_null(strstr(error.text, "waits in its loader"));
    assert_int_equal(board[0].boots, 1);
    host_spread_close(&spread);
}

TEST_WITH(a_loader_that_says_nothing_is_given_up, prepare, NULL) {
    board[2].mute = true;
    assert_int_equal(run(), HOST_CUBE);
    is_in(0, HOST_SPREAD_DONE);
    is_in(2, HOST_SPREAD_LOST);
    assert_non_null(strstr(error.text, "node 2: is not heard"));
    host_spread_close(&spread);
}

/* Its links are up, and pings are answered. */
TEST_WITH(a_loader_that_takes_nothing_is_given_up, prepare, NULL) {
    board[2].deaf = true;
    assert_int_equal(run(), HOST_CUBE);
    is_in(0, HOST_SPREAD_DONE);
    is_in(2, HOST_SPREAD_LOST);
    assert_non_null(strstr(error.text, "0 of 20 blocks"));
    host_spread_close(&spread);
}

TEST_WITH(who_restarts_for_ever_is_given_up, prepare, NULL) {
    board[1].restless = true;
    options.patience_us = 1000000000;
    assert_int_equal(run(), HOST_CUBE);
    is_in(0, HOST_SPREAD_DONE);
    is_in(1, HOST_SPREAD_LOST);
    assert_non_null(strstr(error.text, "again and again"));
    host_spread_close(&spread);
}

TEST_WITH(another_version_is_refused, prepare, NULL) {
    come_up(1);
    seen[1].who = (struct node_who){.protocol = NODE_PROTOCOL + 1};
    assert_int_equal(run(), HOST_INPUT);
    is_in(1, HOST_SPREAD_REFUSED);
    assert_non_null(strstr(error.text, "another version"));
    host_spread_close(&spread);
}

TEST_WITH(a_look_changes_nothing, prepare, NULL) {
    board[1].digest = NEW;
    board[2].on = false;
    for (unsigned i = 0; i < NODES; i++)
        if (board[i].on)
            come_up(i);
    assert_int_equal(host_spread_open(&spread, &session, &options, &error), 0);
    assert_int_equal(host_spread_look(&spread, &error), 0);
    is_in(0, HOST_SPREAD_LEAVES);
    is_in(1, HOST_SPREAD_HAS);
    is_in(2, HOST_SPREAD_AWAITED);
    assert_int_equal(board[0].restarts, 0);
    assert_int_equal(queued, 0);
    assert_true(now_us < 5000000);
    host_spread_close(&spread);
}

TEST_WITH(a_cube_that_is_lost_ends_it, prepare, NULL) {
    lost = true;
    assert_int_equal(run(), HOST_CUBE);
    assert_string_equal(error.text, "host: no wire; plug it in");
    host_spread_close(&spread);
}

/* Power, losses and absences by chance: each is done in the end. */
TEST_WITH(chance_does_not_stop_it, prepare, NULL) {
    for (uint32_t seed = 1; seed <= 300; seed++) {
        (void)prepare(NULL);
        random_state = seed;
        loss = draw(40);
        lose_power_at = draw(2 * BLOCKS);
        for (unsigned i = 0; i < NODES; i++) {
            board[i].on = draw(4) != 0;
            off_until_us[i] = 1 + draw(20000000);
            board[i].kind = NODE_KIND_PROGRAM + draw(2);
            board[i].digest = board[i].kind == NODE_KIND_LOADER ? 0 : OLD;
            board[i].map[0] = (uint8_t)draw(256);
        }
        if (run() != 0)
            print_error("seed %u: %s\n", seed, error.text);
        all_are_in(HOST_SPREAD_DONE);
        host_spread_close(&spread);
    }
}
