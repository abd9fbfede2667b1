/* The packed forms of a DataArray in VTK's XML files: base64 or raw, in blocks
 * by zlib or plain, to the bytes that they hold. */
#ifndef HOST_VTK_ARRAY_H
#define HOST_VTK_ARRAY_H

#include "host/formats/source.h"

struct vtk_coding {
    bool base64;      /* else raw */
    bool compressed;  /* vtkZLibDataCompressor */
    bool big;         /* byte order, of headers too */
    bool wide_header; /* UInt64, else UInt32 */
};

struct vtk_array {
    uint8_t *data;
    size_t bytes;
    size_t capacity;
};

/* `from`: where the array's header begins; `bytes`: to the end of what may
 * belong to it. */
int vtk_array_unpack(struct vtk_array *array, const struct host_source *source,
                     const struct vtk_coding *coding, const uint8_t *from,
                     size_t bytes, struct host_error *error);

void vtk_array_free(struct vtk_array *array);

#endif
