/* A file, packed or not, that is larger than the memory allows is refused where
 * that is known, and says how large it is. */

#include "tests/unit/test.h"
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <zlib.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/base/scratch.h"
#include "host/formats/source.h"
#include "host/formats/read.h"

/* A directory of its own, which is the current one. */
static char directory[] = "/tmp/incode-source-XXXXXX";
static struct rlimit before;

static int enter(void **unused) {
    (void)unused;
    return mkdtemp(directory) != NULL && chdir(directory) == 0 &&
                   getrlimit(RLIMIT_AS, &before) == 0
               ? 0
               : -1;
}

static int leave(void **unused) {
    (void)unused;
    return chdir("/") == 0 && rmdir(directory) == 0 ? 0 : -1;
}

/* Lets this process map so many bytes more. */
static void leave_memory(uint64_t bytes) {
    char line[128];
    unsigned long long kib = 0;
    struct rlimit limit = before;
    FILE *status = fopen("/proc/self/status", "r");
    assert_non_null(status);
    while (kib == 0 && fgets(line, sizeof line, status) != NULL)
        (void)sscanf(line, "VmSize: %llu kB", &kib);
    (void)fclose(status);
    limit.rlim_cur = (kib << 10) + bytes;
    assert_int_equal(setrlimit(RLIMIT_AS, &limit), 0);
}

/* n MiB of lines, packed. */
static void pack(const char *name, int n) {
    static char lines[1 << 20];
    for (size_t i = 0; i < sizeof lines; i++)
        lines[i] = "1 2 3 4\n"[i % 8];
    gzFile file = gzopen(name, "wb1");
    assert_non_null(file);
    for (int i = 0; i < n; i++)
        assert_int_equal(gzwrite(file, lines, sizeof lines), sizeof lines);
    assert_int_equal(gzclose(file), Z_OK);
}

TEST(what_unpacks_beyond_the_memory) {
    struct host_source source;
    struct host_error error = {0};
    pack("large.xyz.gz", 70);
    leave_memory((uint64_t)128 << 20);
    assert_int_equal(host_source_open(&source, "large.xyz.gz", true, &error),
                     HOST_INPUT);
    assert_null(source.data);
    assert_int_equal(setrlimit(RLIMIT_AS, &before), 0);
    unsigned tenths;
    assert_int_equal(sscanf(strstr(error.text, "become more than"),
                            "become more than %u.", &tenths),
                     1);
    assert_in_range(tenths, 25, 35); /* a quarter */
    assert_non_null(strstr(error.text, "large.xyz.gz: 0."));
    assert_non_null(strstr(error.text, "; unpack it"));
    error = (struct host_error){0};
    assert_int_equal(host_source_open(&source, "large.xyz.gz", true, &error),
                     0);
    assert_int_equal(source.bytes, 70 << 20);
    host_source_close(&source);
    assert_int_equal(unlink("large.xyz.gz"), 0);
}

/* A window is enough for text, whatever it unpacks to: here all but the end is
 * blank, so that points take nothing. */
TEST(text_beyond_the_memory) {
    static const char *const names[] = {"blank.xyz.gz", "blank.csv.gz",
                                        "blank.obj.gz"};
    static char lines[1 << 20];
    struct host_points points;
    memset(lines, '\n', sizeof lines);
    for (unsigned k = 0; k < sizeof names / sizeof names[0]; k++) {
        struct host_error error = {0};
        gzFile file = gzopen(names[k], "wb1");
        assert_non_null(file);
        for (int i = 0; i < 200; i++)
            assert_int_equal(gzwrite(file, lines, sizeof lines), sizeof lines);
        assert_true(gzputs(file, k == 2 ? "v 1 2 3\n" : "1 2 3\n") > 0);
        assert_int_equal(gzclose(file), Z_OK);
        leave_memory((uint64_t)64 << 20);
        assert_int_equal(host_points_read(names[k], &points, &error), 0);
        assert_int_equal(setrlimit(RLIMIT_AS, &before), 0);
        assert_int_equal(points.count, 1);
        assert_true(points.xyz[2] == 3.0);
        host_points_free(&points);
        assert_int_equal(unlink(names[k]), 0);
    }
}

/* Of text that is unpacked piece by piece, each number and the place of a
 * mistake are as in a plain file, wherever a piece ends; so are rows of bytes.
 */
TEST(pieces_are_as_the_whole) {
    enum { ROWS = 300000 };
    struct host_points points;
    struct host_error error = {0};
    gzFile file = gzopen("rows.xyz.gz", "wb1");
    assert_non_null(file);
    for (int i = 0; i < ROWS; i++)
        assert_true(gzprintf(file, "%d.5 %d 7\n", i, -3 * i) > 0);
    assert_int_equal(gzclose(file), Z_OK);
    assert_int_equal(host_points_read("rows.xyz.gz", &points, &error), 0);
    assert_int_equal(points.count, ROWS);
    for (int i = 0; i < ROWS; i++) {
        assert_true(points.xyz[3 * i] == i + 0.5 &&
                    points.xyz[3 * i + 1] == -3.0 * i);
    }
    file = gzopen("rows.xyz.gz", "ab1"); /* another member */
    assert_true(gzputs(file, "1 2\n") > 0);
    assert_int_equal(gzclose(file), Z_OK);
    host_points_free(&points);
    assert_int_equal(host_points_read("rows.xyz.gz", &points, &error),
                     HOST_INPUT);
    assert_non_null(strstr(error.text, "rows.xyz.gz:300001:4: "));
    assert_int_equal(unlink("rows.xyz.gz"), 0);
    file = gzopen("rows.npy.gz", "wb1");
    char head[128];
    memset(head, ' ', sizeof head);
    static const uint8_t magic[] = {0x93, 'N', 'U', 'M', 'P',
                                    'Y',  1,   0,   118, 0};
    memcpy(head, magic, sizeof magic);
    int n = snprintf(head + 10, sizeof head - 10,
                     "{'descr': '<f8', 'fortran_order': False, 'shape': "
                     "(%d, 3), }",
                     ROWS);
    head[10 + n] = ' ';
    head[sizeof head - 1] = '\n';
    assert_int_equal(gzwrite(file, head, sizeof head), sizeof head);
    for (int i = 0; i < 3 * ROWS; i++) {
        double value = i * 0.25;
        assert_int_equal(gzwrite(file, &value, sizeof value), sizeof value);
    }
    assert_int_equal(gzclose(file), Z_OK);
    error = (struct host_error){0};
    assert_int_equal(host_points_read("rows.npy.gz", &points, &error), 0);
    assert_int_equal(points.count, ROWS);
    for (int i = 0; i < 3 * ROWS; i++)
        assert_true(points.xyz[i] == i * 0.25);
    host_points_free(&points);
    file = gzopen("rows.npy.gz", "ab1");
    assert_int_equal(gzwrite(file, head, 8), 8);
    assert_int_equal(gzclose(file), Z_OK);
    assert_int_equal(host_points_read("rows.npy.gz", &points, &error),
                     HOST_INPUT);
    assert_non_null(
        strstr(error.text, "7200008 bytes of numbers where 300000"));
    assert_int_equal(unlink("rows.npy.gz"), 0);
}

/* A header is whole, however little of a pipe comes at a time. */
TEST(a_pipe_that_brings_little) {
    struct host_points points;
    struct host_error error = {0};
    gzFile file = gzopen("packed", "wb1");
    assert_non_null(file);
    assert_true(gzputs(file, "ply\nformat binary_little_endian 1.0\nelement "
                             "vertex 1\nproperty uchar x\nproperty uchar y\n"
                             "property uchar z\nend_header\nabc") > 0);
    assert_int_equal(gzclose(file), Z_OK);
    assert_int_equal(mkfifo("pipe.ply.gz", 0600), 0);
    pid_t child = fork();
    if (child == 0) {
        char byte;
        int from = open("packed", O_RDONLY), to = open("pipe.ply.gz", O_WRONLY);
        while (read(from, &byte, 1) == 1 && write(to, &byte, 1) == 1)
            (void)usleep(200); /* clock: so that the reader comes to wait */
        _exit(0);
    }
    assert_int_equal(host_points_read("pipe.ply.gz", &points, &error), 0);
    assert_int_equal(waitpid(child, NULL, 0), child);
    assert_int_equal(points.count, 1);
    assert_true(points.xyz[0] == 'a' && points.xyz[2] == 'c');
    host_points_free(&points);
    assert_int_equal(unlink("pipe.ply.gz"), 0);
    assert_int_equal(unlink("packed"), 0);
}

/* A line that never ends is no text. */
TEST(a_line_without_an_end) {
    static char letters[1 << 20];
    struct host_points points;
    struct host_error error = {0};
    memset(letters, '0', sizeof letters);
    gzFile file = gzopen("line.xyz.gz", "wb1");
    assert_non_null(file);
    for (int i = 0; i < 100; i++) {
        assert_int_equal(gzwrite(file, letters, sizeof letters),
                         sizeof letters);
    }
    assert_int_equal(gzclose(file), Z_OK);
    leave_memory((uint64_t)64 << 20);
    assert_int_equal(host_points_read("line.xyz.gz", &points, &error),
                     HOST_INPUT);
    assert_int_equal(setrlimit(RLIMIT_AS, &before), 0);
    assert_non_null(strstr(error.text, "line.xyz.gz: a line of more than 16"));
    assert_int_equal(unlink("line.xyz.gz"), 0);
}

/* What is little is read however little is left: it may be more than half. */
TEST(what_is_little) {
    struct host_source source;
    struct host_error error = {0};
    pack("little.xyz.gz", 12);
    leave_memory((uint64_t)36 << 20);
    assert_int_equal(host_source_open(&source, "little.xyz.gz", true, &error),
                     0);
    assert_int_equal(source.bytes, 12 << 20);
    assert_int_equal(setrlimit(RLIMIT_AS, &before), 0);
    host_source_close(&source);
    assert_int_equal(unlink("little.xyz.gz"), 0);
}

TEST(a_plain_file_beyond_the_memory) {
    struct host_source source;
    struct host_error error = {0};
    int file = open("huge.las", O_WRONLY | O_CREAT, 0666);
    assert_true(file >= 0);
    assert_int_equal(ftruncate(file, (off_t)1 << 42), 0); /* all of it a hole */
    (void)close(file);
    assert_int_equal(host_source_open(&source, "huge.las", false, &error),
                     HOST_INPUT);
    assert_non_null(strstr(error.text, "huge.las: 4398046.5 MB or more"));
    assert_int_equal(unlink("huge.las"), 0);
}

TEST(what_is_longer_than_its_caller_takes) {
    struct host_source source;
    struct host_error error = {0};
    assert_int_equal(host_source_open_bounded(&source, "/dev/zero", 5000,
                                              "an image", &error),
                     HOST_INPUT);
    assert_null(source.data);
    assert_string_equal(error.text, "/dev/zero: more than 5000 bytes, the most "
                                    "that an image has; give another file");
    int file = open("short", O_WRONLY | O_CREAT, 0666);
    assert_true(file >= 0);
    assert_int_equal(ftruncate(file, 5000), 0);
    error = (struct host_error){0};
    assert_int_equal(
        host_source_open_bounded(&source, "short", 5000, "an image", &error),
        0);
    assert_int_equal(source.bytes, 5000);
    host_source_close(&source);
    assert_int_equal(ftruncate(file, 5001), 0);
    (void)close(file);
    assert_int_equal(
        host_source_open_bounded(&source, "short", 5000, "an image", &error),
        HOST_INPUT);
    assert_int_equal(unlink("short"), 0);
}

/* A file of points whose numbers are a block of nothing but zeros. */
static char *zeros_in_vtk(size_t points, size_t *bytes) {
    enum { ROOM = 1 << 18 };
    uLongf size = 24 * points, packed = ROOM - 1024;
    char *file = malloc(ROOM), *zeros = calloc(1, size);
    assert_true(file != NULL && zeros != NULL);
    int n = snprintf(file, ROOM,
                     "<VTKFile type=\"PolyData\" byte_order=\"LittleEndian\" "
                     "compressor=\"vtkZLibDataCompressor\"><PolyData>"
                     "<Piece NumberOfPoints=\"%zu\"><Points><DataArray "
                     "type=\"Float64\" NumberOfComponents=\"3\" "
                     "format=\"appended\" offset=\"0\"/></Points></Piece>"
                     "</PolyData><AppendedData encoding=\"raw\">_",
                     points);
    char *head = file + n;
    assert_int_equal(
        compress2((Bytef *)head + 16, &packed, (Bytef *)zeros, size, 1), Z_OK);
    const uint32_t words[] = {1, (uint32_t)size, (uint32_t)size,
                              (uint32_t)packed};
    for (int i = 0; i < 16; i++)
        head[i] = (char)(words[i / 4] >> (8 * (i % 4)));
    static const char end[] = "</AppendedData></VTKFile>";
    memcpy(head + 16 + packed, end, sizeof end - 1);
    *bytes = (size_t)n + 16 + packed + sizeof end - 1;
    free(zeros);
    return file;
}

TEST(an_array_beyond_the_memory) {
    struct host_points points;
    struct host_error error = {0};
    size_t bytes;
    char *file = zeros_in_vtk(1750000, &bytes);
    leave_memory((uint64_t)72 << 20);
    assert_int_equal(host_points_parse("a.vtp", file, bytes, &points, &error),
                     HOST_INPUT);
    assert_int_equal(setrlimit(RLIMIT_AS, &before), 0);
    assert_non_null(strstr(error.text, "a.vtp: 0."));
    assert_non_null(strstr(error.text, "become more than 3"));
    error = (struct host_error){0};
    assert_int_equal(host_points_parse("a.vtp", file, bytes, &points, &error),
                     0);
    assert_int_equal(points.count, 1750000);
    host_points_free(&points);
    free(file);
}

/* Numbers of a byte each become points of 24: these tell how many there were.
 */
TEST(points_beyond_the_memory) {
    enum { ROWS = 4096 };
    static const double some[3 * ROWS];
    struct host_points points = {0};
    struct host_error error = {0};
    unsigned long long told = 0;
    leave_memory((uint64_t)320 << 20);
    while (host_points_append(&points, some, ROWS, &error) == 0) {
    }
    assert_int_equal(setrlimit(RLIMIT_AS, &before), 0);
    assert_int_equal(error.code, HOST_INPUT);
    assert_int_equal(sscanf(error.text, "host: more than %llu points", &told),
                     1);
    assert_int_equal(told, points.count);
    assert_true(24 * points.count > 96 << 20);
    host_points_free(&points);
}

/* --- where arrays are put aside ------------------------------------------- */

enum { LONG = 5 << 20 };

static struct host_scratch scratch;
static struct host_call call;

static void begin_call(void) {
    struct host_error error = {0};
    call = (struct host_call){
        .threads = 1, .memory_max = UINT64_MAX, .scratch = &scratch};
    assert_int_equal(host_scratch_begin(&scratch, "/tmp", 64 << 20, 1, &error),
                     0);
    host_call_enter(&call);
}

static void end_call(void) {
    host_call_enter(NULL);
    assert_int_equal(scratch.arrays, 0);
    assert_int_equal(call.memory, 0);
    host_scratch_end(&scratch);
}

static uint8_t byte_at(size_t i) {
    return (uint8_t)(i * 2654435761u >> 24);
}

static void write_long(const char *name) {
    static uint8_t bytes[LONG];
    for (size_t i = 0; i < LONG; i++)
        bytes[i] = byte_at(i);
    FILE *file = fopen(name, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, LONG, file), LONG);
    assert_int_equal(fclose(file), 0);
}

/* Of a plain file there is a window of 1 MiB, and no byte is lost. */
TEST(a_window_of_a_plain_file) {
    struct host_source source;
    struct host_error error = {0};
    write_long("long");
    begin_call();
    assert_int_equal(host_source_begin(&source, "long", false, &error), 0);
    assert_int_equal(source.bytes, 1 << 20);
    const uint8_t *at = source.data, *end = source.data + source.bytes;
    size_t seen = 0, wrong = 0;
    do {
        assert_true(end - at <= 1 << 20);
        while (end - at > 100) { /* which are kept */
            wrong += *at != byte_at(seen++);
            at++;
        }
    } while (host_source_more(&source, &at, &end));
    for (; at < end; at++)
        wrong += *at != byte_at(seen++);
    assert_int_equal(host_source_fault(&source, &error), 0);
    assert_int_equal(wrong, 0);
    assert_int_equal(seen, LONG);
    host_source_close(&source);
    assert_int_equal(host_source_open(&source, "long", false, &error), 0);
    assert_int_equal(source.bytes, LONG);
    assert_int_equal(source.capacity, LONG + 1);
    for (size_t i = 0; i < LONG; i++)
        wrong += source.data[i] != byte_at(i);
    assert_int_equal(wrong, 0);
    host_source_close(&source);
    end_call();
    assert_int_equal(unlink("long"), 0);
}

/* Whatever reads the rest of a file that has become shorter, says so. */
TEST(a_file_that_becomes_shorter) {
    static const char said[] =
        "long: it has become shorter while it was read, 3000000 bytes instead "
        "of 5242880; let nothing write to it, and run again";
    struct host_source source;
    begin_call();
    for (int way = 0; way < 3; way++) {
        struct host_error error = {0};
        write_long("long");
        assert_int_equal(host_source_begin(&source, "long", false, &error), 0);
        assert_int_equal(truncate("long", 3000000), 0);
        const uint8_t *at = source.data, *end = source.data + source.bytes;
        if (way == 0) {
            while (host_source_more(&source, &at, &end))
                at = end;
            assert_int_equal(host_source_fault(&source, &error), HOST_INPUT);
        } else if (way == 1) {
            assert_int_equal(host_source_all(&source, &at, &end, &error),
                             HOST_INPUT);
        } else {
            assert_int_equal(host_source_hold(&source, &error), HOST_INPUT);
            assert_null(source.data);
        }
        assert_string_equal(error.text, said);
        host_source_close(&source);
    }
    end_call();
    assert_int_equal(unlink("long"), 0);
}

/* The same of a packed one, which is cut short then. */
TEST(a_packed_file_that_becomes_shorter) {
    struct host_source source;
    struct host_error error = {0};
    gzFile file = gzopen("long.gz", "wb0");
    assert_non_null(file);
    for (size_t i = 0; i < LONG; i++)
        assert_int_equal(gzputc(file, byte_at(i)), byte_at(i));
    assert_int_equal(gzclose(file), Z_OK);
    assert_int_equal(host_source_begin(&source, "long.gz", true, &error), 0);
    assert_int_equal(truncate("long.gz", 3000000), 0);
    assert_int_equal(host_source_hold(&source, &error), HOST_INPUT);
    assert_non_null(strstr(error.text, "long.gz: it has become shorter while"));
    assert_int_equal(unlink("long.gz"), 0);
}

/* A file that is held whole takes as much room as it has bytes: its error says
 * how much there is, before it is read. */
TEST(a_file_beyond_the_room) {
    struct host_source source;
    struct host_error error = {0};
    int file = open("huge.vtu", O_WRONLY | O_CREAT, 0666);
    assert_true(file >= 0);
    assert_int_equal(ftruncate(file, (off_t)1 << 42), 0); /* all of it a hole */
    (void)close(file);
    begin_call();
    assert_int_equal(host_source_open(&source, "huge.vtu", false, &error),
                     HOST_INPUT);
    end_call();
    assert_non_null(strstr(error.text, "huge.vtu: 4398046.5 MB or more to put "
                                       "aside, and /tmp has "));
    assert_int_equal(unlink("huge.vtu"), 0);
}

TEST_GROUP(enter, leave)
