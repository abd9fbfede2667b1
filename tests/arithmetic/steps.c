#include "steps.h"

/* Not inlined: where the parts of an expression are computed elsewhere, too, a
 * compiler might compute them once, and no longer do to the expression what it
 * does to the predicates'. */
#define APART __attribute__((noinline))

static APART double times(double a, double b) {
    return a * b;
}

static APART double minus(double a, double b) {
    return a - b;
}

static APART double plus(double a, double b) {
    return a + b;
}

static APART double cross(double a, double b, double c, double d) {
    return a * b - c * d;
}

static APART double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double tell(const struct record *record, const char *name,
                   double value) {
    record->tell(record->context, name, record_bits(value));
    return value;
}

double step_minus(struct record *record, const char *name, double a, double b) {
    return record_double(record, name, minus(a, b));
}

double step_times(struct record *record, const char *name, double a, double b) {
    return record_double(record, name, times(a, b));
}

double step_cross(struct record *record, const char *name, double a, double b,
                  double c, double d) {
    if (record->tell != NULL) {
        double p = tell(record, "its first product", times(a, b));
        double q = tell(record, "its second product", times(c, d));
        tell(record, "their difference", minus(p, q));
    }
    return record_double(record, name, cross(a, b, c, d));
}

double step_dot(struct record *record, const char *name, const double a[3],
                const double b[3]) {
    if (record->tell != NULL) {
        double p = tell(record, "its first product", times(a[0], b[0]));
        double q = tell(record, "its second product", times(a[1], b[1]));
        double r = tell(record, "its third product", times(a[2], b[2]));
        double s = tell(record, "the sum of two", plus(p, q));
        tell(record, "the sum of three", plus(s, r));
    }
    return record_double(record, name, dot(a, b));
}
