/* Work that moves while the nodes of an exchange run: who has nothing to do
 * asks the others, one after another, his neighbours first; who has many ready
 * vertices lends a run of them to one that has asked (incode/front/loan.h), and
 * uses what comes back.
 *
 * A node asks each other node once, and again when it has been lent something
 * and is through with it, so that asks are as few as nodes and loans.  An ask
 * stays with who is asked until it can be met; nobody waits for it, nothing is
 * repeated by time, and no node is awake for it.  A loan that comes when there
 * is no place for it, as others came first, goes back as it was.
 *
 * The lender is not quiet (waves.h) while a loan is out, and the borrower tells
 * nothing to others, so loans are not counted for the end.  A lender waits for
 * a borrower at most, a borrower for pages alone: there is no circle.
 *
 * Memory: the struct, about 12 KB, with a place for each loan that may be out
 * and what comes back of it, NODE_LOANS_OUT, and for those that are borrowed,
 * NODE_LOANS_IN; and node_loans_bytes of the role's arena, a bit a node for who
 * has asked, who is asked, and whose loan goes back.  Work: a call looks at the
 * places, and at the bits if one is to be found.
 *
 *     node_loans_init(&loans, memory, &setup, &counted, &fault);
 *     worked = node_loans_use(&loans, t, units) || own_work() ||
 *              node_loans_help(&loans, t, units);
 *     sent = node_loans_send(&loans, t);   // and so in every step
 */
#ifndef NODE_LOANS_H
#define NODE_LOANS_H

#include <stdbool.h>

#include "incode/borrower.h"
#include "incode/lender.h"
#include "node/counted.h"
#include "node/fault.h"
#include "node/message.h"

enum { NODE_LOANS_OUT = 4, NODE_LOANS_IN = 2 };

struct node_loans {
    struct node_counted *counted;
    struct node_fault *fault;
    uint32_t nodes, bricks;
    struct node_loan_out {
        enum node_loan_state {
            NODE_LOAN_IS_FREE,
            NODE_LOAN_IS_MADE, /* it is to be sent */
            NODE_LOAN_IS_OUT,
            NODE_LOAN_IS_BACK /* its answers have come, and is being used */
        } state;
        uint16_t to;
        uint32_t used;
        struct incode_loan loan;
        struct incode_found found;
    } out[NODE_LOANS_OUT];
    struct node_loan_in {
        bool open;
        uint16_t from;
        uint64_t born;
        struct incode_loan loan;
    } in[NODE_LOANS_IN];
    struct node_loan_in *at_work; /* the oldest of them, or NULL */
    struct incode_borrower borrower;
    /* A bit a node. */
    uint64_t *askers; /* have asked this one, */
    uint64_t *asked;  /* or are asked by it, */
    uint64_t *back;   /* or have their loan back at once */
    uint32_t askers_count, asked_count, back_count;
    uint64_t clock, stars, bytes_in, bytes_out;
};

size_t node_loans_bytes(uint32_t nodes);

/* memory: aligned to NODE_ALIGNMENT, node_loans_bytes.  counted and fault stay.
 */
void node_loans_init(struct node_loans *loans, void *memory,
                     const struct node_setup_message *setup,
                     struct node_counted *counted, struct node_fault *fault);

/* NODE_LOAN_ASK, NODE_LOAN or NODE_LOAN_FOUND. */
void node_loans_take(struct node_loans *loans,
                     const struct cube_message *message);

/* The borrower whose loan `use` goes on with: it found what `use` emits. */
uint16_t node_loans_finder(const struct node_loans *loans);

/* A step with what came back, or with what is borrowed, of about so many units;
 * false: there is nothing to do. */
bool node_loans_use(struct node_loans *loans, struct incode_triangulator *t,
                    uint32_t units);
bool node_loans_help(struct node_loans *loans, struct incode_triangulator *t,
                     uint32_t units);

/* Lends, gives back and asks, as far as the links take it; the number of
 * messages. */
unsigned node_loans_send(struct node_loans *loans,
                         struct incode_triangulator *t);

/* A node that has a loan of this one; CUBE_HOST: none has. */
uint16_t node_loans_owing(const struct node_loans *loans);

#endif
