/* Results in their order, folded into 64 bits, and told one by one to whoever
 * asks.
 *
 * Each word is mixed in by steps that can be undone, so that two lists of which
 * one word differs have different digests for certain, and others but for one
 * in 2^64: what is compared here is not forged but computed.  That takes 15
 * operations a word on a processor of 32 bits, where SHA-256 takes some 400.
 */
#ifndef TESTS_ARITHMETIC_RECORD_H
#define TESTS_ARITHMETIC_RECORD_H

#include <stdint.h>
#include <string.h>

struct record {
    uint64_t digest;
    /* Where not NULL: is told each result and the operation's name. */
    void (*tell)(void *context, const char *name, uint64_t bits);
    void *context;
};

static inline struct record record_begin(void) {
    return (struct record){UINT64_C(0x243f6a8885a308d3), NULL, NULL};
}

static inline uint64_t record_fold(uint64_t digest, uint64_t bits) {
    digest = (digest ^ bits) * UINT64_C(0x9e3779b97f4a7c15);
    return digest ^ digest >> 32;
}

static inline uint64_t record_word(struct record *record, const char *name,
                                   uint64_t bits) {
    record->digest = record_fold(record->digest, bits);
    if (record->tell != NULL)
        record->tell(record->context, name, bits);
    return bits;
}

/* What is not a number has no sign that processors would agree on. */
static inline uint64_t record_bits(double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits << 1 > UINT64_C(0x7ff) << 53 ? UINT64_C(0x7ff8) << 48 : bits;
}

static inline double record_double(struct record *record, const char *name,
                                   double value) {
    record_word(record, name, record_bits(value));
    return value;
}

static inline float record_float(struct record *record, const char *name,
                                 float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    bits = bits << 1 > 0x7f800000u << 1 ? 0x7fc00000u : bits;
    record_word(record, name, bits);
    return value;
}

#endif
