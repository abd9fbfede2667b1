/* Points out to files, so that reading gives the same doubles. */
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "host/files/output.h"
#include "host/mesh/points.h"
#include "host/files/source.h"

static void little(struct host_output *out, uint64_t value, size_t bytes)
{
    uint8_t byte[8];
    for (size_t i = 0; i < bytes; i++) {
        byte[i] = (uint8_t)(value >> (8 * i));
    }
    host_output_bytes(out, byte, bytes);
}

static void binary(struct host_output *out, const struct host_points *points,
                   bool big)
{
    for (uint64_t i = 0; i < 3 * points->count; i++) {
        uint64_t bits;
        memcpy(&bits, &points->xyz[i], sizeof bits);
        little(out, big ? __builtin_bswap64(bits) : bits, 8);
    }
}

static void text(struct host_output *out, const struct host_points *points,
                 const char *separator, bool numbered)
{
    for (uint64_t i = 0; i < points->count; i++) {
        if (numbered) {
            host_output_unsigned(out, i + points->base);
            host_output_text(out, separator);
        }
        for (uint64_t d = 0; d < 3; d++) {
            host_output_double(out, points->xyz[3 * i + d]);
            host_output_text(out, d < 2 ? separator : "\n");
        }
    }
}

/* A line with one number in it. */
static void line(struct host_output *out, const char *before, uint64_t number,
                 const char *after)
{
    host_output_text(out, before);
    host_output_unsigned(out, number);
    host_output_text(out, after);
}

static void write_npy(struct host_output *out, const struct host_points *points)
{
    char header[160];
    int n = snprintf(header, sizeof header,
                     "{'descr': '<f8', 'fortran_order': False, "
                     "'shape': (%llu, 3), }",
                     (unsigned long long)points->count);
    int padded = (10 + n + 1 + 63) / 64 * 64 - 10; /* numbers aligned to 64 */
    host_output_bytes(out, "\x93NUMPY\x01\x00", 8);
    little(out, (uint64_t)padded, 2);
    host_output_text(out, header);
    for (; n < padded - 1; n++) {
        host_output_text(out, " ");
    }
    host_output_text(out, "\n");
    binary(out, points, false);
}

/* .vtu and .vtp: one cell a point, so that ParaView shows them. */
static void write_vtkxml(struct host_output *out,
                         const struct host_points *points, bool polydata)
{
    uint64_t n = points->count;
    host_output_text(out, "<?xml version=\"1.0\"?>\n<VTKFile type=\"");
    host_output_text(out, polydata ? "PolyData" : "UnstructuredGrid");
    host_output_text(out, "\" version=\"1.0\" byte_order=\"LittleEndian\" "
                          "header_type=\"UInt64\">\n<");
    host_output_text(out, polydata ? "PolyData" : "UnstructuredGrid");
    line(out, ">\n<Piece NumberOfPoints=\"", n,
         polydata ? "\" NumberOfVerts=\"" : "\" NumberOfCells=\"");
    line(out, "", n,
         "\">\n<Points>\n<DataArray type=\"Float64\" Name=\"Points\" "
         "NumberOfComponents=\"3\" format=\"appended\" offset=\"0\"/>\n"
         "</Points>\n");
    host_output_text(out, polydata ? "<Verts>\n" : "<Cells>\n");
    line(out,
         "<DataArray type=\"Int64\" Name=\"connectivity\" format=\"appended\" "
         "offset=\"",
         8 + 24 * n, "\"/>\n");
    line(out,
         "<DataArray type=\"Int64\" Name=\"offsets\" format=\"appended\" "
         "offset=\"",
         16 + 32 * n, "\"/>\n");
    if (!polydata) {
        line(out,
             "<DataArray type=\"UInt8\" Name=\"types\" format=\"appended\" "
             "offset=\"",
             24 + 40 * n, "\"/>\n");
    }
    host_output_text(out, polydata ? "</Verts>\n</Piece>\n</PolyData>\n"
                                   : "</Cells>\n</Piece>\n"
                                     "</UnstructuredGrid>\n");
    host_output_text(out, "<AppendedData encoding=\"raw\">\n_");
    little(out, 24 * n, 8);
    binary(out, points, false);
    for (uint64_t array = 0; array < 2; array++) {
        little(out, 8 * n, 8);
        for (uint64_t i = 0; i < n; i++) {
            little(out, i + array, 8);
        }
    }
    little(out, n, 8);
    for (uint64_t i = 0; i < n && !polydata; i++) {
        little(out, 1, 1); /* VTK_VERTEX */
    }
    host_output_text(out, "\n</AppendedData>\n</VTKFile>\n");
}

static void write_format(struct host_output *out, const char *path,
                         const struct host_points *points)
{
    uint64_t n = points->count;
    switch (host_format_of(path)) {
    case HOST_NODE:
        line(out, "", n, " 3 0 0\n");
        text(out, points, " ", true);
        break;
    case HOST_PLY:
        line(out, "ply\nformat binary_little_endian 1.0\nelement vertex ", n,
             "\nproperty double x\nproperty double y\nproperty double z\n"
             "end_header\n");
        binary(out, points, false);
        break;
    case HOST_OFF:
        line(out, "OFF\n", n, " 0 0\n");
        text(out, points, " ", false);
        break;
    case HOST_NPY:
        write_npy(out, points);
        break;
    case HOST_VTK:
        line(out,
             "# vtk DataFile Version 3.0\nincode\nBINARY\nDATASET POLYDATA\n"
             "POINTS ",
             n, " double\n");
        binary(out, points, true);
        host_output_text(out, "\n");
        break;
    case HOST_VTU:
    case HOST_VTP:
        write_vtkxml(out, points, host_format_of(path) == HOST_VTP);
        break;
    default: /* .xyz .txt .csv and standard output */
        text(out, points, host_is_csv(path) ? "," : " ", false);
    }
}

static bool is_known(const char *path)
{
    enum host_format format = host_format_of(path);
    return strcmp(path, "-") == 0 ||
           (!host_is_packed(path) && format <= HOST_VTP);
}

int host_points_write(const char *path, const struct host_points *points,
                      struct host_error *error)
{
    if (!is_known(path)) {
        return host_fail(error, HOST_USAGE,
                         "%s: no format of points to be written has this "
                         "extension; use .xyz .txt .csv .node .ply .off .npy "
                         ".vtk .vtu .vtp, or -",
                         path);
    }
    struct host_output out;
    if (host_output_open(&out, path, error) == 0) {
        write_format(&out, path, points);
        host_output_close(&out, 1, error);
    }
    return error->code;
}
