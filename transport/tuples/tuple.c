#include "tuples.h"

#include <assert.h>
#include <string.h>

#include "transport/bytes.h"

/* Byte 0: fields; 1: keyed; then a type each; then the values. */
enum { TYPES_AT = 2, FORMAL = 0x80 };

static_assert(sizeof(double) == 8, "a double as eight bytes");

/* Bytes of a value, without the length that stands before bytes. */
static size_t fixed_size(unsigned type) {
    return type == TUPLE_TYPE_BYTES                                ? 0
           : type == TUPLE_TYPE_INT64 || type == TUPLE_TYPE_DOUBLE ? 8
                                                                   : 4;
}

static void put64(uint8_t *p, uint64_t value) {
    bytes_put32(p, (uint32_t)value);
    bytes_put32(p + 4, (uint32_t)(value >> 32));
}

static uint64_t get64(const uint8_t *p) {
    return bytes_get32(p) | (uint64_t)bytes_get32(p + 4) << 32;
}

static size_t value_size(const struct tuple_field *field) {
    if (field->formal)
        return 0;
    return field->type == TUPLE_TYPE_BYTES ? 2u + field->size
                                           : fixed_size(field->type);
}

static void write_value(const struct tuple_field *field, uint8_t *p) {
    uint64_t bits;
    switch (field->type) {
    case TUPLE_TYPE_INT32:
        bytes_put32(p, (uint32_t)field->as.int32);
        break;
    case TUPLE_TYPE_UINT32:
        bytes_put32(p, field->as.uint32);
        break;
    case TUPLE_TYPE_INT64:
        put64(p, (uint64_t)field->as.int64);
        break;
    case TUPLE_TYPE_DOUBLE:
        memcpy(&bits, &field->as.real, sizeof bits);
        put64(p, bits);
        break;
    default:
        bytes_put16(p, field->size);
        if (field->size > 0)
            memcpy(p + 2, field->as.bytes, field->size);
    }
}

size_t tuple_write(const struct tuple *tuple, uint8_t *bytes, size_t room) {
    unsigned count = tuple->count;
    size_t size = TYPES_AT + (size_t)count;
    if (count == 0 || count > TUPLE_FIELDS_MAX || size > room)
        return 0;
    bytes[0] = (uint8_t)count;
    bytes[1] = tuple->keyed;
    for (unsigned i = 0; i < count; i++) {
        const struct tuple_field *field = &tuple->field[i];
        if (field->type == 0 || field->type > TUPLE_TYPE_LAST ||
            value_size(field) > room - size)
            return 0;
        bytes[TYPES_AT + i] = field->type | (field->formal ? FORMAL : 0);
        if (!field->formal)
            write_value(field, bytes + size);
        size += value_size(field);
    }
    return size;
}

/* Takes a field's value; the bytes that it took in *used.  False: there are
 * too few. */
static bool read_value(struct tuple_field *field, const uint8_t *p, size_t left,
                       size_t *used) {
    uint64_t bits;
    size_t least =
        field->type == TUPLE_TYPE_BYTES ? 2 : fixed_size(field->type);
    if (left < least)
        return false;
    switch (field->type) {
    case TUPLE_TYPE_INT32:
        field->as.int32 = (int32_t)bytes_get32(p);
        break;
    case TUPLE_TYPE_UINT32:
        field->as.uint32 = bytes_get32(p);
        break;
    case TUPLE_TYPE_INT64:
        field->as.int64 = (int64_t)get64(p);
        break;
    case TUPLE_TYPE_DOUBLE:
        bits = get64(p);
        memcpy(&field->as.real, &bits, sizeof bits);
        break;
    default:
        field->size = bytes_get16(p);
        field->as.bytes = p + 2;
    }
    *used = least + field->size;
    return *used <= left;
}

bool tuple_read(struct tuple *tuple, const uint8_t *bytes, size_t size) {
    memset(tuple, 0, sizeof *tuple);
    if (size < TYPES_AT || bytes[0] == 0 || bytes[0] > TUPLE_FIELDS_MAX ||
        bytes[1] > 1 || size < TYPES_AT + (size_t)bytes[0])
        return false;
    size_t at = TYPES_AT + (size_t)bytes[0];
    tuple->count = bytes[0];
    tuple->keyed = bytes[1];
    for (unsigned i = 0; i < tuple->count; i++) {
        struct tuple_field *field = &tuple->field[i];
        size_t used = 0;
        field->type = bytes[TYPES_AT + i] & (FORMAL - 1);
        field->formal = (bytes[TYPES_AT + i] & FORMAL) != 0;
        if (field->type == 0 || field->type > TUPLE_TYPE_LAST ||
            (!field->formal &&
             !read_value(field, bytes + at, size - at, &used)))
            return false;
        at += used;
    }
    return at == size;
}

bool tuple_has_formal(const uint8_t *bytes) {
    unsigned any = 0;
    for (unsigned i = 0; i < bytes[0]; i++)
        any |= bytes[TYPES_AT + i];
    return (any & FORMAL) != 0;
}

bool tuple_begins_formal(const uint8_t *bytes) {
    return (bytes[TYPES_AT] & FORMAL) != 0;
}

bool tuple_is_keyed(const uint8_t *bytes) {
    return bytes[1] != 0;
}

static size_t written_size(unsigned type, const uint8_t *p) {
    return type == TUPLE_TYPE_BYTES ? 2u + bytes_get16(p) : fixed_size(type);
}

bool tuple_matches(const uint8_t *pattern, const uint8_t *tuple) {
    unsigned count = tuple[0];
    size_t p = TYPES_AT + (size_t)count, t = p;
    if (pattern[0] != count)
        return false;
    for (unsigned i = 0; i < count; i++) {
        unsigned type = tuple[TYPES_AT + i], asked = pattern[TYPES_AT + i];
        size_t size = written_size(type, tuple + t);
        if ((asked & (FORMAL - 1)) != type)
            return false;
        if ((asked & FORMAL) == 0) {
            if (written_size(type, pattern + p) != size ||
                memcmp(pattern + p, tuple + t, size) != 0)
                return false;
            p += size;
        }
        t += size;
    }
    return true;
}

/* Fowler, Noll and Vo's hash 1a, and the last steps of Appleby's murmur3, so
 * that the low bits depend on all. */
static uint32_t add(uint32_t hash, const uint8_t *p, size_t size) {
    for (size_t i = 0; i < size; i++)
        hash = (hash ^ p[i]) * UINT32_C(16777619);
    return hash;
}

static uint32_t spread(uint32_t h) {
    h = (h ^ h >> 16) * UINT32_C(0x85ebca6b);
    h = (h ^ h >> 13) * UINT32_C(0xc2b2ae35);
    return h ^ h >> 16;
}

static uint32_t add_types(const uint8_t *bytes) {
    uint32_t hash = add(UINT32_C(2166136261), bytes, 1);
    for (unsigned i = 0; i < bytes[0]; i++) {
        uint8_t type = bytes[TYPES_AT + i] & (FORMAL - 1);
        hash = add(hash, &type, 1);
    }
    return hash;
}

uint32_t tuple_signature(const uint8_t *bytes) {
    return spread(add_types(bytes));
}

uint32_t tuple_key(const uint8_t *bytes) {
    const uint8_t *value = bytes + TYPES_AT + bytes[0];
    size_t size = written_size(bytes[TYPES_AT], value);
    return spread(add(add_types(bytes), value, size));
}
