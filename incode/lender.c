#include "lender.h"

#include "state.h"

enum { USED = 32 /* tetrahedra a step, at most: a star's room suffices */ };

bool incode_triangulator_lend(struct incode_triangulator *t,
                              struct incode_loan *loan) {
    return t->phase == INCODE_PHASE_FACES &&
           incode_triangulator_fault(t) == NULL &&
           incode_front_lend_run(&t->front, loan);
}

static uint32_t lesser(uint32_t a, size_t b) {
    return a < b ? a : (uint32_t)b;
}

/* As many as there is room for. */
static uint32_t most_of(const struct incode_front *front, uint32_t units) {
    const struct incode_front_outside *outside = &front->outside;
    const struct incode_front_peers *peers = &front->exchange.peers;
    uint32_t most = lesser(USED, units > 0 ? units : 1);
    most = lesser(most, outside->emit_room(outside->context));
    return lesser(most, peers->room(peers->context));
}

enum incode_step incode_triangulator_use(struct incode_triangulator *t,
                                         const struct incode_loan *loan,
                                         const struct incode_found *found,
                                         uint32_t *used, uint32_t units) {
    uint32_t task;
    struct incode_front *front = &t->front;
    if (incode_triangulator_fault(t) != NULL)
        return INCODE_BROKEN;
    if (*used < found->count && !incode_front_is_finished(front)) {
        enum incode_turn turn =
            incode_front_turn(front, incode_front_suspended(front), &task);
        if (turn != INCODE_TURN_NEXT)
            return turn == INCODE_TURN_WORKED ? INCODE_WORKED : INCODE_WAITING;
        uint32_t now =
            incode_front_use_found(front, found, *used, most_of(front, units));
        *used += now;
        t->spent += now;
    }
    t->spent++;
    if (incode_triangulator_fault(t) != NULL)
        return INCODE_BROKEN;
    if (*used < found->count && !incode_front_is_finished(front))
        return INCODE_WORKED;
    *used = found->count;
    incode_front_return(front, loan);
    return INCODE_FINISHED;
}
