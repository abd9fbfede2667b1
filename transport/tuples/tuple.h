/* Tuples and templates: fields of a type each, with a value (an actual) or, in
 * a template, without one (a formal).  As bytes they are what lies in the store
 * and goes in messages: number of fields, whether keyed, the types, and the
 * values one behind the other; TUPLES.md has the layout.
 *
 * A template matches a tuple that has as many fields, of the same types one by
 * one, and the values of its actuals.  Values are compared as bytes: a double
 * that is not a number matches itself, and -0 does not match 0.
 *
 * Memory: none of its own; fields of bytes stay where they lie.  Work: a pass
 * over the bytes.
 *
 *     struct tuple job = {.count = 2, .field = {TUPLE_UINT32(7)}};
 *     job.field[1] = TUPLE_BYTES(faces, 360);
 *     size_t size = tuple_write(&job, bytes, sizeof bytes); // 0: it is unfit
 */
#ifndef TRANSPORT_TUPLES_TUPLE_H
#define TRANSPORT_TUPLES_TUPLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { TUPLE_FIELDS_MAX = 8 };

enum tuple_type {
    TUPLE_TYPE_INT32 = 1,
    TUPLE_TYPE_UINT32,
    TUPLE_TYPE_INT64,
    TUPLE_TYPE_DOUBLE,
    TUPLE_TYPE_BYTES, /* any number of them: the length is part of the value */
    TUPLE_TYPE_LAST = TUPLE_TYPE_BYTES
};

struct tuple_field {
    uint8_t type;  /* enum tuple_type */
    bool formal;   /* without a value: in templates alone */
    uint16_t size; /* of bytes */
    union {
        int32_t int32;
        uint32_t uint32;
        int64_t int64;
        double real;
        const void *bytes; /* of any alignment; NULL where size is 0 */
    } as;
};

struct tuple {
    uint8_t count; /* fields, 1 .. TUPLE_FIELDS_MAX */
    bool keyed;    /* of a tuple: the first field's value says too where it
                      lives; of a template it means nothing */
    struct tuple_field field[TUPLE_FIELDS_MAX];
};

/* Fields, as initialisers within braces or behind (struct tuple_field). */
#define TUPLE_FIELD(kind, name, value)                                         \
    (struct tuple_field) {                                                     \
        .type = (kind), .as.name = (value)                                     \
    }
#define TUPLE_INT32(value) TUPLE_FIELD(TUPLE_TYPE_INT32, int32, value)
#define TUPLE_UINT32(value) TUPLE_FIELD(TUPLE_TYPE_UINT32, uint32, value)
#define TUPLE_INT64(value) TUPLE_FIELD(TUPLE_TYPE_INT64, int64, value)
#define TUPLE_DOUBLE(value) TUPLE_FIELD(TUPLE_TYPE_DOUBLE, real, value)
#define TUPLE_BYTES(at, length)                                                \
    (struct tuple_field) {                                                     \
        .type = TUPLE_TYPE_BYTES, .size = (uint16_t)(length), .as.bytes = (at) \
    }
#define TUPLE_FORMAL(kind)                                                     \
    (struct tuple_field) {                                                     \
        .type = (kind), .formal = true                                         \
    }

/* Writes it in at most `room` bytes, and returns how many; 0: it does not fit
 * them, has no field or too many, or one of an unknown type. */
size_t tuple_write(const struct tuple *tuple, uint8_t *bytes, size_t room);

/* Reads what tuple_write wrote, and nothing else: false.  Its fields of bytes
 * lie in `bytes`. */
bool tuple_read(struct tuple *tuple, const uint8_t *bytes, size_t size);

/* Of what tuple_read takes: whether a field is formal, or the first; whether
 * it is keyed. */
bool tuple_has_formal(const uint8_t *bytes);
bool tuple_begins_formal(const uint8_t *bytes);
bool tuple_is_keyed(const uint8_t *bytes);

/* Whether the template matches the tuple, both of what tuple_read takes. */
bool tuple_matches(const uint8_t *pattern, const uint8_t *tuple);

/* Number and types of its fields as a number that is spread evenly; and the
 * first field's value with them, which must be an actual. */
uint32_t tuple_signature(const uint8_t *bytes);
uint32_t tuple_key(const uint8_t *bytes);

#endif
