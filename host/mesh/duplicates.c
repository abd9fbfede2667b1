#include "duplicates.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"

enum {
    AHEAD = 16, /* rows hashed ahead, so that their slots come from memory */
    FORK_ROWS = 1 << 13,   /* fewer rows are not worth a thread: to search, */
    COPY_ROWS = 1 << 17,   /* to copy */
    POLL_ROWS = 1 << 12,   /* between two polls of whether it is cancelled */
    FETCH_ROWS = 1 << 10,  /* a power of two */
    POLL_COPIED = 1 << 11, /* the same, of copies */
    AROUND = 1 << 16,      /* bytes that one row far from others touches */
    ENTRIES_MIN = 16,      /* that go to a bucket at a time */
    ENTRIES_MAX = 1 << 12,
    PARTS_MAX = 16
};

/* A table for each thread, which takes parts of the hash values in turn, so
 * that threads share nothing. */
struct table {
    uint64_t *slot; /* upper hash bits and row + 1; 0: empty */
    size_t slots;   /* a power of two */
};

/* Rows of some hash values, of one thread's share. */
struct bucket {
    uint64_t next;  /* place of its next entry; when all are there, its end */
    uint64_t count; /* entries that wait */
};

struct search {
    const double *xyz;
    uint64_t rows;
    unsigned parts;  /* threads */
    unsigned rounds; /* parts of the hash values for each */
    struct table table[PARTS_MAX];
    /* Where the tables of all rows do not fit. */
    struct bucket *bucket; /* [rounds * parts][parts] */
    uint64_t *entry;   /* [rows] by buckets: half of the hash, and the row */
    uint64_t *waiting; /* [rounds * parts][parts][each] entries */
    size_t each;
    uint32_t *lowest; /* [rows], or NULL */
    uint8_t *doubled; /* [rows] 1 where an earlier row is equal, or NULL */
    uint64_t distinct[PARTS_MAX];
    struct host_item *items;
    uint64_t first[PARTS_MAX + 1];
    uint64_t negative_zeros[PARTS_MAX];
    double lo[PARTS_MAX][3], hi[PARTS_MAX][3];
};

static uint64_t bits_of(double c) {
    uint64_t bits;
    c += 0.0; /* -0.0 becomes 0.0 */
    memcpy(&bits, &c, sizeof bits);
    return bits;
}

static uint64_t hash(const double *p) {
    uint64_t h = bits_of(p[0]) * UINT64_C(0x9e3779b97f4a7c15);
    h = ((h ^ (h >> 32)) + bits_of(p[1])) * UINT64_C(0xbf58476d1ce4e5b9);
    h = ((h ^ (h >> 29)) + bits_of(p[2])) * UINT64_C(0x94d049bb133111eb);
    return h ^ (h >> 32);
}

static bool same(const double *p, const double *q) {
    return p[0] == q[0] && p[1] == q[1] && p[2] == q[2];
}

/* Enters a row, or finds the equal one that was there before. */
static uint32_t enter(const struct search *s, struct table *table, uint64_t h,
                      uint32_t row) {
    size_t mask = table->slots - 1, at = (size_t)h & mask;
    uint64_t mark = h & UINT64_C(0xffffffff00000000);
    for (; table->slot[at] != 0; at = (at + 1) & mask) {
        uint64_t slot = table->slot[at];
        if ((slot & UINT64_C(0xffffffff00000000)) == mark) {
            uint32_t other = (uint32_t)slot - 1;
            host_call_trim(AROUND);
            if (same(s->xyz + 3 * (size_t)other, s->xyz + 3 * (size_t)row))
                return other;
        }
    }
    table->slot[at] = mark | (row + 1); /* rows are below 2^32 - 1 */
    return row;
}

/* What is known of a row and the one it is equal to. */
static void note(struct search *s, uint32_t mine, uint32_t other) {
    if (s->lowest != NULL)
        s->lowest[mine] = other;
    if (s->doubled != NULL && other != mine)
        s->doubled[mine] = 1;
}

static unsigned part_of(const struct search *s, uint64_t h) {
    return (unsigned)((h >> 40) * s->parts * s->rounds >> 24);
}

/* Rows whose hash belongs to the part, in input order: so the first of equal
 * rows is the lowest. */
static void search_rows(struct search *s, unsigned part) {
    struct table *table = &s->table[part];
    uint64_t waiting[AHEAD];
    uint32_t waiting_row[AHEAD];
    uint64_t queued = 0, taken = 0;
    for (uint64_t row = 0; row < s->rows || taken < queued;) {
        if (row < s->rows && queued - taken < AHEAD) {
            uint64_t h = hash(s->xyz + 3 * row);
            if (part_of(s, h) == part) {
                waiting[queued % AHEAD] = h;
                waiting_row[queued % AHEAD] = (uint32_t)row;
                __builtin_prefetch(&table->slot[h & (table->slots - 1)], 1);
                queued++;
            }
            row++;
            if (row % POLL_ROWS == 0) {
                host_call_trim(POLL_ROWS * (3 * sizeof *s->xyz + 1));
                if (host_call_cancelled())
                    break;
            }
            continue;
        }
        uint32_t mine = waiting_row[taken % AHEAD];
        uint32_t other = enter(s, table, waiting[taken % AHEAD], mine);
        taken++;
        s->distinct[part] += other == mine;
        note(s, mine, other);
        if (s->lowest != NULL && taken % FETCH_ROWS == 0)
            host_call_trim(FETCH_ROWS * s->parts * sizeof *s->lowest);
    }
}

static void search_part(void *context, unsigned part) {
    search_rows(context, part);
}

/* --- Where the tables of all rows do not fit ------------------------------ */

/* The rows go to buckets by their hash first, each in input order: an entry has
 * half of the hash and the row.  Then threads search bucket after bucket. */

static uint64_t part_start(const struct search *s, unsigned part) {
    return s->rows / s->parts * part +
           (part == s->parts ? s->rows % s->parts : 0);
}

/* Calls put for each row of the thread's share. */
static void hash_rows(struct search *s, unsigned part,
                      void (*put)(struct search *s, unsigned part,
                                  unsigned bucket, uint64_t entry)) {
    double block[FETCH_ROWS][3];
    uint64_t last = part_start(s, part + 1);
    for (uint64_t row = part_start(s, part); row < last;) {
        size_t n = last - row < FETCH_ROWS ? (size_t)(last - row) : FETCH_ROWS;
        host_fetch(block, s->xyz + 3 * row, n * sizeof *block);
        for (size_t i = 0; i < n; i++, row++) {
            uint64_t h = hash(block[i]);
            put(s, part, part_of(s, h), h << 32 | row);
        }
        if (host_call_cancelled())
            return;
    }
}

static struct bucket *bucket_of(const struct search *s, unsigned bucket,
                                unsigned part) {
    return &s->bucket[(size_t)bucket * s->parts + part];
}

static void count_entry(struct search *s, unsigned part, unsigned bucket,
                        uint64_t entry) {
    (void)entry;
    bucket_of(s, bucket, part)->next++;
}

static void count_entries(void *context, unsigned part) {
    hash_rows(context, part, count_entry);
}

static void flush(struct bucket *b, struct search *s) {
    const uint64_t *waiting = s->waiting + (size_t)(b - s->bucket) * s->each;
    host_store(s->entry + b->next, waiting, b->count * sizeof *s->entry);
    b->next += b->count;
    b->count = 0;
}

static void place_entry(struct search *s, unsigned part, unsigned bucket,
                        uint64_t entry) {
    struct bucket *b = bucket_of(s, bucket, part);
    s->waiting[(size_t)(b - s->bucket) * s->each + b->count++] = entry;
    if (b->count == s->each)
        flush(b, s);
}

static void place_entries(void *context, unsigned part) {
    struct search *s = context;
    hash_rows(s, part, place_entry);
    for (unsigned i = 0; i < s->parts * s->rounds; i++)
        flush(bucket_of(s, i, part), s);
}

static void search_bucket(struct search *s, unsigned part, unsigned bucket) {
    struct table *table = &s->table[part];
    uint64_t block[FETCH_ROWS];
    uint64_t at =
        bucket == 0 ? 0 : bucket_of(s, bucket - 1, s->parts - 1)->next;
    uint64_t last = bucket_of(s, bucket, s->parts - 1)->next;
    memset(table->slot, 0, table->slots * sizeof *table->slot);
    while (at < last && !host_call_cancelled()) {
        size_t n = last - at < FETCH_ROWS ? (size_t)(last - at) : FETCH_ROWS;
        host_fetch(block, s->entry + at, n * sizeof *block);
        for (size_t i = 0; i < n; i++) {
            uint32_t mine = (uint32_t)block[i],
                     half = (uint32_t)(block[i] >> 32);
            uint32_t other = enter(s, table, (uint64_t)half << 32 | half, mine);
            s->distinct[part] += other == mine;
            note(s, mine, other);
        }
        at += n;
        host_call_trim(n * s->parts * s->rounds *
                       (s->lowest != NULL ? sizeof *s->lowest : 1));
    }
}

static void search_buckets(void *context, unsigned part) {
    struct search *s = context;
    for (unsigned i = 0; i < s->rounds && !host_call_cancelled(); i++)
        search_bucket(s, part, part * s->rounds + i);
}

/* False: there is no memory. */
static bool search_by_buckets(struct search *s) {
    size_t buckets = (size_t)s->parts * s->parts * s->rounds;
    size_t each = host_call_share() / 2 / (buckets * sizeof *s->waiting);
    s->each = each < ENTRIES_MIN   ? ENTRIES_MIN
              : each > ENTRIES_MAX ? ENTRIES_MAX
                                   : each;
    s->bucket = host_map_resident(buckets * sizeof *s->bucket);
    s->waiting = host_map_resident(buckets * s->each * sizeof *s->waiting);
    s->entry = host_map((size_t)s->rows * sizeof *s->entry);
    bool enough = s->bucket != NULL && s->waiting != NULL && s->entry != NULL;
    if (enough) {
        uint64_t before = 0;
        host_fork_all(s->parts, count_entries, s);
        for (size_t i = 0; i < buckets; i++) {
            uint64_t count = s->bucket[i].next;
            s->bucket[i].next = before;
            before += count;
        }
        if (!host_call_cancelled())
            host_fork_all(s->parts, place_entries, s);
    }
    host_unmap(s->waiting, buckets * s->each * sizeof *s->waiting);
    if (enough && !host_call_cancelled())
        host_fork_all(s->parts, search_buckets, s);
    host_unmap(s->bucket, buckets * sizeof *s->bucket);
    host_unmap(s->entry, (size_t)s->rows * sizeof *s->entry);
    return enough;
}

static bool run_search(struct search *s) {
    unsigned threads = host_threads();
    s->parts = s->rows < FORK_ROWS   ? 1
               : threads > PARTS_MAX ? PARTS_MAX
                                     : threads;
    size_t most = host_call_share() / sizeof(uint64_t), slots = 64;
    while (slots < s->rows / s->parts * 3 / 2 + 64 && slots <= most / 2)
        slots *= 2;
    s->rounds = 1;
    while (slots < s->rows / s->parts / s->rounds * 3 / 2 + 64)
        s->rounds++;
    bool enough = true;
    for (unsigned i = 0; i < s->parts; i++) {
        s->table[i].slots = slots;
        s->table[i].slot = host_map_resident(slots * sizeof(uint64_t));
        enough = enough && s->table[i].slot != NULL;
    }
    if (enough && s->rounds > 1)
        enough = search_by_buckets(s);
    else if (enough)
        host_fork_all(s->parts, search_part, s);
    for (unsigned i = 0; i < s->parts; i++)
        host_unmap(s->table[i].slot, slots * sizeof(uint64_t));
    return enough;
}

/* --- Records -------------------------------------------------------------- */

static void count_part(void *context, unsigned part) {
    struct search *s = context;
    uint64_t count = 0, last = part_start(s, part + 1);
    for (uint64_t row = part_start(s, part); row < last; row++) {
        if (row % POLL_ROWS == 0)
            host_call_trim(POLL_ROWS);
        count += s->doubled[row] == 0;
    }
    s->first[part + 1] = count;
}

static void fill_part(void *context, unsigned part) {
    struct search *s = context;
    struct host_item *to = s->items + s->first[part];
    uint64_t negative_zeros = 0;
    uint64_t last = part_start(s, part + 1);
    for (uint64_t row = part_start(s, part); row < last; row++) {
        const double *p = s->xyz + 3 * row;
        if (row % POLL_COPIED == 0)
            host_call_trim(POLL_COPIED * (3 * sizeof *p + sizeof *to));
        for (int d = 0; d < 3; d++)
            negative_zeros += p[d] == 0.0 && signbit(p[d]);
        if (s->doubled[row] == 0) {
            *to++ =
                (struct host_item){{p[0] + 0.0, p[1] + 0.0, p[2] + 0.0}, row};
        }
    }
    s->negative_zeros[part] = negative_zeros;
    size_t count = (size_t)(s->first[part + 1] - s->first[part]);
    host_kd_box(to - count, count, s->lo[part], s->hi[part]);
}

static void fill_items(struct search *s, struct host_distinct *distinct) {
    s->items = distinct->items;
    s->parts = s->rows < COPY_ROWS ? 1 : s->parts;
    host_fork_all(s->parts, count_part, s);
    for (unsigned i = 0; i < s->parts; i++)
        s->first[i + 1] += s->first[i];
    host_fork_all(s->parts, fill_part, s);
    for (unsigned i = 0; i < s->parts; i++)
        distinct->negative_zeros += s->negative_zeros[i];
    for (int d = 0; d < 3; d++) {
        distinct->lo[d] = INFINITY;
        distinct->hi[d] = -INFINITY;
        for (unsigned i = 0; i < s->parts; i++) {
            distinct->lo[d] = fmin(distinct->lo[d], s->lo[i][d]);
            distinct->hi[d] = fmax(distinct->hi[d], s->hi[i][d]);
        }
    }
}

int host_distinct_make(struct host_distinct *distinct, const double *xyz,
                       uint64_t rows, struct host_error *error) {
    *distinct = (struct host_distinct){0};
    if (rows >= UINT32_MAX) {
        return host_fail(error, HOST_INPUT,
                         "host: %llu points are more than row numbers of 32 "
                         "bits allow; split the input",
                         (unsigned long long)rows);
    }
    struct search s = {.xyz = xyz, .rows = rows};
    s.doubled = host_map((size_t)rows);
    if (s.doubled == NULL || !run_search(&s)) {
        host_unmap(s.doubled, (size_t)rows);
        return host_fail_memory(error, "the search for duplicates");
    }
    if (host_call_cancelled()) {
        host_unmap(s.doubled, (size_t)rows);
        return host_fail(error, HOST_BROKEN, "host: cancelled");
    }
    for (unsigned i = 0; i < s.parts; i++)
        distinct->count += (size_t)s.distinct[i];
    distinct->capacity = distinct->count;
    distinct->items = host_map(distinct->capacity * sizeof *distinct->items);
    if (distinct->items == NULL)
        host_fail_memory(error, "the points");
    else
        fill_items(&s, distinct);
    host_unmap(s.doubled, (size_t)rows);
    return error->code;
}

void host_distinct_free(struct host_distinct *distinct) {
    host_unmap(distinct->items, distinct->capacity * sizeof *distinct->items);
    *distinct = (struct host_distinct){0};
}

uint64_t host_distinct_rows(
    const double *xyz, uint64_t rows,
    /* The threads write it.  NOLINTNEXTLINE(readability-non-const-parameter) */
    uint32_t *lowest) {
    struct search s = {.xyz = xyz, .rows = rows, .lowest = lowest};
    uint64_t distinct = 0;
    if (run_search(&s))
        for (unsigned i = 0; i < s.parts; i++)
            distinct += s.distinct[i];
    return distinct;
}
