/* Records are found again as they were written, whatever happens to the rest of
 * the file; a record that is damaged anywhere is not taken. */
#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "host/base/create.h"
#include "host/base/journal.h"
#include "tests/unit/test.h"

enum { RECORDS = 3, HEAD = sizeof(struct host_journal_head), MOST = 1 << 12 };

/* A record's payload: so many bytes, each its number. */
static const uint32_t sizes[RECORDS] = {1000, 0, 129};

struct place {
    char path[64];
    int folder;
};

static int make_folder(void **fixture) {
    static struct place p;
    struct host_error error = {0};
    (void)snprintf(p.path, sizeof p.path, "/tmp/incode-journal-XXXXXX");
    if (mkdtemp(p.path) == NULL)
        return -1;
    p.folder = host_folder_open(p.path, &error);
    *fixture = &p;
    return p.folder >= 0 ? 0 : -1;
}

static int remove_folder(void **fixture) {
    const struct place *p = *fixture;
    (void)unlinkat(p->folder, "spool", 0);
    (void)close(p->folder);
    return rmdir(p->path);
}

static void open_journal(const struct place *p, struct host_journal *j) {
    struct host_error error = {0};
    assert_int_equal(host_journal_open(j, p->folder, "spool", "spool", &error),
                     0);
}

static int append(struct host_journal *j, uint32_t number,
                  struct host_error *error) {
    uint8_t bytes[MOST];
    struct host_journal_head head = {.kind = 7, .number = number};
    uint32_t size = sizes[number], first = size / 3;
    for (uint32_t i = 0; i < size; i++)
        bytes[i] = (uint8_t)(i + number);
    const struct host_bytes part[] = {{bytes, first},
                                      {bytes + first, size - first}};
    return host_journal_append(j, &head, part, 2, error);
}

static void write_all(const struct place *p) {
    struct host_journal j;
    struct host_error error = {0};
    open_journal(p, &j);
    for (uint32_t i = 0; i < RECORDS; i++)
        assert_int_equal(append(&j, i, &error), 0);
    assert_int_equal(host_journal_sync(&j, &error), 0);
    host_journal_close(&j);
}

/* Whether the record is whole; its bytes are right then. */
static bool is_sound(const struct host_journal *j, size_t i) {
    const struct host_journal_record *record = &j->record[i];
    uint8_t bytes[MOST];
    struct host_journal_reader reader;
    uint32_t size = sizes[record->head.number];
    assert_int_equal(record->head.kind, 7);
    assert_int_equal(record->head.bytes, size);
    host_journal_read(&reader, j, record);
    assert_true(host_journal_take(&reader, bytes, size));
    assert_false(host_journal_take(&reader, bytes, 1));
    if (!host_journal_sound(&reader))
        return false;
    for (uint32_t k = 0; k < size; k++)
        assert_int_equal(bytes[k], (uint8_t)(k + record->head.number));
    return true;
}

/* A bit for each record that is found whole. */
static unsigned found(const struct place *p) {
    struct host_journal j;
    unsigned whole = 0;
    open_journal(p, &j);
    for (size_t i = 0; i < j.records; i++)
        if (is_sound(&j, i))
            whole |= 1u << j.record[i].head.number;
    host_journal_close(&j);
    return whole;
}

static size_t read_file(const struct place *p, uint8_t bytes[MOST]) {
    int file = openat(p->folder, "spool", O_RDONLY);
    ssize_t n = read(file, bytes, MOST);
    assert_true(n > 0 && n < MOST);
    assert_int_equal(close(file), 0);
    return (size_t)n;
}

static void write_file(const struct place *p, const uint8_t *bytes, size_t n) {
    int file = openat(p->folder, "spool", O_WRONLY | O_TRUNC);
    assert_int_equal(write(file, bytes, n), (ssize_t)n);
    assert_int_equal(close(file), 0);
}

/* The record that has this byte; RECORDS: it is between two. */
static unsigned record_at(size_t at) {
    size_t from = 0;
    for (unsigned i = 0; i < RECORDS; i++) {
        if (at >= from && at < from + HEAD + sizes[i])
            return i;
        from += HEAD + (sizes[i] + HEAD - 1) / HEAD * HEAD;
    }
    return RECORDS;
}

TEST_WITH(test_all_records, make_folder, remove_folder) {
    write_all(*fixture);
    assert_int_equal(found(*fixture), 7);
}

TEST_WITH(test_a_bit_that_flips, make_folder, remove_folder) {
    uint8_t bytes[MOST];
    write_all(*fixture);
    size_t n = read_file(*fixture, bytes);
    for (size_t at = 0; at < n; at++) {
        unsigned record = record_at(at);
        bytes[at] ^= (uint8_t)(1u << at % 8);
        write_file(*fixture, bytes, n);
        assert_int_equal(found(*fixture),
                         record == RECORDS ? 7 : 7 & ~(1u << record));
        bytes[at] ^= (uint8_t)(1u << at % 8);
    }
}

TEST_WITH(test_an_end_that_is_missing, make_folder, remove_folder) {
    uint8_t bytes[MOST];
    struct host_error error = {0};
    write_all(*fixture);
    size_t n = read_file(*fixture, bytes);
    for (size_t cut = 0; cut < n; cut += 7) {
        struct host_journal j;
        unsigned record = record_at(cut);
        unsigned before = record == RECORDS ? 7 : (1u << record) - 1;
        write_file(*fixture, bytes, cut);
        unsigned whole = found(*fixture);
        assert_int_equal(whole & before, whole);
        open_journal(*fixture, &j);
        assert_int_equal(append(&j, 2, &error), 0); /* behind what is sound */
        host_journal_close(&j);
        assert_int_equal(found(*fixture), whole | 4);
    }
}

TEST_WITH(test_records_of_two_processes, make_folder, remove_folder) {
    struct host_journal j;
    struct host_error error = {0};
    write_all(*fixture);
    open_journal(*fixture, &j);
    assert_int_equal(j.sequence, RECORDS);
    assert_int_equal(append(&j, 1, &error), 0);
    host_journal_close(&j);
    open_journal(*fixture, &j);
    assert_int_equal(j.records, RECORDS + 1);
    assert_int_equal(j.record[RECORDS].head.sequence, RECORDS);
    assert_int_equal(j.damaged, 0);
    host_journal_clear(&j);
    host_journal_close(&j);
    assert_int_equal(found(*fixture), 0);
}

TEST_WITH(test_a_full_disk, make_folder, remove_folder) {
    struct host_journal j;
    struct host_error error = {0};
    struct rlimit before, little;
    struct stat about;
    write_all(*fixture);
    open_journal(*fixture, &j);
    uint64_t size = j.end;
    (void)signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    little = (struct rlimit){j.end + 300, before.rlim_max};
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &little), 0);
    assert_int_equal(append(&j, 0, &error), HOST_INPUT);
    assert_int_equal(fstat(j.file, &about), 0);
    assert_int_equal(about.st_size, size); /* what it took is given back */
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    assert_non_null(strstr(error.text, "spool: cannot be written"));
    assert_non_null(strstr(error.text, "make room"));
    error = (struct host_error){0};
    assert_int_equal(append(&j, 0, &error), HOST_INPUT); /* it stays so */
    host_journal_close(&j);
    assert_int_equal(found(*fixture), 7);
}

TEST_WITH(test_no_file, make_folder, remove_folder) {
    const struct place *p = *fixture;
    struct host_journal j = {0};
    struct host_error error = {0};
    assert_int_equal(symlinkat("/dev/null", p->folder, "spool"), 0);
    assert_int_equal(host_journal_open(&j, p->folder, "spool", "spool", &error),
                     HOST_INPUT);
    host_journal_close(&j);
}
