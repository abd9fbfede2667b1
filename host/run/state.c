#include "state.h"

#include <errno.h>
#include <inttypes.h>
#include <nettle/sha2.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "host/base/create.h"
#include "host/base/journal.h"
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/base/progress.h"
#include "host/formats/output.h"
#include "host/formats/write.h"
#include "host/library/delaunay.h"
#include "host/service/kept.h"
#include "node/version.h"
#include "transport/frame.h"

enum {
    COPY = 4096, /* bytes of each of the two copies of `state`: a block */
    VALUE = 72,
    KEPT_A_THREAD = 4,        /* regions, */
    KEPT_POINTS_MIN = 100000, /* of so many points or more */
    REGION = 16               /* kind of records; and more: of a seam, by level
                               */
};

/* The lines of `state`. */
enum field {
    FORMAT,
    VERSION,
    POINTS,
    INPUT,
    WAY,
    STRATEGY,
    NODES,
    PARTITION,
    INDEX,
    REGIONS, /* that the order was made for */
    JOINED,  /* and whether they are one now */
    KEY,
    FOLDER, /* whether the run has made it */
    FIELDS
};

static const struct {
    const char *name;
    const char *what; /* in messages; NULL: it need not be the same */
    int code;
} fields[FIELDS] = {{"incode-state", "the format", HOST_INPUT},
                    {"version", "the version", HOST_INPUT},
                    {"points", "points:", HOST_INPUT},
                    {"input", "the points' digest", HOST_INPUT},
                    {"on", "a run on", HOST_USAGE},
                    {"strategy", "--strategy", HOST_USAGE},
                    {"nodes", "--nodes", HOST_USAGE},
                    {"partition", "--partition", HOST_USAGE},
                    {"index", "--index", HOST_USAGE},
                    {"regions", NULL, 0},
                    {"joined", NULL, 0},
                    {"key", NULL, 0},
                    {"folder", NULL, 0}};

struct values {
    char of[FIELDS][VALUE]; /* empty: not known yet */
};

struct host_state {
    int folder;
    char path[3][HOST_PATH_MAX + 16]; /* of state, order and spool */
    const char *directory;
    bool is_quiet, is_new; /* new: nothing of an earlier run is used */
    struct values values;
    struct host_journal spool;
    struct host_direct_store store;
    struct host_kept kept;
    uint64_t key;
    uint32_t bricks;
    _Atomic uint32_t resumed; /* bricks of threads */
    _Atomic unsigned unsound; /* records of regions that are damaged */
    /* The order, while another thread writes it. */
    const struct host_order *order;
    struct host_fork fork;
    bool is_writing;
    struct host_error order_error;
};

static const char *const names[] = {"state", "order", "spool"};
enum { STATE_FILE, ORDER_FILE, SPOOL_FILE, FILES };

/* --- the file `state` ----------------------------------------------------- */

static void set(struct values *v, enum field field, const char *text) {
    (void)snprintf(v->of[field], VALUE, "%s", text);
}

static void set_number(struct values *v, enum field field, uint64_t number) {
    (void)snprintf(v->of[field], VALUE, "%" PRIu64, number);
}

static uint64_t number_of(const struct values *v, enum field field) {
    return strtoull(v->of[field], NULL, field == KEY ? 16 : 10);
}

static void print_values(const struct values *v, char copy[COPY]) {
    size_t used = 0;
    memset(copy, 0, COPY);
    for (int i = 0; i < FIELDS; i++)
        used += (size_t)snprintf(copy + used, COPY - used, "%s %s\n",
                                 fields[i].name, v->of[i]);
    (void)snprintf(copy + used, COPY - used, "crc %08x\n",
                   frame_crc32c(0, copy, used));
}

/* False: the copy is damaged. */
static bool scan_values(struct values *v, const char copy[COPY]) {
    char text[COPY], *next = text, *line;
    const char *crc = memmem(copy, COPY, "\ncrc ", 5);
    if (crc == NULL || copy[COPY - 1] != '\0' ||
        strtoul(crc + 5, NULL, 16) !=
            frame_crc32c(0, copy, (size_t)(crc + 1 - copy)))
        return false;
    memcpy(text, copy, COPY);
    text[crc - copy] = '\0';
    for (int i = 0; (line = strsep(&next, "\n")) != NULL && i < FIELDS; i++) {
        const char *value = strchr(line, ' ');
        set(v, (enum field)i, value == NULL ? "" : value + 1);
    }
    return true;
}

static int cannot(const struct host_state *s, int file, int reason,
                  struct host_error *error) {
    return host_fail(error, HOST_INPUT,
                     "%s: cannot be written (%s); %s, and give the same "
                     "command again",
                     s->path[file], strerror(reason),
                     reason == ENOSPC || reason == EDQUOT || reason == EFBIG
                         ? "make room"
                         : "give another folder");
}

/* A file that is on the disk gets its name. */
static int give_name(struct host_state *s, const char *from, int file,
                     struct host_error *error) {
    return renameat(s->folder, from, s->folder, names[file]) == 0 &&
                   (fsync(s->folder) == 0 || errno == EINVAL)
               ? 0
               : cannot(s, file, errno, error);
}

static int write_values(struct host_state *s, struct host_error *error) {
    char both[2][COPY];
    print_values(&s->values, both[0]);
    print_values(&s->values, both[1]);
    int file =
        host_folder_file(s->folder, "state.new", O_WRONLY | O_CREAT | O_TRUNC);
    if (file < 0)
        return cannot(s, STATE_FILE, errno, error);
    size_t done = 0;
    int reason = 0;
    while (done < sizeof both && reason == 0) {
        ssize_t n = write(file, both[0] + done, sizeof both - done);
        done += n > 0 ? (size_t)n : 0;
        reason = n == 0 ? ENOSPC : n < 0 && errno != EINTR ? errno : 0;
    }
    if (reason == 0 && fsync(file) != 0 && errno != EINVAL)
        reason = errno;
    (void)close(file);
    return reason != 0 ? cannot(s, STATE_FILE, reason, error)
                       : give_name(s, "state.new", STATE_FILE, error);
}

static bool exists(const struct host_state *s, int file) {
    return faccessat(s->folder, names[file], F_OK, AT_SYMLINK_NOFOLLOW) == 0;
}

static int not_a_state(const struct host_state *s, int file,
                       struct host_error *error) {
    return host_fail(error, HOST_INPUT,
                     "%s: was not made by incode run --resume; give another "
                     "folder, or remove it",
                     s->path[file]);
}

/* Whether a damaged copy was one, or is what a loss of power may leave. */
static bool is_ours(const char copy[COPY]) {
    static const char zeros[COPY];
    return memcmp(copy, fields[FORMAT].name, strlen(fields[FORMAT].name)) ==
               0 ||
           memcmp(copy, zeros, COPY) == 0;
}

static bool is_journal(const struct host_state *s, int file) {
    return !exists(s, file) || host_journal_is(s->folder, names[file]);
}

/* The earlier run's values; is_new where there are none: then the other files
 * have to be journals, too. */
static int read_values(struct host_state *s, struct values *v,
                       struct host_error *error) {
    char both[2][COPY] = {{0}};
    bool is_there = exists(s, STATE_FILE);
    s->is_new = true;
    if (is_there) {
        int file = host_folder_file(s->folder, names[STATE_FILE], O_RDONLY);
        ssize_t n = file < 0 ? -1 : read(file, both, sizeof both);
        if (file >= 0)
            (void)close(file);
        if (n < 0) {
            return host_fail(error, HOST_INPUT, "%s: %s; give another folder",
                             s->path[STATE_FILE], strerror(errno));
        }
        s->is_new = !scan_values(v, both[0]) && !scan_values(v, both[1]);
        if (!s->is_new)
            return 0;
        if (!is_ours(both[0]) || !is_ours(both[1]) ||
            (n == 0 && !exists(s, SPOOL_FILE)))
            return not_a_state(s, STATE_FILE, error);
    }
    for (int i = ORDER_FILE; i < FILES; i++)
        if (!is_journal(s, i))
            return not_a_state(s, i, error);
    if (is_there && !s->is_quiet)
        host_note("%s: is damaged, so the run starts over",
                  s->path[STATE_FILE]);
    return 0;
}

/* Whether this run's values, as far as they are known, are the earlier one's.
 */
static int compare_values(const struct host_state *s,
                          const struct values *before,
                          struct host_error *error) {
    for (int i = 0; i < FIELDS; i++) {
        const char *now = s->values.of[i], *was = before->of[i];
        if (fields[i].what == NULL || now[0] == '\0' || strcmp(now, was) == 0)
            continue;
        return host_fail(
            error, fields[i].code,
            "%s: belongs to another run (%s %.16s there, %.16s now); give "
            "that run's points and options again, or another "
            "folder",
            s->path[STATE_FILE], fields[i].what, was, now);
    }
    return 0;
}

/* --- begin ---------------------------------------------------------------- */

static void digest_points(const struct host_points *points, char text[VALUE]) {
    enum { BLOCK = 1 << 16 };
    struct sha256_ctx sha;
    uint8_t sum[SHA256_DIGEST_SIZE];
    const uint8_t *at = (const uint8_t *)points->xyz;
    uint64_t left = points->count * 3 * sizeof(double);
    sha256_init(&sha);
    while (left > 0) {
        size_t n = left < BLOCK ? (size_t)left : BLOCK;
        sha256_update(&sha, n, at);
        host_call_trim(n);
        at += n, left -= n;
    }
    sha256_digest(&sha, sizeof sum, sum);
    for (size_t i = 0; i < sizeof sum; i++)
        (void)sprintf(text + 2 * i, "%02x", sum[i]);
}

static void set_values(struct values *v, const struct host_run_options *o,
                       const struct host_points *points) {
    set(v, FORMAT, "2");
    set(v, VERSION, NODE_VERSION);
    set_number(v, POINTS, points->count);
    digest_points(points, v->of[INPUT]);
    set(v, WAY, o->direct ? "threads" : "nodes");
    if (o->direct)
        return;
    if (o->strategy != NULL)
        set(v, STRATEGY, o->strategy->name);
    if (o->nodes != 0)
        set_number(v, NODES, o->nodes);
    set(v, PARTITION, host_partitions[o->partition]);
    set(v, INDEX, host_indexes[o->index]);
}

static int open_folder(struct host_state *s, struct host_error *error) {
    bool is_there = access(s->directory, F_OK) == 0;
    s->folder = host_folder_open(s->directory, error);
    if (s->folder < 0)
        return error->code;
    set(&s->values, FOLDER, is_there ? "found" : "made");
    int above = is_there ? -1 : openat(s->folder, "..", O_RDONLY | O_CLOEXEC);
    if (above >= 0) {
        (void)fsync(above);
        (void)close(above);
    }
    if (flock(s->folder, LOCK_EX | LOCK_NB) == 0)
        return 0;
    if (errno != EWOULDBLOCK) {
        return host_fail(error, HOST_INPUT,
                         "%s: cannot be locked (%s); give a folder of a local "
                         "disk",
                         s->directory, strerror(errno));
    }
    return host_fail(error, HOST_INPUT,
                     "%s: is in use by another run; wait for its end, or give "
                     "another folder",
                     s->directory);
}

/* What is there already is written over, or needs no more room. */
static int check_room(const struct host_state *s, uint64_t points,
                      struct host_error *error) {
    struct statvfs about;
    struct stat file;
    uint64_t need = points * HOST_STATE_POINT_BYTES;
    if (fstatvfs(s->folder, &about) != 0 || fstat(s->folder, &file) != 0)
        return 0;
    need += host_limits_reserved(file.st_dev);
    uint64_t room = (uint64_t)about.f_bavail * about.f_frsize;
    for (int i = 0; i < FILES; i++)
        if (fstatat(s->folder, names[i], &file, AT_SYMLINK_NOFOLLOW) == 0)
            room += (uint64_t)file.st_blocks * 512;
    if (room >= need)
        return 0;
    return host_fail(
        error, HOST_INPUT,
        "%s: has room for %" PRIu64 " MB, and the state may take "
        "%" PRIu64
        " MB, what is put aside included; make room, or give another folder",
        s->directory, room / 1000000, need / 1000000);
}

/* What the user leaves open is as it was. */
static void take_options(const struct values *before,
                         struct host_run_options *o) {
    if (o->direct)
        return;
    if (o->strategy == NULL)
        o->strategy = host_strategy_named(before->of[STRATEGY]);
    if (o->nodes == 0)
        o->nodes = (unsigned)number_of(before, NODES);
}

int host_state_begin(struct host_run_options *options,
                     const struct host_points *points,
                     struct host_error *error) {
    static struct host_state state;
    struct host_state *s = &state;
    struct values before = {{{0}}};
    if (options->resume == NULL)
        return 0;
    memset(s, 0, sizeof *s);
    s->directory = options->resume;
    s->is_quiet = options->quiet;
    for (int i = 0; i < FILES; i++)
        (void)snprintf(s->path[i], sizeof s->path[i], "%s/%s", s->directory,
                       names[i]);
    set_values(&s->values, options, points);
    if (open_folder(s, error) == 0 && read_values(s, &before, error) == 0 &&
        (s->is_new || compare_values(s, &before, error) == 0))
        check_room(s, points->count, error);
    if (error->code != 0) {
        bool is_made = s->folder >= 0 && s->is_new &&
                       strcmp(s->values.of[FOLDER], "made") == 0;
        if (s->folder >= 0)
            (void)close(s->folder);
        if (is_made)
            (void)rmdir(s->directory);
        return error->code;
    }
    options->state = s;
    if (!s->is_new) {
        s->values = before;
        take_options(&before, options);
    }
    return 0;
}

/* --- the order ------------------------------------------------------------ */

/* On a thread of its own. */
static void write_order(void *context) {
    struct host_state *s = context;
    struct host_journal file = {0};
    (void)unlinkat(s->folder, "order.new", 0); /* of a run that was killed */
    if (host_journal_open(&file, s->folder, "order.new", s->path[ORDER_FILE],
                          &s->order_error) != 0)
        return;
    if (host_order_append(s->order, &file, s->key, &s->order_error) == 0 &&
        host_journal_sync(&file, &s->order_error) == 0)
        give_name(s, "order.new", ORDER_FILE, &s->order_error);
    host_journal_close(&file);
}

/* The earlier run's order; false: it is not whole. */
static bool load_order(struct host_state *s, struct host_order *order) {
    struct host_journal file = {0};
    struct host_error error = {0};
    if (!exists(s, ORDER_FILE) ||
        host_journal_open(&file, s->folder, names[ORDER_FILE],
                          s->path[ORDER_FILE], &error) != 0)
        return false;
    bool is_sound = host_order_take(order, &file, number_of(&s->values, KEY));
    host_journal_close(&file);
    if (!is_sound && !s->is_quiet)
        host_note("%s: is damaged, so the points are ordered again",
                  s->path[ORDER_FILE]);
    return is_sound;
}

int host_state_order(struct host_state *state, struct host_order *order,
                     const char *where, const struct host_points *points,
                     enum host_partition partition, uint32_t regions, bool grid,
                     struct host_error *error) {
    struct host_state *s = state;
    bool is_resumed = s != NULL && !s->is_new;
    *order = (struct host_order){0};
    if (is_resumed && load_order(s, order)) {
        s->order = order;
        return 0;
    }
    if (is_resumed)
        regions = (uint32_t)number_of(&s->values, REGIONS);
    if (host_order_make(order, where, points->xyz, points->count, partition,
                        regions, grid, error) != 0)
        return error->code;
    if (is_resumed && strcmp(s->values.of[JOINED], "yes") == 0)
        host_order_join(order);
    return 0;
}

/* --- regions of threads --------------------------------------------------- */

/* The last record of a region. */
static const struct host_journal_record *
find_region(const struct host_state *s, const struct host_direct_region *r) {
    for (size_t i = s->spool.records; i-- > 0;) {
        const struct host_journal_head *head = &s->spool.record[i].head;
        if (head->kind == REGION + r->level && head->key == r->key &&
            head->number == r->number && head->part == r->regions)
            return &s->spool.record[i];
    }
    return NULL;
}

static uint32_t regions_kept(void *context, unsigned level) {
    const struct host_state *s = context;
    uint32_t regions = 0;
    for (size_t i = 0; i < s->spool.records; i++)
        if (s->spool.record[i].head.kind == REGION + level)
            regions = s->spool.record[i].head.part;
    return regions;
}

static bool take_rows(struct host_journal_reader *reader,
                      struct host_tetrahedra *tets, uint64_t rows) {
    struct host_error error = {0};
    uint32_t(*v)[4] = host_tetrahedra_room(tets, rows, &error);
    if (v == NULL || !host_journal_take(reader, v, rows * sizeof *v))
        return false;
    host_tetrahedra_keep(tets, rows);
    return true;
}

static bool load_region(void *context, struct host_direct_region *region) {
    struct host_state *s = context;
    struct host_direct_region *r = region;
    struct host_journal_reader reader;
    const struct host_journal_record *record = find_region(s, r);
    if (record == NULL)
        return false;
    const uint64_t *rows = record->head.rows;
    host_journal_read(&reader, &s->spool, record);
    bool is_sound =
        reader.left == (rows[0] + rows[1]) * sizeof *r->tets->v + r->marks &&
        (r->marks == 0 || host_journal_take(&reader, r->mark, r->marks)) &&
        take_rows(&reader, r->tets, rows[0]) &&
        take_rows(&reader, r->left, rows[1]) && host_journal_sound(&reader);
    if (is_sound) {
        if (r->level == 0)
            atomic_fetch_add(&s->resumed,
                             s->order->region[r->number].last -
                                 s->order->region[r->number].first);
        return true;
    }
    atomic_fetch_add(&s->unsound, 1);
    host_tetrahedra_cut(r->tets, r->tets_before);
    host_tetrahedra_cut(r->left, r->left_before);
    if (r->marks > 0)
        memset(r->mark, 0, r->marks);
    return false;
}

static int keep_region(void *context, const struct host_direct_region *region,
                       struct host_error *error) {
    struct host_state *s = context;
    const struct host_direct_region *r = region;
    struct host_journal_head head = {.kind = REGION + r->level,
                                     .key = r->key,
                                     .number = r->number,
                                     .part = r->regions,
                                     .rows = {r->tets->count - r->tets_before,
                                              r->left->count - r->left_before}};
    const struct host_bytes part[] = {
        {r->mark, r->marks},
        {r->tets->v + r->tets_before, head.rows[0] * sizeof *r->tets->v},
        {r->left->v + r->left_before, head.rows[1] * sizeof *r->left->v}};
    return host_journal_append(&s->spool, &head, part, 3, error);
}

uint32_t host_state_regions(const struct host_state *state, uint64_t points) {
    unsigned threads = host_threads();
    uint32_t regions = host_direct_regions(threads, points);
    while (state != NULL && regions < KEPT_A_THREAD * threads &&
           points / (2 * regions) >= KEPT_POINTS_MIN)
        regions *= 2;
    return regions;
}

/* --- the run -------------------------------------------------------------- */

/* Bricks of regions that have a record. */
static uint32_t bricks_kept(const struct host_state *s,
                            const struct host_order *order) {
    struct host_direct_region region = {.key = s->key,
                                        .regions = order->regions};
    uint32_t bricks = 0;
    for (uint32_t r = 0; r < order->regions; r++) {
        region.number = r;
        if (find_region(s, &region) != NULL)
            bricks += order->region[r].last - order->region[r].first;
    }
    return bricks;
}

static void note_spool(const struct host_state *s, bool is_direct) {
    if (s->is_quiet || s->is_new)
        return;
    if (s->spool.damaged > 0)
        host_note("%s: is damaged; what is sound is used, and the rest done "
                  "again",
                  s->path[SPOOL_FILE]);
    if (is_direct)
        host_note("%s: resuming: %.0f %% of the bricks are there", s->directory,
                  100.0 * bricks_kept(s, s->order) / s->bricks);
}

/* What is known of the run now. */
static void set_order(struct host_state *s, const struct host_order *order,
                      const struct host_run_result *result) {
    struct values *v = &s->values;
    if (strcmp(v->of[WAY], "nodes") == 0) {
        set(v, STRATEGY, result->strategy->name);
        set_number(v, NODES, result->nodes);
    }
    set_number(v, REGIONS, order->regions_made);
    set(v, JOINED, order->regions < order->regions_made ? "yes" : "no");
    (void)snprintf(v->of[KEY], VALUE, "%016" PRIx64, s->key);
}

int host_state_start(struct host_state *state, const struct host_order *order,
                     const struct host_run_result *result,
                     struct host_error *error) {
    struct host_state *s = state;
    static char advice[HOST_PATH_MAX + 80];
    if (s == NULL)
        return 0;
    bool is_loaded = s->order == order;
    s->key = host_order_key(order, 0);
    s->bricks = order->bricks;
    s->order = order;
    if (!s->is_new && s->key != number_of(&s->values, KEY)) {
        s->is_new = true;
        if (!s->is_quiet)
            host_note("%s: the points are in another order now, so the run "
                      "starts over",
                      s->directory);
    }
    if (s->is_new) {
        (void)unlinkat(s->folder, names[SPOOL_FILE], 0);
        (void)unlinkat(s->folder, names[ORDER_FILE], 0);
        set_order(s, order, result);
    }
    /* The spool first: the folder is synced when `state` has its name. */
    if (host_journal_open(&s->spool, s->folder, names[SPOOL_FILE],
                          s->path[SPOOL_FILE], error) != 0 ||
        (s->is_new && write_values(s, error) != 0))
        return error->code;
    s->store =
        (struct host_direct_store){regions_kept, load_region, keep_region, s};
    s->kept = (struct host_kept){
        .journal = &s->spool,
        .key = s->key,
        .directory = s->is_quiet || s->is_new ? NULL : s->directory};
    note_spool(s, strcmp(s->values.of[WAY], "threads") == 0);
    (void)snprintf(advice, sizeof advice,
                   "incode: the same command goes on from what is in %s\n",
                   s->directory);
    host_output_advice(advice);
    s->is_writing = !is_loaded;
    if (s->is_writing)
        host_fork_start(&s->fork, write_order, s);
    return 0;
}

const struct host_direct_store *
host_state_store(const struct host_state *state) {
    return state == NULL ? NULL : &state->store;
}

bool host_state_is_resumed(const struct host_state *state) {
    return state != NULL && !state->is_new;
}

struct host_kept *host_state_kept(struct host_state *state) {
    return state == NULL ? NULL : &state->kept;
}

int host_state_order_kept(struct host_state *state,
                          struct host_run_result *result,
                          struct host_error *error) {
    if (state == NULL)
        return error->code;
    result->resumed_bricks = state->resumed + state->kept.resumed;
    if (!state->is_writing)
        return error->code;
    host_fork_join(&state->fork);
    state->is_writing = false;
    if (state->order_error.code != 0 && !state->is_quiet) {
        host_note("%s; without its order, a run that goes on orders the points "
                  "again",
                  state->order_error.text);
    }
    return error->code;
}

static void remove_all(const struct host_state *s) {
    (void)unlinkat(s->folder, names[SPOOL_FILE], 0);
    (void)unlinkat(s->folder, "order.new", 0);
    (void)unlinkat(s->folder, names[ORDER_FILE], 0);
    (void)unlinkat(s->folder, "state.new", 0);
    (void)unlinkat(s->folder, names[STATE_FILE], 0);
    if (strcmp(s->values.of[FOLDER], "made") == 0)
        (void)rmdir(s->directory);
}

/* The outputs outlive a loss of power before the state goes. */
static void make_durable(void *context, const char *file) {
    struct host_error *error = context;
    if (error->code == 0)
        (void)host_output_sync(file, error);
}

int host_state_end(const struct host_run_options *options,
                   struct host_error *error) {
    struct host_state *s = options->state;
    if (s == NULL)
        return error->code;
    if (s->is_writing)
        host_fork_join(&s->fork);
    host_output_advice(NULL);
    unsigned unsound = s->unsound + s->kept.unsound;
    if (unsound > 0 && !s->is_quiet)
        host_note("%s: damaged records: %u; what was in them was done again",
                  s->path[SPOOL_FILE], unsound);
    if (error->code == 0)
        host_write_files(options->output, options->outputs, make_durable,
                         error);
    if (error->code == 0 && options->stats != NULL)
        make_durable(error, options->stats);
    if (error->code == 0) {
        remove_all(s);
    } else if (error->code == HOST_UNVERIFIED && s->spool.path != NULL) {
        host_journal_clear(&s->spool);
        if (!s->is_quiet)
            host_note("%s: what was kept was part of a wrong result, and is "
                      "removed; the same command starts over",
                      s->directory);
    } else if (s->spool.path != NULL && !s->is_quiet) {
        host_note("%s: the same command goes on from what is here",
                  s->directory);
    }
    host_journal_close(&s->spool);
    (void)close(s->folder);
    return error->code;
}
