/* Operations on doubles whose results are recorded.  What the predicates write
 * as one expression is one here, so that a compiler that fuses a product into a
 * sum, or keeps a longer number between them, is found; its parts are told
 * beside it where somebody listens, each computed alone. */
#ifndef TESTS_ARITHMETIC_STEPS_H
#define TESTS_ARITHMETIC_STEPS_H

#include "record.h"

/* a - b */
double step_minus(struct record *record, const char *name, double a, double b);

/* a b - c d */
double step_cross(struct record *record, const char *name, double a, double b,
                  double c, double d);

/* a b + c d + e f */
double step_dot(struct record *record, const char *name, const double a[3],
                const double b[3]);

/* a b */
double step_times(struct record *record, const char *name, double a, double b);

#endif
