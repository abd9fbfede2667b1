/* VTKHDF 1.x and 2.x (the VTK documentation's "VTKHDF file format"): points of
 * unstructured grids and poly data, and tetrahedra, in any number of
 * partitions.
 *
 * The process that has HDF5's library reads the bytes of the source, without a
 * copy, and leaves the arrays in a file in memory.  For an output it makes the
 * frame of the file: all but the arrays, which are written in their places as
 * the bytes of the file go out in their order.
 *
 * Memory: when read, 24 bytes a point, and 8 a corner and 9 a cell if cells are
 * wanted, at once, so that a file is refused for which a limit of the host's
 * memory leaves no room; when written, none that grows. */
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "format.h"
#include "hdf5.h"
#include "host/base/parallel.h"
#include "host/base/scratch.h"
#include "read.h"

#define DAMAGED "the file is damaged, get it again"
#define UNDONE "write .vtu"

/* Flags whose macros call the library. */
enum { READ_ONLY = 0, TRUNCATE = 2 };

/* The arrays of a file, in the order in which the process leaves them. */
enum array {
    POINTS_OF_PARTS,
    CELLS_OF_PARTS,
    IDS_OF_PARTS,
    POINTS,
    CONNECTIVITY,
    OFFSETS,
    TYPES,
    ARRAYS
};

static const char *const names[ARRAYS] = {"/VTKHDF/NumberOfPoints",
                                          "/VTKHDF/NumberOfCells",
                                          "/VTKHDF/NumberOfConnectivityIds",
                                          "/VTKHDF/Points",
                                          "/VTKHDF/Connectivity",
                                          "/VTKHDF/Offsets",
                                          "/VTKHDF/Types"};

static size_t bytes_of(enum array i) { /* of a number */
    return i == TYPES ? 1 : 8;
}

/* Bytes for all but the arrays: how many the library takes for them at once,
 * which suffices, and what they and its rounding may take. */
enum { META_BYTES = 8192, FRAME_STEP = 4096, FRAME_BYTES = 65536 };

/* What the process reports. */
struct report {
    uint64_t count[ARRAYS]; /* of numbers */
    uint64_t at[ARRAYS];    /* where they belong in an output */
    uint8_t frame[FRAME_BYTES];
};

struct task {
    const char *path;
    const struct host_source *source;
    bool points, cells;    /* wanted of it */
    struct report *report; /* in memory that both processes have */
    int file;              /* in memory, too */
};

/* What both processes have; false: an error. */
static bool map(struct task *task, struct host_error *error) {
    void *report = mmap(NULL, sizeof(struct report), PROT_READ | PROT_WRITE,
                        MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    task->report = report == MAP_FAILED ? NULL : report;
    task->file = memfd_create("vtkhdf", MFD_CLOEXEC);
    if (task->report == NULL || task->file < 0)
        host_fail_memory(error, "the arrays of a VTKHDF file");
    return task->report != NULL && task->file >= 0;
}

static void unmap(struct task *task) {
    if (task->report != NULL)
        (void)munmap(task->report, sizeof *task->report);
    if (task->file >= 0)
        (void)close(task->file);
}

/* --- reading, in the process ---------------------------------------------- */

/* A deflated byte holds at most 1,032; chunks of so much are always allowed. */
enum { INFLATION_MAX = 1032, CHUNK_MAX = 1 << 24, BLOCK_ROWS = 1 << 16 };

struct numbers {
    hid_t dataset, space;
    int rank;
    hsize_t size[2]; /* rows, columns */
    uint64_t step;   /* rows read at once: whole chunks */
};

static int fail_named(const struct task *task, struct host_error *error,
                      enum array i, const char *what) {
    return host_fail(error, HOST_INPUT, "%s: %s %s; " DAMAGED, task->path,
                     names[i], what);
}

/* The bytes are used as they are: nothing writes to them. */
static void *image_of(size_t bytes, H5FD_file_image_op_t why, void *source) {
    (void)why;
    const struct host_source *of = source;
    return bytes == of->bytes ? (void *)of->data : NULL;
}
static void *image_copy(void *to, const void *from, size_t bytes,
                        H5FD_file_image_op_t why, void *source) {
    (void)bytes, (void)why, (void)source;
    return to == from ? to : NULL;
}
static void *image_grown(void *image, size_t bytes, H5FD_file_image_op_t why,
                         void *source) {
    const struct host_source *of = source;
    (void)why;
    return bytes == of->bytes ? image : NULL;
}
static herr_t image_free(void *image, H5FD_file_image_op_t why, void *source) {
    (void)image, (void)why, (void)source;
    return 0;
}
static void *image_kept(void *source) {
    return source;
}
static herr_t image_left(void *source) {
    (void)source;
    return 0;
}

static hid_t open_image(const struct host_hdf5 *h,
                        const struct host_source *source) {
    void *data = (void *)source->data;
    H5FD_file_image_callbacks_t calls = {.image_malloc = image_of,
                                         .image_memcpy = image_copy,
                                         .image_realloc = image_grown,
                                         .image_free = image_free,
                                         .udata_copy = image_kept,
                                         .udata_free = image_left,
                                         .udata = (void *)source};
    hid_t access = h->H5Pcreate(h->H5P_CLS_FILE_ACCESS_ID_g);
    if (h->H5Pset_fapl_core(access, CHUNK_MAX, 0) < 0 ||
        h->H5Pset_file_image_callbacks(access, &calls) < 0 ||
        h->H5Pset_file_image(access, data, source->bytes) < 0)
        return -1;
    (void)h->H5Lunregister(H5L_TYPE_EXTERNAL); /* no other file is read */
    return h->H5Fopen("VTKHDF", READ_ONLY, access);
}

/* Whole numbers of an attribute, exactly so many. */
static bool take_attribute(const struct host_hdf5 *h, hid_t file,
                           const char *group, const char *name, int64_t *value,
                           hssize_t count) {
    hid_t a = h->H5Aopen_by_name(file, group, name, H5P_DEFAULT, H5P_DEFAULT);
    return a >= 0 &&
           h->H5Sget_simple_extent_npoints(h->H5Aget_space(a)) == count &&
           h->H5Tget_class(h->H5Aget_type(a)) == H5T_INTEGER &&
           h->H5Aread(a, h->H5T_STD_I64LE_g, value) >= 0;
}

/* The attribute Type, of fixed or of variable length. */
static bool take_type(const struct host_hdf5 *h, hid_t file, char *text,
                      size_t size) {
    hid_t a =
        h->H5Aopen_by_name(file, "/VTKHDF", "Type", H5P_DEFAULT, H5P_DEFAULT);
    hid_t type = a < 0 ? -1 : h->H5Aget_type(a);
    char *loose = NULL;
    memset(text, 0, size);
    if (type < 0 || h->H5Tget_class(type) != H5T_STRING ||
        h->H5Sget_simple_extent_npoints(h->H5Aget_space(a)) != 1)
        return false;
    if (h->H5Tis_variable_str(type) <= 0)
        return h->H5Tget_size(type) < size && h->H5Aread(a, type, text) >= 0;
    if (h->H5Aread(a, type, &loose) < 0 || loose == NULL)
        return false;
    memcpy(text, loose, strnlen(loose, size - 1));
    return true;
}

/* Whether it is of a version, a type and a time that are read. */
static int check_head(const struct task *task, const struct host_hdf5 *h,
                      hid_t file, struct host_error *error) {
    int64_t version[2] = {0}, steps = 1;
    char type[64];
    if (h->H5Lexists(file, "VTKHDF", H5P_DEFAULT) <= 0 ||
        !take_attribute(h, file, "/VTKHDF", "Version", version, 2) ||
        !take_type(h, file, type, sizeof type)) {
        return host_source_fail(task->source, error,
                                "HDF5 without a group VTKHDF that has a "
                                "Version and a Type; give a VTKHDF file");
    }
    if (version[0] < 1 || version[0] > 2) {
        return host_fail(error, HOST_INPUT,
                         "%s: VTKHDF %lld.%lld, where 1.x and 2.x are read; "
                         "write it in one of these, or as .vtu",
                         task->path, (long long)version[0],
                         (long long)version[1]);
    }
    bool grid = strcmp(type, "UnstructuredGrid") == 0;
    if (!grid && strcmp(type, "PolyData") != 0) {
        return host_source_fail(task->source, error,
                                "its Type is neither UnstructuredGrid nor "
                                "PolyData; write it as one of these");
    }
    if (task->cells && !grid) {
        return host_source_fail(task->source, error,
                                "PolyData, which has no tetrahedra; give an "
                                "UnstructuredGrid");
    }
    if (h->H5Lexists(file, "/VTKHDF/Steps", H5P_DEFAULT) > 0 &&
        (!take_attribute(h, file, "/VTKHDF/Steps", "NSteps", &steps, 1) ||
         steps != 1)) {
        return host_source_fail(task->source, error,
                                "it has several time steps; write one of them "
                                "to a file of its own");
    }
    return 0;
}

/* Whether no more numbers are claimed than so many bytes can hold; where they
 * are in chunks, these are read whole. */
static bool check_storage(const struct task *task, const struct host_hdf5 *h,
                          struct numbers *n, uint64_t bytes) {
    hid_t list = h->H5Dget_create_plist(n->dataset);
    H5D_layout_t layout = h->H5Pget_layout(list);
    uint64_t stored = h->H5Dget_storage_size(n->dataset);
    uint64_t row = bytes * n->size[1];
    hsize_t chunk[2] = {1, 1};
    n->step = BLOCK_ROWS;
    if (stored > task->source->bytes || h->H5Pget_external_count(list) != 0)
        return false;
    if (layout == H5D_COMPACT || layout == H5D_CONTIGUOUS)
        return n->size[0] <= stored / row;
    if (layout != H5D_CHUNKED || h->H5Pget_chunk(list, n->rank, chunk) < 0 ||
        n->size[0] > stored * INFLATION_MAX / row)
        return false;
    uint64_t most = stored * INFLATION_MAX;
    most = most > CHUNK_MAX ? most : CHUNK_MAX;
    if (chunk[0] == 0 || chunk[1] > n->size[1] ||
        chunk[0] > most / (bytes * chunk[1]))
        return false;
    n->step = chunk[0] * (1 + (BLOCK_ROWS - 1) / chunk[0]);
    return true;
}

static int open_numbers(const struct task *task, const struct host_hdf5 *h,
                        hid_t file, enum array i, struct numbers *n,
                        struct host_error *error) {
    const int rank = i == POINTS ? 2 : 1;
    *n = (struct numbers){.rank = rank, .size = {0, 1}};
    n->dataset = h->H5Dopen2(file, names[i], H5P_DEFAULT);
    if (n->dataset < 0)
        return fail_named(task, error, i, "is missing or cannot be read");
    n->space = h->H5Dget_space(n->dataset);
    hid_t type = h->H5Dget_type(n->dataset);
    H5T_class_t class = h->H5Tget_class(type);
    if (h->H5Sget_simple_extent_ndims(n->space) != rank ||
        h->H5Sget_simple_extent_dims(n->space, n->size, NULL) != rank ||
        n->size[1] != (i == POINTS ? 3 : 1) ||
        (class != H5T_INTEGER && (class != H5T_FLOAT || i != POINTS)) ||
        h->H5Tget_size(type) == 0)
        return fail_named(task, error, i, "has another shape or type");
    if (n->size[0] > 0 && !check_storage(task, h, n, h->H5Tget_size(type)))
        return fail_named(task, error, i,
                          "claims more numbers than the file holds");
    task->report->count[i] = n->size[0] * n->size[1];
    return 0;
}

static bool put_all(int file, const char *data, size_t bytes) {
    while (bytes > 0) {
        ssize_t n = write(file, data, bytes);
        if (n < 0 && errno != EINTR)
            return false;
        data += n > 0 ? n : 0;
        bytes -= n > 0 ? (size_t)n : 0;
    }
    return true;
}

/* Of numbers that are not to be read: whether the library has not what they are
 * packed by, or they are damaged. */
static int fail_reading(const struct task *task, const struct host_hdf5 *h,
                        enum array i, const struct numbers *n,
                        struct host_error *error) {
    hid_t list = h->H5Dget_create_plist(n->dataset);
    int filters = h->H5Pget_nfilters(list);
    for (unsigned k = 0; (int)k < filters; k++) {
        size_t none = 0;
        unsigned flags;
        H5Z_filter_t filter =
            h->H5Pget_filter2(list, k, &flags, &none, NULL, 0, NULL, NULL);
        if (filter >= 0 && h->H5Zfilter_avail(filter) <= 0) {
            return host_fail(error, HOST_INPUT,
                             "%s: %s is packed by filter number %d, which the "
                             "HDF5 library here lacks; pack it by gzip",
                             task->path, names[i], filter);
        }
    }
    return fail_named(task, error, i, "cannot be read");
}

static int copy_numbers(const struct task *task, const struct host_hdf5 *h,
                        enum array i, const struct numbers *n,
                        struct host_error *error) {
    hid_t type = i == POINTS  ? h->H5T_IEEE_F64LE_g
                 : i == TYPES ? h->H5T_STD_U8LE_g
                              : h->H5T_STD_I64LE_g;
    hsize_t start[2] = {0, 0}, count[2] = {n->size[0], n->size[1]};
    uint64_t most = n->step < n->size[0] ? n->step : n->size[0];
    size_t row = n->size[1] * bytes_of(i);
    char *block = malloc((most + 1) * row);
    if (block == NULL)
        return host_fail_memory(error, names[i]);
    for (; start[0] < n->size[0]; start[0] += count[0]) {
        uint64_t left = n->size[0] - start[0];
        count[0] = left < most ? left : most;
        hid_t space = h->H5Screate_simple(n->rank, count, NULL);
        if (h->H5Sselect_hyperslab(n->space, H5S_SELECT_SET, start, NULL, count,
                                   NULL) < 0 ||
            h->H5Dread(n->dataset, type, space, n->space, H5P_DEFAULT, block) <
                0) {
            fail_reading(task, h, i, n, error);
            break;
        }
        (void)h->H5Sclose(space);
        if (!put_all(task->file, block, count[0] * row)) {
            host_fail_memory(error, names[i]);
            break;
        }
    }
    free(block);
    return error->code;
}

/* The library holds what it unpacks in memory, and so is what it leaves. */
static int check_limit(const struct task *task, uint64_t bytes,
                       struct host_error *error) {
    enum { SHARE = 4 };
    const struct host_call *call = host_call();
    uint64_t most = call == NULL || call->scratch == NULL
                        ? UINT64_MAX
                        : call->scratch->resident_max / SHARE;
    return bytes <= most
               ? 0
               : host_fail(
                     error, HOST_INPUT,
                     "%s: VTKHDF of %.1f MB unpacked, which is read as a "
                     "whole, and the host may use %.1f MB for it; convert "
                     "it to .npy or .vtu on a machine with more, or give "
                     "a larger --host-memory",
                     task->path, (double)bytes * 1e-6, (double)most * 1e-6);
}

static int read_arrays(void *context, const struct host_hdf5 *h,
                       struct host_error *error) {
    const struct task *task = context;
    struct numbers n[ARRAYS];
    uint64_t bytes = 0;
    hid_t file = open_image(h, task->source);
    if (file < 0) {
        return host_source_fail(task->source, error,
                                "no HDF5 file, or a damaged one; give one in "
                                "this format, or get it again");
    }
    if (check_head(task, h, file, error) != 0)
        return error->code;
    for (enum array i = 0; i < ARRAYS; i++) {
        bool wanted =
            i == POINTS_OF_PARTS || (i == POINTS ? task->points : task->cells);
        n[i] = (struct numbers){0};
        if (wanted && open_numbers(task, h, file, i, &n[i], error) != 0)
            return error->code;
        bytes += task->report->count[i] * bytes_of(i);
    }
    check_limit(task, bytes + task->source->bytes, error);
    host_source_unpacks(task->source, task->source->bytes, bytes, error);
    for (enum array i = 0; i < ARRAYS && error->code == 0; i++)
        if (n[i].size[0] > 0)
            copy_numbers(task, h, i, &n[i], error);
    return error->code;
}

/* --- reading, of what it has left ----------------------------------------- */

/* What is left of each array. */
struct arrays {
    struct host_stream of[ARRAYS];
};

/* The next `count` numbers of an array; false: it has not so many. */
static bool take(struct arrays *a, enum array i, uint64_t count,
                 struct host_stream *s) {
    struct host_stream *left = &a->of[i];
    *s = *left;
    if (count > (size_t)(left->end - left->at) / bytes_of(i))
        return false;
    s->end = s->at + count * bytes_of(i);
    left->at = s->end;
    return true;
}

static int take_cells(struct arrays *a, uint64_t points, uint64_t first,
                      struct host_tetrahedra *tets, struct host_error *error) {
    struct host_stream corners, offsets, types;
    uint64_t cells = 0, ids = 0, zero = 1;
    if (host_stream_whole(&a->of[CELLS_OF_PARTS], &cells, error) != 0 ||
        host_stream_whole(&a->of[IDS_OF_PARTS], &ids, error) != 0)
        return error->code;
    if (!take(a, CONNECTIVITY, ids, &corners) ||
        !take(a, OFFSETS, cells + 1, &offsets) ||
        !take(a, TYPES, cells, &types) ||
        host_stream_whole(&offsets, &zero, error) != 0 || zero != 0) {
        return host_source_fail(corners.source, error,
                                "a partition has other numbers of corners, "
                                "offsets or types than it claims; " DAMAGED);
    }
    uint64_t before = tets->count;
    if (host_stream_cells(&corners, &offsets, &types, cells, first, tets,
                          error) != 0)
        return error->code;
    for (uint64_t t = before; t < tets->count; t++)
        for (int k = 0; k < 4; k++)
            if (tets->v[t][k] - first >= points) {
                return host_fail(error, HOST_INPUT,
                                 "%s: cell %llu has a corner that is no point "
                                 "of its partition; " DAMAGED,
                                 corners.source->path, (unsigned long long)t);
            }
    return host_stream_ended(&corners)
               ? 0
               : host_source_fail(corners.source, error,
                                  "more corners than the offsets of the cells "
                                  "give; " DAMAGED);
}

/* `bytes` of arrays, in their order. */
static int take_arrays(const struct task *task, const uint8_t *data,
                       size_t bytes, struct host_mesh *mesh,
                       struct host_error *error) {
    const uint64_t *count = task->report->count;
    uint64_t parts = count[POINTS_OF_PARTS], rows = 0;
    struct arrays a;
    for (enum array i = 0; i < ARRAYS; i++) {
        uint64_t fits = bytes / bytes_of(i);
        uint64_t n = count[i] < fits ? count[i] : fits;
        a.of[i] = (struct host_stream){.source = task->source,
                                       .type = i == POINTS  ? HOST_F64
                                               : i == TYPES ? HOST_U8
                                                            : HOST_I64,
                                       .at = data,
                                       .end = data + n * bytes_of(i)};
        data = a.of[i].end;
        bytes -= n * bytes_of(i);
    }
    for (; parts > 0 && error->code == 0; parts--) {
        uint64_t points = 0, first = rows;
        if (host_stream_whole(&a.of[POINTS_OF_PARTS], &points, error) != 0)
            break;
        if (points > UINT32_MAX - rows) {
            host_source_fail(task->source, error,
                             "more than 2^32 points; give fewer");
            break;
        }
        rows += points;
        if (mesh->tets != NULL)
            take_cells(&a, points, first, mesh->tets, error);
    }
    if (error->code == 0 && mesh->points != NULL && rows != count[POINTS] / 3) {
        host_source_fail(task->source, error,
                         "the points of its partitions are not those of "
                         "Points; " DAMAGED);
    }
    return error->code == 0 && mesh->points != NULL
               ? host_stream_points(&a.of[POINTS], rows, mesh->points, error)
               : error->code;
}

static int read_vtkhdf(const struct host_source *source, struct host_mesh *mesh,
                       struct host_error *error) {
    struct task task = {.path = source->path,
                        .source = source,
                        .points = mesh->points != NULL,
                        .cells = mesh->tets != NULL};
    const struct host_hdf5_work work = {read_arrays, &task, source->path,
                                        DAMAGED, source->bytes};
    struct stat status;
    if (map(&task, error) && host_hdf5_run(&work, error) == 0 &&
        fstat(task.file, &status) == 0 && status.st_size > 0) {
        size_t bytes = (size_t)status.st_size;
        void *data = mmap(NULL, bytes, PROT_READ, MAP_SHARED, task.file, 0);
        if (data == MAP_FAILED)
            host_fail_memory(error, "the arrays of a VTKHDF file");
        else
            take_arrays(&task, data, bytes, mesh, error);
        if (data != MAP_FAILED)
            (void)munmap(data, bytes);
    }
    unmap(&task);
    return error->code;
}

/* --- writing -------------------------------------------------------------- */

static bool put_attribute(const struct host_hdf5 *h, hid_t group,
                          const char *name, hid_t type, hid_t space,
                          const void *value) {
    hid_t a = h->H5Acreate2(group, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    return a >= 0 && h->H5Awrite(a, type, value) >= 0;
}

static bool put_head(const struct host_hdf5 *h, hid_t group) {
    static const int64_t version[] = {1, 0};
    static const char type[] = "UnstructuredGrid";
    const hsize_t two = 2;
    hid_t text = h->H5Tcopy(h->H5T_C_S1_g);
    return h->H5Tset_size(text, strlen(type)) >= 0 &&
           h->H5Tset_strpad(text, H5T_STR_NULLPAD) >= 0 &&
           put_attribute(h, group, "Version", h->H5T_STD_I64LE_g,
                         h->H5Screate_simple(1, &two, NULL), version) &&
           put_attribute(h, group, "Type", text, h->H5Screate(H5S_SCALAR),
                         type);
}

/* An array's place in the file, without its numbers. */
static bool put_array(const struct task *task, const struct host_hdf5 *h,
                      hid_t file, enum array i) {
    uint64_t count = task->report->count[i];
    hsize_t size[2] = {i == POINTS ? count / 3 : count, 3};
    hid_t type = i == POINTS  ? h->H5T_IEEE_F64LE_g
                 : i == TYPES ? h->H5T_STD_U8LE_g
                              : h->H5T_STD_I64LE_g;
    hid_t list = h->H5Pcreate(h->H5P_CLS_DATASET_CREATE_ID_g);
    if (h->H5Pset_obj_track_times(list, false) < 0 ||
        h->H5Pset_layout(list, H5D_CONTIGUOUS) < 0 ||
        h->H5Pset_alloc_time(list, H5D_ALLOC_TIME_EARLY) < 0 ||
        h->H5Pset_fill_time(list, H5D_FILL_TIME_NEVER) < 0)
        return false;
    hid_t dataset =
        h->H5Dcreate2(file, names[i], type,
                      h->H5Screate_simple(i == POINTS ? 2 : 1, size, NULL),
                      H5P_DEFAULT, list, H5P_DEFAULT);
    task->report->at[i] = dataset < 0 ? HADDR_UNDEF : h->H5Dget_offset(dataset);
    return dataset >= 0 && (count == 0 || task->report->at[i] != HADDR_UNDEF);
}

/* The library's memory of a file that is made: the frame, which does not grow
 * past its end, as nothing but arrays comes there. */
static void *frame_grown(void *image, size_t bytes, H5FD_file_image_op_t why,
                         void *report) {
    struct report *of = report;
    (void)image, (void)why;
    return bytes <= sizeof of->frame ? of->frame : NULL;
}

/* The same bytes each time: no times, and the layout of one version. */
static int make_frame(void *context, const struct host_hdf5 *h,
                      struct host_error *error) {
    const struct task *task = context;
    H5FD_file_image_callbacks_t calls = {.image_realloc = frame_grown,
                                         .image_free = image_free,
                                         .udata_copy = image_kept,
                                         .udata_free = image_left,
                                         .udata = task->report};
    hid_t access = h->H5Pcreate(h->H5P_CLS_FILE_ACCESS_ID_g);
    hid_t make = h->H5Pcreate(h->H5P_CLS_FILE_CREATE_ID_g);
    hid_t timeless = h->H5Pcreate(h->H5P_CLS_GROUP_CREATE_ID_g);
    bool made =
        h->H5Pset_fapl_core(access, FRAME_STEP, 0) >= 0 &&
        h->H5Pset_file_image_callbacks(access, &calls) >= 0 &&
        h->H5Pset_meta_block_size(access, META_BYTES) >= 0 &&
        h->H5Pset_fclose_degree(access, H5F_CLOSE_STRONG) >= 0 &&
        h->H5Pset_libver_bounds(access, H5F_LIBVER_V18, H5F_LIBVER_V18) >= 0 &&
        h->H5Pset_obj_track_times(make, false) >= 0 &&
        h->H5Pset_obj_track_times(timeless, false) >= 0;
    hid_t file = made ? h->H5Fcreate("VTKHDF", TRUNCATE, make, access) : -1;
    hid_t group = file < 0 ? -1
                           : h->H5Gcreate2(file, "VTKHDF", H5P_DEFAULT,
                                           timeless, H5P_DEFAULT);
    made = group >= 0 && put_head(h, group);
    for (enum array i = 0; i < ARRAYS && made; i++)
        made = put_array(task, h, file, i);
    return made && h->H5Fclose(file) >= 0
               ? 0
               : host_fail(error, HOST_BROKEN,
                           "%s: the HDF5 library cannot make it; " UNDONE,
                           task->path);
}

/* The bytes of the file from `from` to `to`, between arrays. */
static void put_frame(struct host_output *out, const struct report *report,
                      uint64_t from, uint64_t to) {
    static const uint8_t zeros[FRAME_STEP];
    while (from < to) {
        uint64_t left = to - from;
        bool inside = from < sizeof report->frame;
        uint64_t have = inside ? sizeof report->frame - from : sizeof zeros;
        uint64_t n = left < have ? left : have;
        host_output_bytes(out, inside ? report->frame + from : zeros,
                          (size_t)n);
        from += n;
    }
}

static void put_numbers(struct host_output *out, enum array i,
                        const struct host_points *points,
                        const struct host_tetrahedra *tets) {
    uint64_t n = points->count, m = tets->count;
    const uint64_t whole[] = {n, m, 4 * m};
    if (i <= IDS_OF_PARTS)
        host_put_whole(out, whole[i], 8, false);
    for (uint64_t k = 0; k < 3 * n && i == POINTS; k++)
        host_put_double(out, points->xyz[k] + 0.0, false);
    for (uint64_t k = 0; k < 4 * m && i == CONNECTIVITY; k++)
        host_put_whole(out, tets->v[k / 4][k % 4], 8, false);
    for (uint64_t k = 0; k <= m && i == OFFSETS; k++)
        host_put_whole(out, 4 * k, 8, false);
    for (uint64_t k = 0; k < m && i == TYPES; k++)
        host_output_bytes(out, "\x0a", 1); /* VTK_TETRA */
}

/* The frame with the arrays in it, from its first byte to its last, which the
 * file itself has (HDF5 File Format Specification, superblock of version 2). */
static void put_file(struct host_output *out, const struct report *report,
                     const struct host_points *points,
                     const struct host_tetrahedra *tets) {
    enum { AT_END = 28 };
    uint64_t from = 0;
    for (bool more = true; more;) {
        enum array next = ARRAYS;
        for (enum array i = 0; i < ARRAYS; i++)
            if (report->count[i] > 0 && report->at[i] >= from &&
                (next == ARRAYS || report->at[i] < report->at[next]))
                next = i;
        more = next != ARRAYS;
        if (more) {
            put_frame(out, report, from, report->at[next]);
            put_numbers(out, next, points, tets);
            from = report->at[next] + report->count[next] * bytes_of(next);
        }
    }
    put_frame(out, report, from,
              host_whole_at(report->frame + AT_END, HOST_U64, false));
}

static int write_tetrahedra(struct host_output *out, struct host_output *beside,
                            const struct host_points *points,
                            const struct host_tetrahedra *tets,
                            struct host_error *error) {
    (void)beside;
    uint64_t n = points->count, m = tets->count;
    struct task task = {.path = out->path};
    const struct host_hdf5_work work = {make_frame, &task, out->path, UNDONE,
                                        0};
    const uint64_t count[ARRAYS] = {1, 1, 1, 3 * n, 4 * m, m + 1, m};
    if (map(&task, error)) {
        memcpy(task.report->count, count, sizeof count);
        if (host_hdf5_run(&work, error) == 0)
            put_file(out, task.report, points, tets);
    }
    unmap(&task);
    return error->code;
}

/* Whether the library is there, before the work begins. */
static int check(const char *path, struct host_error *error) {
    const struct host_hdf5_work work = {NULL, NULL, path, UNDONE, 0};
    return host_hdf5_run(&work, error);
}

const struct host_format host_format_vtkhdf = {
    .name = "VTKHDF",
    .extensions = {".vtkhdf", ".hdf"},
    .read_points = read_vtkhdf,
    .read_tetrahedra = read_vtkhdf,
    .write_tetrahedra = write_tetrahedra,
    .check_output = check,
    .apart = true,
};
