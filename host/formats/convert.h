/* One file to another by their extensions: points to points, or tetrahedra to
 * tetrahedra (which are brought into canonical order). */
#ifndef HOST_CONVERT_H
#define HOST_CONVERT_H

#include "host/base/error.h"

/* With a `format` (or NULL), `in` holds points in it, as host_format_told has
 * it.  A tetrahedra file that holds no points (.ele, .npy) takes them from the
 * .node beside it, packed or not, where the target needs them. */
int host_convert(const char *in, const char *format, const char *out,
                 struct host_error *error);

#endif
