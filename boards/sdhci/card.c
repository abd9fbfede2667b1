#include "sdhci.h"

#include "boards/bare/bare.h"

/* Words behind sdhci_registers(). */
enum {
    BLOCKS = 0x04 / 4,
    ARGUMENT = 0x08 / 4,
    COMMAND = 0x0C / 4,
    ANSWER = 0x10 / 4,
    DATA = 0x20 / 4,
    STATE = 0x24 / 4,
    LINES = 0x28 / 4,
    CLOCK = 0x2C / 4,
    EVENTS = 0x30 / 4,
    EVENTS_SEEN = 0x34 / 4,
    EVENTS_CALL = 0x38 / 4
};
enum { BUSY_COMMAND = 1, BUSY_DATA = 2 };
enum {
    COMMAND_DONE = 1 << 0,
    DATA_DONE = 1 << 1,
    ROOM = 1 << 4,
    CAME = 1 << 5,
    WRONG = 1 << 15,
    ALL_EVENTS = 0x17F0033
};
enum {
    CLOCK_INSIDE = 1 << 0,
    CLOCK_STABLE = 1 << 1,
    CLOCK_OUT = 1 << 2,
    LONGEST_WAIT = 14 << 16, /* for data: the controller's own */
    RESET_ALL = 1 << 24,
    RESET_LINES = 3 << 25 /* of commands and of data */
};

/* Of a command: what the card answers, and whether data follow. */
enum {
    LONG = 1 << 16,
    SHORT = 2 << 16,
    SHORT_BUSY = 3 << 16,
    CHECKED = 3 << 19, /* number and sum of the answer */
    READS = 1 << 21 | 1 << 4,
    WRITES = 1 << 21
};
#define NUMBER(n) ((uint32_t)(n) << 24)
enum { R1 = SHORT | CHECKED, R6 = R1, R7 = R1 };

static const struct {
    uint32_t idle, condition, identify, address, select, choose, size, read,
        write, application;
} commands = {.idle = NUMBER(0),
              .identify = NUMBER(2) | LONG | 1 << 19,
              .address = NUMBER(3) | R6,
              .select = NUMBER(7) | SHORT_BUSY | CHECKED,
              .choose = NUMBER(8) | R7,
              .size = NUMBER(16) | R1,
              .read = NUMBER(17) | R1 | READS,
              .write = NUMBER(24) | R1 | WRITES,
              .condition = NUMBER(41) | SHORT,
              .application = NUMBER(55) | R1};

/* Arguments, and bits of answers. */
enum { CHOICE = 0x1AA /* 3.3 V, and a pattern to give back */ };
#define VOLTAGES UINT32_C(0x00FF8000) /* 2.7 to 3.6 V */
#define LARGE UINT32_C(0x40000000)    /* its addresses are of blocks */
#define STARTED UINT32_C(0x80000000)
#define REFUSED UINT32_C(0xFDF98008) /* of R1: an error */

/* The controller is fed with 250 MHz at most.  A slower clock makes all of this
 * slower, and nothing else. */
enum { SLOW_DIVISOR = 313 /* 400 kHz */, FAST_DIVISOR = 5 /* 25 MHz */ };
/* Two cycles of the card's clock must pass between two writes of a register, or
 * the chip loses the second. */
enum { SLOW_WRITE_US = 10, FAST_WRITE_US = 1 };

enum { BLOCK = LOADER_CARD_BLOCK };

enum {
    COMMAND_US = 100000,
    DATA_US = 1000000, /* cards take 250 ms for a block at most, large 500 */
    START_US = 1500000,
    TRIES = 3
};

static struct {
    uint32_t write_us; /* between writes of registers */
    uint32_t relative; /* the card's address, in the upper half */
    bool ready, large;
} it;

/* --- the controller ------------------------------------------------------- */

static uint32_t get(unsigned word) {
    return sdhci_registers()[word];
}

static void pass(uint64_t us) {
    uint64_t begun_us = board_now_us();
    while (board_now_us() - begun_us <= us) {
    }
}

static void put(unsigned word, uint32_t value) {
    sdhci_registers()[word] = value;
    pass(it.write_us);
}

/* Until one of these bits is set, or none of them. */
static bool wait_for(unsigned word, uint32_t bits, bool set, uint64_t us) {
    uint64_t begun_us = board_now_us();
    while (((get(word) & bits) != 0) != set)
        if (board_now_us() - begun_us > us)
            return false;
    return true;
}

static bool wait_for_event(uint32_t event, uint64_t us) {
    bool came =
        wait_for(EVENTS, event | WRONG, true, us) && (get(EVENTS) & WRONG) == 0;
    put(EVENTS, came ? event : ALL_EVENTS);
    return came;
}

static bool set_clock(uint32_t divisor) {
    uint32_t clock =
        LONGEST_WAIT | CLOCK_INSIDE | (divisor & 0xFF) << 8 | divisor >> 8 << 6;
    put(CLOCK, LONGEST_WAIT);
    put(CLOCK, clock);
    if (!wait_for(CLOCK, CLOCK_STABLE, true, COMMAND_US))
        return false;
    put(CLOCK, clock | CLOCK_OUT);
    return true;
}

/* What a command that failed has left. */
static void clear_lines(void) {
    put(CLOCK, get(CLOCK) | RESET_LINES);
    (void)wait_for(CLOCK, RESET_LINES, false, COMMAND_US);
    put(EVENTS, ALL_EVENTS);
}

/* *answer: of a short one. */
static bool ask(uint32_t command, uint32_t argument, uint32_t *answer) {
    uint32_t busy = BUSY_COMMAND;
    if ((command & SHORT_BUSY) == SHORT_BUSY || (command & WRITES) != 0)
        busy |= BUSY_DATA;
    if (!wait_for(STATE, busy, false, DATA_US)) {
        clear_lines();
        return false;
    }
    put(EVENTS, ALL_EVENTS);
    put(ARGUMENT, argument);
    put(COMMAND, command);
    if (!wait_for_event(COMMAND_DONE, COMMAND_US)) {
        clear_lines();
        return false;
    }
    *answer = get(ANSWER);
    return true;
}

/* --- the card ------------------------------------------------------------- */

/* Its own command of that number. */
static bool ask_own(uint32_t command, uint32_t argument, uint32_t *answer) {
    return ask(commands.application, it.relative, answer) &&
           ask(command, argument, answer);
}

/* An old card knows nothing of the choice of voltages. */
static bool wake(void) {
    uint32_t answer = 0;
    uint64_t begun_us = board_now_us();
    bool young = ask(commands.choose, CHOICE, &answer);
    if (young && (answer & 0xFFF) != CHOICE)
        return false;
    do {
        uint32_t wanted = young ? VOLTAGES | LARGE : VOLTAGES;
        if (!ask_own(commands.condition, wanted, &answer) ||
            board_now_us() - begun_us > START_US)
            return false;
    } while ((answer & STARTED) == 0);
    it.large = (answer & LARGE) != 0;
    return true;
}

static bool start(void) {
    uint32_t answer = 0;
    it.ready = false;
    it.relative = 0;
    it.write_us = SLOW_WRITE_US;
    uint32_t lines = sdhci_start();
    put(CLOCK, RESET_ALL);
    if (!wait_for(CLOCK, RESET_ALL, false, COMMAND_US) ||
        !set_clock(SLOW_DIVISOR))
        return false;
    put(LINES, lines);
    put(EVENTS_CALL, 0);
    put(EVENTS_SEEN, ALL_EVENTS);
    pass(1000); /* 74 cycles of the clock and more, before a card listens */
    if (!ask(commands.idle, 0, &answer) || !wake() ||
        !ask(commands.identify, 0, &answer) ||
        !ask(commands.address, 0, &answer))
        return false;
    it.relative = answer & 0xFFFF0000;
    if (!ask(commands.select, it.relative, &answer) ||
        !ask(commands.size, BLOCK, &answer) || !set_clock(FAST_DIVISOR))
        return false;
    it.write_us = FAST_WRITE_US;
    it.ready = true;
    return true;
}

/* In words, the lowest byte first. */
static void take(uint8_t *bytes) {
    for (unsigned i = 0; i < BLOCK; i += 4) {
        uint32_t word = get(DATA);
        for (unsigned k = 0; k < 4; k++)
            bytes[i + k] = (uint8_t)(word >> 8 * k);
    }
}

static void give(const uint8_t *bytes) {
    for (unsigned i = 0; i < BLOCK; i += 4) {
        uint32_t word = 0;
        for (unsigned k = 0; k < 4; k++)
            word |= (uint32_t)bytes[i + k] << 8 * k;
        sdhci_registers()[DATA] = word;
    }
}

/* One of both is NULL.  Of a write, the card has it when it is busy no more. */
static bool move(uint32_t block, uint8_t *to, const uint8_t *from) {
    uint32_t answer = 0, command = to != NULL ? commands.read : commands.write;
    put(BLOCKS, 1u << 16 | BLOCK);
    if (!ask(command, it.large ? block : block * BLOCK, &answer))
        return false;
    bool good = (answer & REFUSED) == 0 &&
                wait_for_event(to != NULL ? CAME : ROOM, DATA_US);
    if (good && to != NULL)
        take(to);
    else if (good)
        give(from);
    good = good && wait_for_event(DATA_DONE, DATA_US) &&
           wait_for(STATE, BUSY_DATA, false, DATA_US);
    if (!good)
        clear_lines();
    return good;
}

/* A card that does not answer is started anew. */
static bool try_to(uint32_t block, uint8_t *to, const uint8_t *from) {
    board_feed();
    for (unsigned i = 0; i < TRIES; i++) {
        if ((it.ready || start()) && move(block, to, from))
            return true;
        it.ready = false;
    }
    return false;
}

static bool sdhci_read(void *device, uint32_t block, uint8_t *bytes) {
    (void)device;
    return try_to(block, bytes, NULL);
}

static bool sdhci_write(void *device, uint32_t block, const uint8_t *bytes) {
    (void)device;
    return try_to(block, NULL, bytes);
}

/* --- as a flash ----------------------------------------------------------- */

static struct loader_card card = {.read = sdhci_read, .write = sdhci_write};

const struct loader_flash sdhci_flash = LOADER_CARD(&card);
