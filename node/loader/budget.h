/* Limits on what messages can order that wears a board's flash or keeps its
 * loader busy: a number of times at once, then one in each period, whatever
 * orders it.  The counts are in memory that outlasts a restart.  Only a loss of
 * power resets them, and no message can cause that.
 *
 * |            | at once | then one in | what it bounds |
 * |------------|---------|-------------|----------------|
 * | starts     |   1,000 | 60 s        | records in boots.h's two sectors |
 * | transfers  |     100 | 4 h         | erasures of a slot: 3 of each sector a
 * |            |         |             | transfer |
 * | false      |       6 | 10 s        | proofs of signatures that were false |
 *
 * So a flash that bears 100,000 erasures of a sector lasts for 96 years of
 * starts at the limit, as a sector of 4 KB holds 256 records, and for 15 years
 * of transfers at the limit.
 *
 * Memory: the struct.  Work: a CRC of it a call.
 *
 *     loader_budget_open(&budget);           // at the start
 *     loader_budget_pass(&budget, now_us);   // as time goes by
 *     if (!loader_budget_take(&budget, LOADER_STARTS))
 *         return -1; // not now
 */
#ifndef NODE_LOADER_BUDGET_H
#define NODE_LOADER_BUDGET_H

#include <stdbool.h>
#include <stdint.h>

enum loader_expense {
    LOADER_STARTS,
    LOADER_TRANSFERS, /* for which a slot is made ready */
    LOADER_FALSE,     /* headers whose signature was false */
    LOADER_EXPENSES
};

struct loader_budget {
    uint32_t magic;
    uint32_t debt_s[LOADER_EXPENSES]; /* until the full number is free again */
    uint32_t passed_s; /* since this start, already subtracted from the debts */
    uint32_t crc;
};

/* At a start of any program: goes on with the counts of the start before.
 * Memory without valid counts begins with none. */
void loader_budget_open(struct loader_budget *budget);

/* now_us: since the start.  To be called at least once a second: time that is
 * not counted frees nothing. */
void loader_budget_pass(struct loader_budget *budget, uint64_t now_us);

/* Whether `what` may be done now; _take also counts it as done. */
bool loader_budget_has(const struct loader_budget *budget,
                       enum loader_expense what);
bool loader_budget_take(struct loader_budget *budget, enum loader_expense what);

#endif
