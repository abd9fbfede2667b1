/* The HDF5 library, loaded by dlopen when it is needed: linking it would double
 * the time of each start.  The library crashes on some damaged files.  So all
 * its calls are made in a process of their own, and a crash becomes an error
 * like any other.
 *
 * Memory: none that stays.  Work: 20 ms to load it. */
#ifndef HOST_HDF5_H
#define HOST_HDF5_H

#include <hdf5/serial/hdf5.h>

#include "host/base/error.h"

/* Functions of the library, without the prefix H5. */
#define HOST_HDF5_CALLS(CALL)                                                  \
    CALL(open)                                                                 \
    CALL(Eset_auto2)                                                           \
    CALL(Pcreate)                                                              \
    CALL(Pset_fapl_core)                                                       \
    CALL(Pset_fclose_degree)                                                   \
    CALL(Pset_file_image_callbacks)                                            \
    CALL(Pset_file_image)                                                      \
    CALL(Pset_meta_block_size)                                                 \
    CALL(Pset_libver_bounds)                                                   \
    CALL(Pset_obj_track_times)                                                 \
    CALL(Pset_layout)                                                          \
    CALL(Pset_alloc_time)                                                      \
    CALL(Pset_fill_time)                                                       \
    CALL(Pget_layout)                                                          \
    CALL(Pget_chunk)                                                           \
    CALL(Pget_nfilters)                                                        \
    CALL(Pget_filter2)                                                         \
    CALL(Zfilter_avail)                                                        \
    CALL(Pget_external_count)                                                  \
    CALL(Fopen)                                                                \
    CALL(Fcreate)                                                              \
    CALL(Fclose)                                                               \
    CALL(Lunregister)                                                          \
    CALL(Lexists)                                                              \
    CALL(Gcreate2)                                                             \
    CALL(Aopen_by_name)                                                        \
    CALL(Acreate2)                                                             \
    CALL(Aget_type)                                                            \
    CALL(Aget_space)                                                           \
    CALL(Aread)                                                                \
    CALL(Awrite)                                                               \
    CALL(Tcopy)                                                                \
    CALL(Tset_size)                                                            \
    CALL(Tset_strpad)                                                          \
    CALL(Tget_class)                                                           \
    CALL(Tget_size)                                                            \
    CALL(Tis_variable_str)                                                     \
    CALL(Screate)                                                              \
    CALL(Screate_simple)                                                       \
    CALL(Sclose)                                                               \
    CALL(Sselect_hyperslab)                                                    \
    CALL(Sget_simple_extent_ndims)                                             \
    CALL(Sget_simple_extent_dims)                                              \
    CALL(Sget_simple_extent_npoints)                                           \
    CALL(Dopen2)                                                               \
    CALL(Dcreate2)                                                             \
    CALL(Dread)                                                                \
    CALL(Dget_space)                                                           \
    CALL(Dget_type)                                                            \
    CALL(Dget_create_plist)                                                    \
    CALL(Dget_storage_size)                                                    \
    CALL(Dget_offset)

/* Variables of the library: identifiers of types and classes, which are set
 * when it is open. */
#define HOST_HDF5_IDS(ID)                                                      \
    ID(H5T_IEEE_F64LE_g)                                                       \
    ID(H5T_STD_I64LE_g)                                                        \
    ID(H5T_STD_U8LE_g)                                                         \
    ID(H5T_C_S1_g)                                                             \
    ID(H5P_CLS_FILE_ACCESS_ID_g)                                               \
    ID(H5P_CLS_FILE_CREATE_ID_g)                                               \
    ID(H5P_CLS_GROUP_CREATE_ID_g)                                              \
    ID(H5P_CLS_DATASET_CREATE_ID_g)

struct host_hdf5 {
#define HOST_HDF5_CALL(name) __typeof__(&(H5##name)) H5##name;
    HOST_HDF5_CALLS(HOST_HDF5_CALL)
#define HOST_HDF5_ID(name) hid_t name;
    HOST_HDF5_IDS(HOST_HDF5_ID)
};

/* Work with the library.  Its results are left in memory or in a file that both
 * processes share. */
struct host_hdf5_work {
    int (*run)(void *context, const struct host_hdf5 *h,
               struct host_error *error);
    void *context;
    const char *path;    /* for messages */
    const char *instead; /* what the user may do if the library crashes */
    size_t bytes;        /* of the file: they bound the processor time */
};

/* Loads the library and runs the work, if `run` is not NULL.  0, or the error
 * of the work; HOST_INPUT if the library is not installed or crashes. */
int host_hdf5_run(const struct host_hdf5_work *work, struct host_error *error);

#endif
