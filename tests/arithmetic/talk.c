#include "talk.h"

#include <stdbool.h>
#include <stddef.h>

#include "cases.h"

enum { LINE_MAX = 120 };

struct talk {
    void (*put)(void *context, const char *line);
    void *context;
    char line[LINE_MAX + 1];
    size_t length;
};

static void add(struct talk *talk, const char *text) {
    for (; *text != 0 && talk->length < LINE_MAX; text++)
        talk->line[talk->length++] = *text;
}

static void add_number(struct talk *talk, uint32_t number) {
    char digits[11];
    size_t at = sizeof digits - 1;
    digits[at] = 0;
    do
        digits[--at] = (char)('0' + number % 10);
    while ((number /= 10) != 0);
    add(talk, " ");
    add(talk, digits + at);
}

static void add_bits(struct talk *talk, uint64_t bits) {
    char digits[17] = {0};
    for (int i = 15; i >= 0; i--, bits >>= 4)
        digits[i] = "0123456789abcdef"[bits & 15];
    add(talk, " ");
    add(talk, digits);
}

static void end_line(struct talk *talk) {
    talk->line[talk->length] = 0;
    talk->length = 0;
    talk->put(talk->context, talk->line);
}

static void blocks(struct talk *talk, uint32_t first, uint32_t last,
                   uint32_t step) {
    for (uint32_t b = first; b <= last && b < CASES_BLOCKS; b += step) {
        add(talk, "block");
        add_number(talk, b);
        add_bits(talk, cases_block(b));
        add(talk, " ");
        add(talk, cases_kind(b));
        end_line(talk);
    }
}

static void cases(struct talk *talk, uint32_t block) {
    for (uint32_t number = 0; number < CASES_PER_BLOCK; number++) {
        struct record record = record_begin();
        cases_case(block, number, &record);
        add(talk, "case");
        add_number(talk, block);
        add_number(talk, number);
        add_bits(talk, record.digest);
        end_line(talk);
    }
}

static void tell_step(void *context, const char *name, uint64_t bits) {
    struct talk *talk = context;
    add(talk, "step");
    add_bits(talk, bits);
    add(talk, " ");
    add(talk, name);
    end_line(talk);
}

static void steps(struct talk *talk, uint32_t block, uint32_t number) {
    struct record record = record_begin();
    record.tell = tell_step;
    record.context = talk;
    cases_case(block, number, &record);
}

/* Whether the line begins with the word; then *at is behind it. */
static bool word(const char **at, const char *expected) {
    const char *c = *at;
    for (; *expected != 0; c++, expected++)
        if (*c != *expected)
            return false;
    *at = c;
    return true;
}

/* A number of up to nine digits, 0 where there is none. */
static uint32_t number(const char **at) {
    uint32_t n = 0;
    while (**at == ' ')
        ++*at;
    for (int i = 0; i < 9 && **at >= '0' && **at <= '9'; i++)
        n = 10 * n + (uint32_t)(*(*at)++ - '0');
    return n;
}

void talk_answer(const char *asked,
                 void (*put)(void *context, const char *line), void *context) {
    struct talk talk = {.put = put, .context = context};
    const char *at = asked;
    if (word(&at, "blocks")) {
        uint32_t first = number(&at), last = number(&at), step = number(&at);
        blocks(&talk, first, last, step != 0 ? step : 1);
    } else if (word(&at, "cases")) {
        uint32_t block = number(&at);
        if (block < CASES_BLOCKS)
            cases(&talk, block);
    } else if (word(&at, "steps")) {
        uint32_t block = number(&at), of = number(&at);
        if (block < CASES_BLOCKS && of < CASES_PER_BLOCK)
            steps(&talk, block, of);
    } else if (word(&at, "hello")) {
        add(&talk, "hello");
        add_number(&talk, number(&at));
        end_line(&talk);
    } else {
        put(context, "blocks FIRST LAST STEP, cases BLOCK, steps BLOCK CASE, "
                     "hello NUMBER");
    }
    put(context, "end");
}
