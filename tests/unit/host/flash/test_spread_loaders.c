/* Images on their way to boards in virtual time: the real session, the real
 * loader, the real node program, over serial wires and chips that take the time
 * of serial NOR flash.  Power and wires go by seed. */
#include "loader_boards.h"

/* From empty boards, and again over a program that runs. */
TEST(the_wire_is_kept_full) {
    double seconds[2];
    for (unsigned i = 0; i < 2; i++) {
        open_world(4 * i, 1);
        seconds[i] = flash(&old);
        print_message("%u boards: %.2f s, %.0f %% of the wire's rate\n",
                      machine.nodes, seconds[i],
                      100.0 * IMAGE_BYTES * 10 / BAUD / seconds[i]);
        assert_all_run(&old);
        close_world();
    }
    assert_true((double)IMAGE_BYTES * 10 / BAUD >= 0.8 * seconds[0]);
    assert_true(seconds[1] <= 1.6 * seconds[0]);
}

/* Wires that carry a sixth of what is said of them, and drivers that take a
 * little, or whatever the links' windows hold, ahead of the wire. */
TEST(of_slow_wires_answers_take_little) {
    static const uint32_t rooms[] = {512, 8192};
    for (unsigned k = 0; k < 2; k++) {
        double seconds[2];
        wires_are(115200, 19200, rooms[k]);
        for (unsigned i = 0; i < 2; i++) {
            open_world(4 * i, 1);
            seconds[i] = flash(&small);
            print_message("%u boards, %u bytes ahead: %.2f s, %.0f %% of the "
                          "wire's rate\n",
                          machine.nodes, room, seconds[i],
                          100.0 * SMALL_BYTES * 10 / carried_baud / seconds[i]);
            assert_all_run(&small);
            close_world();
        }
        assert_true((double)SMALL_BYTES * 10 / carried_baud >=
                    0.8 * seconds[0]);
        assert_true(seconds[1] <= 1.6 * seconds[0]);
    }
    wires_are(BAUD, BAUD, 512);
}

TEST(a_second_image_takes_the_first_s_place) {
    open_world(2, 2);
    (void)flash(&old);
    (void)flash(&new);
    assert_all_run(&new);
    uint32_t erased = board[3].chip.erased, boot = board[3].boot;
    (void)flash(&new); /* it is there: nothing happens */
    assert_int_equal(board[3].chip.erased, erased);
    assert_int_equal(board[3].boot, boot);
    (void)flash(&old);
    assert_all_run(&old);
    close_world();
}

/* A slot that had another image has to be erased, for longer than the wire
 * takes: what comes meanwhile waits in the links' windows.  Its way into the
 * loader, a second, included. */
TEST(erasing_goes_beside_the_wire) {
    open_world(0, 3);
    (void)flash(&old);
    (void)flash(&new);
    uint32_t erased = board[0].chip.erased;
    double seconds = flash(&third);
    print_message("over another image: %.2f s, %u sectors erased\n", seconds,
                  board[0].chip.erased - erased);
    assert_true(board[0].chip.erased - erased >= IMAGE_BYTES / 4096);
    assert_true(seconds <= 2.0 * IMAGE_BYTES * 10 / BAUD);
    close_world();
}

/* --- a run that finds a loader -------------------------------------------- */

static char told[NODE_FAULT_TEXT_MAX + 1];

static void hear(void *unused, const struct cube_message *message) {
    (void)unused;
    if (message->type == NODE_FAULT) {
        memcpy(told, message->data, message->size);
        told[message->size] = '\0';
    }
}

static void stay_for(uint64_t us) {
    for (uint64_t end_us = now_us + us; now_us < end_us;)
        assert_int_equal(host_session_round(&session, 10000, &error), 0);
}

static bool is_named(const struct board *b, const uint8_t *serial) {
    uint8_t has[NODE_SERIAL_BYTES];
    return loader_slots_serial(&b->chip.flash, has) &&
           memcmp(has, serial, sizeof has) == 0;
}

/* A board takes a name only with an image that the board's signer signed. */
TEST(a_name_counts_within_a_transfer_alone) {
    struct loader_do_message name = {.what = LOADER_NAME,
                                     .serial = {1, 2, 3, 4, 5, 6, 7, 8}};
    struct loader_begin_message begin = {.transfer = 9, .bytes = old.bytes};
    struct loader_image forged = old.image;
    struct host_node_set all;
    open_world(2, 4);
    host_node_set_all(&all, 4);
    assert_int_equal(host_session_wait(&session, &all, 5000000, &error), 0);
    begin.nodes[0] = 1 << 2;
    for (unsigned i = 0; i < 4; i++) {
        name.transfer = i % 2 == 0 ? 0 : begin.transfer;
        if (i == 2) { /* with a signature that is false */
            forged.signature[0] ^= 1;
            loader_image_pack(&forged, begin.header);
            assert_true(host_session_send(&session, 2, NODE_IMAGE_BEGIN, &begin,
                                          sizeof begin));
        }
        assert_true(
            host_session_send(&session, 2, NODE_IMAGE_DO, &name, sizeof name));
        stay_for(300000);
        assert_false(is_named(&board[2], name.serial));
    }
    memcpy(begin.header, old.all, sizeof begin.header);
    assert_true(
        host_session_send(&session, 2, NODE_IMAGE_BEGIN, &begin, sizeof begin));
    assert_true(
        host_session_send(&session, 2, NODE_IMAGE_DO, &name, sizeof name));
    stay_for(300000);
    assert_true(is_named(&board[2], name.serial));
    close_world();
}

TEST(a_loader_answers_as_a_node) {
    struct node_setup_message setup = {.protocol = NODE_PROTOCOL, .nodes = 4};
    struct host_node_set all;
    open_world(2, 4);
    host_node_set_all(&all, 4);
    assert_int_equal(host_session_wait(&session, &all, 5000000, &error), 0);
    for (unsigned i = 0; i < 4; i++) {
        const struct node_who *who = &session.node[i].who;
        assert_true(session.node[i].there);
        assert_int_equal(who->kind, NODE_KIND_LOADER);
        assert_int_equal(who->boot, 1);
        assert_int_equal(who->digest[0] | who->serial[0], 0);
    }
    session.take = hear;
    told[0] = '\0';
    assert_true(
        host_session_send(&session, 3, NODE_SETUP, &setup, sizeof setup));
    stay_for(300000);
    assert_non_null(strstr(told, "no program is running"));
    for (enum node_question q = NODE_WHO; q <= NODE_PROBE; q++) {
        assert_int_equal(
            host_session_ask(&session, &all, q, 1, 3000000, &error), 0);
        for (unsigned i = 0; i < 4; i++)
            assert_true(session.node[i].answered);
    }
    assert_int_equal(
        host_session_restart(&session, &all, NODE_RESTART_STAY, &error), 0);
    stay_for(2000000);
    for (unsigned i = 0; i < 4; i++) {
        assert_int_equal(board[i].boot, 2);
        assert_non_null(board[i].loader);
    }
    assert_true(host_session_send(&session, CUBE_ALL, NODE_STOP, NULL, 0));
    stay_for(2000000);
    for (unsigned i = 0; i < 4; i++)
        assert_int_equal(board[i].boot, 3);
    close_world();
}

/* Its neighbours are flashed and run; it says what is wrong with it. */
TEST(a_board_with_a_worn_flash_waits_and_says_so) {
    struct node_setup_message setup = {.protocol = NODE_PROTOCOL, .nodes = 4};
    struct host_node_set all, worn = {{0}};
    open_world(2, 4);
    host_node_set_all(&all, 4);
    host_node_set_add(&worn, 1);
    (void)flash(&old);
    board[1].chip.worn_out = true;
    unsigned starts = session.node[1].starts;
    assert_int_equal(
        host_session_restart(&session, &all, NODE_RESTART_PLAIN, &error), 0);
    stay_for(10000000);
    assert_int_equal(host_session_wait(&session, &all, 5000000, &error), 0);
    assert_null(board[1].node);
    assert_non_null(board[1].loader);
    assert_int_equal(session.node[1].starts, starts + 1);
    assert_int_equal(session.node[1].who.kind, NODE_KIND_LOADER);
    assert_int_equal(session.node[1].who.boot, 0);
    for (unsigned i = 0; i < 4; i++)
        assert_true(i == 1 || board[i].node != NULL);
    assert_int_equal(
        host_session_ask(&session, &worn, NODE_LOG, 0, 3000000, &error), 0);
    assert_non_null(strstr((const char *)session.node[1].answer, "is worn"));
    session.take = hear;
    told[0] = '\0';
    assert_true(
        host_session_send(&session, 1, NODE_SETUP, &setup, sizeof setup));
    stay_for(300000);
    assert_non_null(strstr(told, "it is worn"));
    close_world();
}

/* --- what befalls them ---------------------------------------------------- */

enum { CUTS_MAX = 3 };
static uint64_t strike_us;
static unsigned struck;
static int pulled; /* the wire, or -1 */

static void pull(bool out) {
    for (unsigned side = 0; side < 2; side++)
        host_sim_cube_deaf(&wires, (unsigned)pulled, side, out);
}

/* Power goes in the midst of one of a board's next operations, or at once; a
 * wire is off for a while. */
static void befall(void) {
    if (now_us < strike_us)
        return;
    if (pulled >= 0) {
        pull(false);
        pulled = -1;
    } else if (struck < CUTS_MAX * machine.nodes) {
        struct board *b = &board[draw(machine.nodes)];
        struck++;
        if (draw(3) == 0) {
            pulled = (int)draw(wires.wires);
            pull(true);
        } else if (!b->off && b->cuts < CUTS_MAX) {
            b->chip.until_loss = (long)draw(40);
        }
    }
    strike_us = now_us + draw(400000);
}

TEST(losses_cost_time_alone) {
    for (uint64_t seed = 1; seed <= 12; seed++) {
        open_world((unsigned)seed % 4, seed);
        strike_us = 0;
        struck = 0;
        pulled = -1;
        (void)flash(&old);
        strike = befall;
        (void)flash(&new);
        strike = NULL;
        assert_all_run(&new);
        close_world();
    }
}

/* The host, or a board, is kept from its work for 1 to 10 seconds, as on a
 * machine that has much to do. */
static void hold_up(void) {
    uint64_t until_us;
    if (now_us < strike_us)
        return;
    until_us = now_us + 1000000 + draw(9000000);
    unsigned who = draw(machine.nodes + 1);
    if (who == machine.nodes)
        host_busy_us = until_us;
    else if (!board[who].off)
        board[who].busy_us = until_us;
    strike_us = until_us + 1000 * draw(10000);
}

TEST(pauses_cost_time_alone) {
    static const uint32_t rooms[] = {512, 8192, 65536};
    double worst = 0;
    for (uint64_t seed = 1; seed <= 8; seed++) {
        wires_are(115200, 19200, rooms[seed % 3]);
        faults.chance[SIM_LOSS] = seed % 4 == 1 ? 0.02 : 0;
        open_world(seed % 5 == 0 ? 2 : seed % 2, seed);
        strike_us = 0;
        strike = hold_up;
        double seconds = flash(&small);
        strike = NULL;
        worst = seconds > worst ? seconds : worst;
        assert_all_run(&small);
        close_world();
    }
    print_message("at most %.0f s\n", worst);
    faults.chance[SIM_LOSS] = 0;
    wires_are(BAUD, BAUD, 512);
}

static int make_images(void **unused) {
    (void)unused;
    made_make(&old, IMAGE_BYTES, 5);
    made_make(&new, IMAGE_BYTES - 5000, 6);
    made_make(&third, IMAGE_BYTES, 7);
    made_make(&small, SMALL_BYTES, 8);
    return 0;
}

TEST_GROUP(make_images, NULL)
