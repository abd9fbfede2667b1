#include "budget.h"

#include <stddef.h>

#include "transport/frame.h"

enum { MAGIC = 0x31474442 /* "BDG1" */ };

static const struct {
    uint32_t at_once, period_s;
} limits[LOADER_EXPENSES] = {[LOADER_STARTS] = {1000, 60},
                             [LOADER_TRANSFERS] = {100, 4 * 3600},
                             [LOADER_FALSE] = {6, 10}};

static uint32_t sum(const struct loader_budget *budget) {
    return frame_crc32c(0, budget, offsetof(struct loader_budget, crc));
}

void loader_budget_open(struct loader_budget *budget) {
    if (budget->magic != MAGIC || budget->crc != sum(budget)) {
        *budget = (struct loader_budget){.magic = MAGIC};
    }
    budget->passed_s = 0;
    budget->crc = sum(budget);
}

void loader_budget_pass(struct loader_budget *budget, uint64_t now_us) {
    uint32_t now_s = (uint32_t)(now_us / 1000000);
    uint32_t passed_s = now_s - budget->passed_s;
    if (passed_s == 0) {
        return;
    }
    budget->passed_s = now_s;
    for (unsigned i = 0; i < LOADER_EXPENSES; i++) {
        uint32_t *debt_s = &budget->debt_s[i];
        *debt_s -= passed_s < *debt_s ? passed_s : *debt_s;
    }
    budget->crc = sum(budget);
}

bool loader_budget_has(const struct loader_budget *budget,
                       enum loader_expense what) {
    return budget->debt_s[what] <=
           (limits[what].at_once - 1) * limits[what].period_s;
}

bool loader_budget_take(struct loader_budget *budget,
                        enum loader_expense what) {
    if (!loader_budget_has(budget, what)) {
        return false;
    }
    budget->debt_s[what] += limits[what].period_s;
    budget->crc = sum(budget);
    return true;
}
