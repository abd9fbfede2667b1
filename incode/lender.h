/* A triangulator that lends stars (front/loan.h), and uses what was found
 * there between its own steps.
 *
 * Memory: none.  Work: a call uses 32 tetrahedra at most.
 *
 *     if (incode_triangulator_lend(t, &loan))
 *         send(&loan, incode_loan_bytes(&loan));
 *     while (incode_triangulator_use(t, &loan, &found, &used, 100) ==
 *            INCODE_WORKED)
 *         ;   // WAITING: the triangulator's own step goes before
 */
#ifndef INCODE_LENDER_H
#define INCODE_LENDER_H

#include "incode/front/loan.h"
#include "triangulator.h"

/* As incode_front_lend_run. */
bool incode_triangulator_lend(struct incode_triangulator *t,
                              struct incode_loan *loan);

/* Uses what was found from *used on, sound, about so many units, 1 at least.
 * INCODE_WORKED: call again; INCODE_WAITING: there is no room for it before its
 * own steps have made some; INCODE_FINISHED: all of it is used, the loan is
 * over; INCODE_BROKEN. */
enum incode_step incode_triangulator_use(struct incode_triangulator *t,
                                         const struct incode_loan *loan,
                                         const struct incode_found *found,
                                         uint32_t *used, uint32_t units);

#endif
