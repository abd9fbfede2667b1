/* The four functions that a compiler takes for granted, by whole words where
 * both ends allow.  Compiled without the compiler's recognition of loops, which
 * would make calls of these in themselves. */
#include <stddef.h>
#include <stdint.h>

void *memcpy(void *to, const void *from, size_t size);
void *memmove(void *to, const void *from, size_t size);
void *memset(void *to, int value, size_t size);
int memcmp(const void *a, const void *b, size_t size);

typedef uintptr_t __attribute__((may_alias)) word;
struct loose {
    word word;
} __attribute__((packed, may_alias));
enum { WORD = sizeof(word) };

static int aligned_alike(const void *a, const void *b) {
    return (((uintptr_t)a ^ (uintptr_t)b) % WORD) == 0;
}

/* By words that are whole at `to`; those at `from` need not be, as processors
 * load them all the same, or the compiler puts them together. */
static void forwards(uint8_t *to, const uint8_t *from, size_t size) {
    for (; size > 0 && (uintptr_t)to % WORD != 0; size--)
        *to++ = *from++;
    for (; size >= 4 * WORD; size -= 4 * WORD) {
        word *w = (void *)to;
        const struct loose *v = (const void *)from;
        word a = v[0].word, b = v[1].word, c = v[2].word, d = v[3].word;
        w[0] = a, w[1] = b, w[2] = c, w[3] = d;
        to += 4 * WORD;
        from += 4 * WORD;
    }
    for (; size >= WORD; size -= WORD) {
        *(word *)(void *)to = ((const struct loose *)(const void *)from)->word;
        to += WORD;
        from += WORD;
    }
    for (; size > 0; size--)
        *to++ = *from++;
}

static void backwards(uint8_t *to, const uint8_t *from, size_t size) {
    to += size;
    from += size;
    if (aligned_alike(to, from)) {
        for (; size > 0 && (uintptr_t)to % WORD != 0; size--)
            *--to = *--from;
        for (; size >= WORD; size -= WORD) {
            to -= WORD;
            from -= WORD;
            *(word *)(void *)to = *(const word *)(const void *)from;
        }
    }
    for (; size > 0; size--)
        *--to = *--from;
}

void *memcpy(void *to, const void *from, size_t size) {
    forwards(to, from, size);
    return to;
}

void *memmove(void *to, const void *from, size_t size) {
    if ((uintptr_t)to - (uintptr_t)from < size)
        backwards(to, from, size);
    else
        forwards(to, from, size);
    return to;
}

void *memset(void *to, int value, size_t size) {
    uint8_t *p = to;
    word all = (word)-1 / 255 * (uint8_t)value;
    for (; size > 0 && (uintptr_t)p % WORD != 0; size--)
        *p++ = (uint8_t)value;
    for (; size >= 4 * WORD; size -= 4 * WORD) {
        word *w = (void *)p;
        w[0] = all, w[1] = all, w[2] = all, w[3] = all;
        p += 4 * WORD;
    }
    for (; size >= WORD; size -= WORD) {
        *(word *)(void *)p = all;
        p += WORD;
    }
    for (; size > 0; size--)
        *p++ = (uint8_t)value;
    return to;
}

int memcmp(const void *a, const void *b, size_t size) {
    const uint8_t *p = a, *q = b;
    if (aligned_alike(a, b)) {
        for (; size >= WORD && (uintptr_t)p % WORD == 0 &&
               *(const word *)(const void *)p == *(const word *)(const void *)q;
             size -= WORD) {
            p += WORD;
            q += WORD;
        }
    }
    for (; size > 0; size--, p++, q++)
        if (*p != *q)
            return *p - *q;
    return 0;
}
