/* How often what others can order may wear a board's flash, or keep its loader
 * from its work: a number of times at once, then one in each period, whoever
 * orders it.  It is kept in memory that a restart leaves alone, so that a
 * restart gives nothing back; only a loss of power does, and no wire can cause
 * that.
 *
 * |            | at once | then one in | what it bounds |
 * |------------|---------|-------------|----------------|
 * | starts     |   1,000 | 60 s        | records in boots.h's two sectors |
 * | transfers  |     100 | 4 h         | erasures of a slot: 3 of each sector a
 * |            |         |             | transfer |
 * | false      |       6 | 10 s        | proofs of signatures that were false |
 *
 * A flash that bears 100,000 erasures of a sector, with sectors of 4 KB and so
 * 256 records each, so lasts for 96 years of starts without a pause, and 15
 * years of transfers.
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
    uint32_t debt_s[LOADER_EXPENSES]; /* after so long all is free again */
    uint32_t passed_s; /* of this start, that are counted already */
    uint32_t crc;
};

/* At a start, of whatever program: goes on with what the start before has left;
 * what is none of this begins anew. */
void loader_budget_open(struct loader_budget *budget);

/* now_us: since the start.  To be called once a second or more often; what is
 * not counted is not given back. */
void loader_budget_pass(struct loader_budget *budget, uint64_t now_us);

/* Whether it may be done now; taken: it is. */
bool loader_budget_has(const struct loader_budget *budget,
                       enum loader_expense what);
bool loader_budget_take(struct loader_budget *budget, enum loader_expense what);

#endif
