/* VTK's XML files .vtu, .vtp, .vts: points and tetrahedra of every piece, as
 * text, base64 or appended, plain or packed by zlib. */
#include <expat.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <zlib.h>
#if 100 * XML_MAJOR_VERSION + XML_MINOR_VERSION >= 209 /* it is deprecated */
#define XML_GetCurrentLineNumber XML_GetCurrentLineNumber64
#endif

#include "format.h"
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "rows.h"
#include "scan.h"
#include "read.h"

/* --- packed arrays -------------------------------------------------------- */

/* Base64 or raw, in blocks by zlib or plain. */
struct coding {
    bool base64;      /* else raw */
    bool compressed;  /* vtkZLibDataCompressor */
    bool big;         /* byte order, of headers too */
    bool wide_header; /* UInt64, else UInt32 */
};

struct bytes {
    const uint8_t *data;
    size_t bytes;
    uint8_t *owned; /* `capacity` bytes, or NULL: they are the file's */
    size_t capacity;
};

/* Bytes that a deflated one holds at most (zlib's own figure), and bytes
 * between two trims. */
enum { INFLATION_MAX = 1032, BLOCK = 1 << 16 };

static void free_array(struct bytes *array) {
    host_unmap(array->owned, array->capacity);
    *array = (struct bytes){0};
}

static int reserve(struct bytes *array, size_t bytes,
                   struct host_error *error) {
    *array = (struct bytes){.owned = host_map(bytes), .capacity = bytes};
    array->data = array->owned;
    return array->data == NULL ? host_fail_memory(error, "an array") : 0;
}

static int value_of(uint8_t c) {
    return c >= 'A' && c <= 'Z'   ? c - 'A'
           : c >= 'a' && c <= 'z' ? c - 'a' + 26
           : c >= '0' && c <= '9' ? c - '0' + 52
           : c == '+'             ? 62
           : c == '/'             ? 63
                                  : -1;
}

/* Decodes until `most` bytes are out or something that is not base64 comes.
 * Padding may stand in the middle: writers encode headers by themselves. */
static size_t decode(const uint8_t *from, size_t bytes, uint8_t *to,
                     size_t most) {
    size_t done = 0;
    uint32_t bits = 0;
    int count = 0, padding = 0;
    for (size_t i = 0; i < bytes && done < most; i++) {
        uint8_t c = from[i];
        int value = value_of(c);
        if (i % BLOCK == 0)
            host_call_trim(2 * BLOCK);
        if (c == ' ' || c == '\n' || c == '\r' || c == '\t')
            continue;
        if (value < 0 && (c != '=' || count < 2))
            break;
        padding += c == '=';
        bits = bits << 6 | (uint32_t)(value < 0 ? 0 : value);
        if (++count == 4) {
            for (int k = 0; k < 3 - padding && done < most; k++)
                to[done++] = (uint8_t)(bits >> (16 - 8 * k));
            bits = 0;
            count = padding = 0;
        }
    }
    return done;
}

struct packed {
    const struct host_source *source;
    const struct coding *coding;
    const uint8_t *from;
    size_t bytes;
};

/* The first `most` bytes of what is packed, decoded. */
static int plain(struct bytes *out, const struct packed *p, size_t most,
                 struct host_error *error) {
    size_t limit = most < p->bytes ? most : p->bytes;
    if (!p->coding->base64)
        *out = (struct bytes){.data = p->from, .bytes = limit};
    else if (reserve(out, limit, error) == 0)
        out->bytes = decode(p->from, p->bytes, out->owned, limit);
    else
        return error->code;
    if (out->bytes < most) {
        return host_source_fail(p->source, error,
                                "an array ends before its stated length; the "
                                "file is cut short, get it whole");
    }
    return 0;
}

static uint64_t header_word(const struct bytes *a, size_t i,
                            const struct coding *coding) {
    enum host_number type = coding->wide_header ? HOST_U64 : HOST_U32;
    return host_whole_at(a->data + i * host_number_bytes(type), type,
                         coding->big);
}

static int damaged(const struct packed *p, struct host_error *error) {
    return host_source_fail(p->source, error,
                            "a packed array is damaged; get the file again");
}

static int inflate_blocks(struct bytes *out, const struct packed *p,
                          const struct bytes *head, const struct bytes *in,
                          uint64_t blocks, struct host_error *error) {
    uint64_t size = header_word(head, 1, p->coding);
    uint64_t last = header_word(head, 2, p->coding);
    size_t at = head->bytes;
    for (uint64_t b = 0; b < blocks; b++) {
        uint64_t packed = header_word(head, 3 + (size_t)b, p->coding);
        uint64_t n = b + 1 == blocks && last != 0 ? last : size;
        if (packed > in->bytes - at || n > out->capacity - out->bytes ||
            !host_source_inflate(in->data + at, (size_t)packed,
                                 out->owned + out->bytes, (size_t)n))
            return damaged(p, error);
        at += (size_t)packed;
        out->bytes += (size_t)n;
    }
    return 0;
}

/* Header: blocks, bytes a block, bytes of a last partial block, then the
 * packed bytes of each. */
static int unpack_blocks(struct bytes *out, const struct packed *p,
                         struct host_error *error) {
    size_t word = p->coding->wide_header ? 8 : 4;
    struct bytes head = {0}, in = {0};
    uint64_t blocks = 0, packed = 0;
    if (plain(&head, p, word, error) == 0) {
        blocks = header_word(&head, 0, p->coding);
        if (blocks > p->bytes / word)
            damaged(p, error);
    }
    free_array(&head);
    if (error->code == 0 && blocks > 0 &&
        plain(&head, p, word * (3 + (size_t)blocks), error) == 0) {
        for (uint64_t b = 0; b < blocks && packed <= p->bytes; b++) {
            uint64_t n = header_word(&head, 3 + (size_t)b, p->coding);
            packed = n > p->bytes ? n : packed + n;
        }
        uint64_t size = header_word(&head, 1, p->coding);
        if (packed > p->bytes || size > packed * INFLATION_MAX + 1024 ||
            size * blocks > packed * INFLATION_MAX * 2 + 1024 * blocks)
            damaged(p, error);
        else if (host_source_unpacks(p->source, packed, size * blocks, error) ==
                     0 &&
                 plain(&in, p, head.bytes + (size_t)packed, error) == 0 &&
                 reserve(out, (size_t)(size * blocks), error) == 0)
            inflate_blocks(out, p, &head, &in, blocks, error);
    }
    free_array(&head);
    free_array(&in);
    return error->code;
}

static int unpack_plain(struct bytes *out, const struct packed *p,
                        struct host_error *error) {
    size_t word = p->coding->wide_header ? 8 : 4;
    struct bytes head = {0};
    uint64_t bytes = 0;
    if (plain(&head, p, word, error) == 0) {
        bytes = header_word(&head, 0, p->coding);
        if (bytes > p->bytes)
            damaged(p, error);
    }
    free_array(&head);
    if (error->code == 0 && plain(out, p, word + (size_t)bytes, error) == 0) {
        out->data += word;
        out->bytes = (size_t)bytes;
    }
    return error->code;
}

/* from: where the header of an array begins; bytes: to the end of what may
 * belong to it. */
static int unpack_array(struct bytes *array, const struct host_source *source,
                        const struct coding *coding, const uint8_t *from,
                        size_t bytes, struct host_error *error) {
    struct packed p = {source, coding, from, bytes};
    if (coding->base64) { /* leading blanks of inline data */
        while (p.bytes > 0 && (*p.from == ' ' || *p.from == '\n' ||
                               *p.from == '\r' || *p.from == '\t')) {
            p.from++;
            p.bytes--;
        }
    }
    *array = (struct bytes){0};
    if (coding->compressed)
        return unpack_blocks(array, &p, error);
    return unpack_plain(array, &p, error);
}

/* --- elements ------------------------------------------------------------- */

enum want { POINTS, CONNECTIVITY, OFFSETS, TYPES, WANTS };

/* A DataArray of the piece at hand. */
struct array {
    bool there, text;
    enum host_number type;
    struct bytes bytes;    /* of numbers, or of text */
    uint64_t lines_before; /* of the file, before the text */
};

struct xml {
    const struct host_source *source;
    struct host_mesh *mesh;
    struct host_error *error;
    XML_Parser parser;
    struct coding coding;
    const uint8_t *appended; /* just past its underscore, or NULL */
    size_t appended_bytes;
    bool appended_base64;
    bool in_points, in_cells, in_piece, any_piece, counted;
    uint64_t piece_points, piece_cells;
    uint64_t points_before; /* in earlier pieces */
    enum want reading;      /* WANTS: none */
    unsigned nested;        /* elements within the array at hand */
    bool reading_base64;    /* format="binary" */
    char *text;             /* of the array at hand */
    size_t text_bytes, text_capacity;
    struct array array[WANTS];
};

static void fail(struct xml *x, const char *what) {
    if (x->error->code == 0) {
        host_fail(x->error, HOST_INPUT, "%s:%llu: %s", x->source->path,
                  (unsigned long long)XML_GetCurrentLineNumber(x->parser),
                  what);
    }
}

static const char *attribute(const char **attributes, const char *name) {
    for (; *attributes != NULL; attributes += 2)
        if (strcmp(attributes[0], name) == 0)
            return attributes[1];
    return "";
}

static void start_file(struct xml *x, const char **attributes) {
    const char *compressor = attribute(attributes, "compressor");
    x->coding.big =
        strcmp(attribute(attributes, "byte_order"), "BigEndian") == 0;
    x->coding.wide_header =
        strcmp(attribute(attributes, "header_type"), "UInt64") == 0;
    x->coding.compressed = strcmp(compressor, "vtkZLibDataCompressor") == 0;
    if (*compressor != '\0' && !x->coding.compressed) {
        fail(x, "a compressor other than vtkZLibDataCompressor; write the "
                "file with zlib");
    }
}

static void unpack(struct xml *x, enum want want, bool base64,
                   const uint8_t *from, size_t bytes) {
    struct coding coding = x->coding;
    coding.base64 = base64;
    if (x->error->code == 0) {
        unpack_array(&x->array[want].bytes, x->source, &coding, from, bytes,
                     x->error);
    }
}

static void start_array(struct xml *x, const char **attributes) {
    static const char *const names[] = {"", "connectivity", "offsets", "types"};
    const char *name = attribute(attributes, "Name");
    const char *format = attribute(attributes, "format");
    enum want want = WANTS;
    if (x->in_points)
        want = POINTS;
    for (int i = CONNECTIVITY; i <= TYPES && x->in_cells; i++)
        want = strcmp(name, names[i]) == 0 ? (enum want)i : want;
    if (want == WANTS || (want == POINTS && x->mesh->points == NULL) ||
        (want != POINTS && x->mesh->tets == NULL))
        return;
    struct array *a = &x->array[want];
    enum host_number type = host_number_named(attribute(attributes, "type"));
    if (a->there || type == HOST_NO_NUMBER) {
        fail(x, "an array is there twice or of unknown type; correct it");
        return;
    }
    const char *components = attribute(attributes, "NumberOfComponents");
    if (want == POINTS && *components != '\0' && strcmp(components, "3") != 0) {
        fail(x, "the points have not 3 components; correct "
                "NumberOfComponents, or give points in space");
        return;
    }
    a->there = true;
    a->type = type;
    a->text = strcmp(format, "ascii") == 0 || *format == '\0';
    if (strcmp(format, "appended") != 0) {
        x->reading = want;
        x->reading_base64 = !a->text;
        x->text_bytes = 0;
        return;
    }
    uint64_t offset = strtoull(attribute(attributes, "offset"), NULL, 10);
    if (x->appended == NULL || offset >= x->appended_bytes) {
        fail(x, "an array lies outside the appended data; the file is cut "
                "short, get it whole");
        return;
    }
    unpack(x, want, x->appended_base64, x->appended + offset,
           x->appended_bytes - (size_t)offset);
}

/* A piece of a structured grid tells its points by their extent. */
static void start_piece(struct xml *x, const char **attributes) {
    const char *points = attribute(attributes, "NumberOfPoints");
    const char *extent = attribute(attributes, "Extent");
    int e[6];
    x->any_piece = x->in_piece = true;
    x->counted = *points != '\0';
    x->piece_points = strtoull(points, NULL, 10);
    x->piece_cells = strtoull(attribute(attributes, "NumberOfCells"), NULL, 10);
    if (!x->counted && sscanf(extent, "%d %d %d %d %d %d", &e[0], &e[1], &e[2],
                              &e[3], &e[4], &e[5]) == 6) {
        x->counted = true;
        x->piece_points = 1;
        for (int d = 0; d < 6; d += 2) {
            int64_t n = (int64_t)e[d + 1] - e[d] + 1;
            if (n < 0 || n > UINT32_MAX || x->piece_points > UINT32_MAX) {
                fail(x, "an impossible extent; correct it");
                return;
            }
            x->piece_points *= (uint64_t)n;
        }
    }
}

static void XMLCALL start_element(void *context, const char *name,
                                  const char **attributes) {
    struct xml *x = context;
    if (x->reading != WANTS)
        x->nested++; /* information about the array: not its text */
    else if (strcmp(name, "VTKFile") == 0)
        start_file(x, attributes);
    else if (strcmp(name, "Piece") == 0)
        start_piece(x, attributes);
    else if (strcmp(name, "Points") == 0)
        x->in_points = true;
    else if (strcmp(name, "Cells") == 0)
        x->in_cells = true;
    else if (strcmp(name, "DataArray") == 0)
        start_array(x, attributes);
}

static void XMLCALL characters(void *context, const char *text, int length) {
    struct xml *x = context;
    size_t n = (size_t)length;
    if (x->reading == WANTS || x->nested > 0 || x->error->code != 0)
        return;
    if (x->text_bytes == 0) {
        x->array[x->reading].lines_before =
            XML_GetCurrentLineNumber(x->parser) - 1;
    }
    if (x->text_capacity - x->text_bytes < n) {
        size_t capacity = x->text_capacity * 2 + n + 4096;
        char *grown = host_remap(x->text, x->text_capacity, capacity);
        if (grown == NULL) {
            host_fail_memory(x->error, "an array");
            return;
        }
        x->text = grown;
        x->text_capacity = capacity;
    }
    memcpy(x->text + x->text_bytes, text, n);
    host_call_trim(2 * n);
    x->text_bytes += n;
}

static void end_array(struct xml *x) {
    struct array *a = &x->array[x->reading];
    if (x->reading_base64) {
        unpack(x, x->reading, true, (const uint8_t *)x->text, x->text_bytes);
    } else { /* the text itself changes hands; it is freed with the piece */
        a->bytes = (struct bytes){(uint8_t *)x->text, x->text_bytes,
                                  (uint8_t *)x->text, x->text_capacity};
        x->text = NULL;
        x->text_capacity = 0;
    }
    x->reading = WANTS;
}

static struct host_stream stream_of(struct xml *x, enum want want) {
    static const char blank[] = " ";
    struct array *a = &x->array[want];
    const void *data = a->bytes.data != NULL ? (void *)a->bytes.data : blank;
    struct host_stream s = {.source = x->source,
                            .text = a->text,
                            .big = x->coding.big,
                            .type = a->type,
                            .at = data,
                            .end = (const uint8_t *)data + a->bytes.bytes};
    s.scan = host_scan_start(x->source->path, data, a->bytes.bytes);
    s.scan.lines_before = a->lines_before;
    return s;
}

static void piece_points(struct xml *x) {
    struct array *a = &x->array[POINTS];
    if (x->mesh->points == NULL || (!a->there && x->piece_points == 0))
        return;
    static const char wrong[] =
        "the numbers in Points are not 3 times NumberOfPoints; correct that, "
        "or get the file whole";
    uint64_t rows = x->piece_points;
    struct host_stream s = stream_of(x, POINTS);
    if (!a->there) {
        fail(x, "a piece has no Points; give them");
        return;
    }
    if (!a->text) {
        uint64_t row = 3 * host_number_bytes(a->type);
        rows = x->counted ? rows : a->bytes.bytes / row;
        if (a->bytes.bytes / row != rows || a->bytes.bytes % row != 0)
            fail(x, wrong);
    } else if (!x->counted) {
        while (x->error->code == 0 && host_scan_skip_blank_lines(&s.scan))
            host_stream_points(&s, 1, x->mesh->points, x->error);
    }
    if (x->error->code == 0)
        host_stream_points(&s, rows, x->mesh->points, x->error);
    if (x->error->code == 0 && !host_stream_ended(&s))
        fail(x, wrong);
}

static void end_piece(struct xml *x) {
    uint64_t first = x->points_before;
    x->in_piece = false;
    x->points_before += x->piece_points;
    if (x->error->code == 0)
        piece_points(x);
    if (x->error->code == 0 && x->mesh->tets != NULL && x->piece_cells > 0) {
        struct host_stream c = stream_of(x, CONNECTIVITY);
        struct host_stream o = stream_of(x, OFFSETS);
        struct host_stream t = stream_of(x, TYPES);
        if (!x->array[CONNECTIVITY].there || !x->array[OFFSETS].there ||
            !x->array[TYPES].there) {
            fail(x, "a piece has not all of connectivity, offsets and types; "
                    "give an unstructured grid");
        } else {
            host_stream_cells(&c, &o, &t, x->piece_cells, first, x->mesh->tets,
                              x->error);
            if (x->error->code == 0 &&
                !(host_stream_ended(&c) && host_stream_ended(&o) &&
                  host_stream_ended(&t))) {
                fail(x, "more cells than NumberOfCells, or more corners than "
                        "their offsets tell; correct these numbers");
            }
        }
    }
    for (int i = 0; i < WANTS; i++) {
        free_array(&x->array[i].bytes);
        x->array[i] = (struct array){0};
    }
}

static void XMLCALL end_element(void *context, const char *name) {
    struct xml *x = context;
    if (x->nested > 0)
        x->nested--;
    else if (x->reading != WANTS)
        end_array(x);
    else if (strcmp(name, "Points") == 0)
        x->in_points = false;
    else if (strcmp(name, "Cells") == 0)
        x->in_cells = false;
    else if (strcmp(name, "Piece") == 0)
        end_piece(x);
}

/* Finds the appended data, which need not be XML, and returns how many bytes
 * come before it. */
static size_t find_appended(struct xml *x) {
    const char *begin = (const char *)x->source->data;
    size_t bytes = x->source->bytes;
    const char *tag = host_source_find(x->source, "<AppendedData");
    if (tag == NULL)
        return bytes;
    size_t rest = bytes - (size_t)(tag - begin);
    const char *close = memchr(tag, '>', rest);
    const char *mark =
        close == NULL ? NULL : memchr(close, '_', rest - (size_t)(close - tag));
    if (mark != NULL) {
        x->appended = (const uint8_t *)mark + 1;
        x->appended_bytes = bytes - (size_t)(mark + 1 - begin);
        x->appended_base64 =
            memmem(tag, (size_t)(close - tag), "raw", 3) == NULL;
    }
    return (size_t)(tag - begin);
}

static void parse(struct xml *x, size_t bytes) {
    const char *at = (const char *)x->source->data;
    bool whole = bytes == x->source->bytes; /* else appended data follows */
    XML_SetUserData(x->parser, x);
    XML_SetElementHandler(x->parser, start_element, end_element);
    XML_SetCharacterDataHandler(x->parser, characters);
    while (bytes > 0 && x->error->code == 0) {
        size_t n = bytes > BLOCK ? BLOCK : bytes;
        if (XML_Parse(x->parser, at, (int)n, whole && n == bytes) !=
            XML_STATUS_OK) {
            char text[160];
            (void)snprintf(text, sizeof text, "%s; correct the XML",
                           XML_ErrorString(XML_GetErrorCode(x->parser)));
            fail(x, text);
        }
        host_call_trim(n);
        at += n;
        bytes -= n;
    }
    if (x->error->code == 0 && !x->any_piece) {
        fail(x, "there is no Piece; the file is cut short or no VTK file of "
                "points");
    }
    if (x->error->code == 0 && x->in_piece)
        fail(x, "the file ends within a piece; it is cut short, get it whole");
}

static int read_vtkxml(const struct host_source *source, struct host_mesh *mesh,
                       struct host_error *error) {
    struct xml x = {.source = source,
                    .mesh = mesh,
                    .error = error,
                    .parser = XML_ParserCreate(NULL),
                    .reading = WANTS};
    if (x.parser == NULL)
        return host_fail_memory(error, "the XML parser");
    size_t bytes = find_appended(&x);
    parse(&x, bytes);
    x.piece_points = x.piece_cells = 0;
    end_piece(&x); /* frees what an error left behind */
    XML_ParserFree(x.parser);
    host_unmap(x.text, x.text_capacity);
    return error->code;
}

/* .vtu and .vtp: one cell a point, so that ParaView shows them. */
static void write_cells_of_points(struct host_output *out,
                                  const struct host_points *points,
                                  bool polydata) {
    uint64_t n = points->count;
    host_output_text(out, "<?xml version=\"1.0\"?>\n<VTKFile type=\"");
    host_output_text(out, polydata ? "PolyData" : "UnstructuredGrid");
    host_output_text(out, "\" version=\"1.0\" byte_order=\"LittleEndian\" "
                          "header_type=\"UInt64\">\n<");
    host_output_text(out, polydata ? "PolyData" : "UnstructuredGrid");
    host_put_line(out, ">\n<Piece NumberOfPoints=\"", n,
                  polydata ? "\" NumberOfVerts=\"" : "\" NumberOfCells=\"");
    host_put_line(
        out, "", n,
        "\">\n<Points>\n<DataArray type=\"Float64\" Name=\"Points\" "
        "NumberOfComponents=\"3\" format=\"appended\" offset=\"0\"/>\n"
        "</Points>\n");
    host_output_text(out, polydata ? "<Verts>\n" : "<Cells>\n");
    host_put_line(
        out,
        "<DataArray type=\"Int64\" Name=\"connectivity\" format=\"appended\" "
        "offset=\"",
        8 + 24 * n, "\"/>\n");
    host_put_line(
        out,
        "<DataArray type=\"Int64\" Name=\"offsets\" format=\"appended\" "
        "offset=\"",
        16 + 32 * n, "\"/>\n");
    if (!polydata) {
        host_put_line(
            out,
            "<DataArray type=\"UInt8\" Name=\"types\" format=\"appended\" "
            "offset=\"",
            24 + 40 * n, "\"/>\n");
    }
    host_output_text(out, polydata ? "</Verts>\n</Piece>\n</PolyData>\n"
                                   : "</Cells>\n</Piece>\n"
                                     "</UnstructuredGrid>\n");
    host_output_text(out, "<AppendedData encoding=\"raw\">\n_");
    host_put_whole(out, 24 * n, 8, false);
    for (uint64_t i = 0; i < 3 * n; i++)
        host_put_double(out, points->xyz[i], false);
    for (uint64_t array = 0; array < 2; array++) {
        host_put_whole(out, 8 * n, 8, false);
        for (uint64_t i = 0; i < n; i++)
            host_put_whole(out, i + array, 8, false);
    }
    host_put_whole(out, n, 8, false);
    for (uint64_t i = 0; i < n && !polydata; i++)
        host_put_whole(out, 1, 1, false); /* VTK_VERTEX */
    host_output_text(out, "\n</AppendedData>\n</VTKFile>\n");
}

static void write_vtu(struct host_output *out,
                      const struct host_points *points) {
    write_cells_of_points(out, points, false);
}

static void write_vtp(struct host_output *out,
                      const struct host_points *points) {
    write_cells_of_points(out, points, true);
}

/* Appended raw data: what ParaView loads fastest. */
static int write_tetrahedra(struct host_output *out, struct host_output *beside,
                            const struct host_points *points,
                            const struct host_tetrahedra *tets,
                            struct host_error *error) {
    (void)beside;
    uint64_t m = tets->count, n = points->count;
    size_t word = 4 * m < INT32_MAX && n < INT32_MAX ? 4 : 8;
    const char *type = word == 4 ? "Int32" : "Int64";
    uint64_t bytes[4] = {24 * n, 4 * m * word, m * word, m};
    uint64_t at[3] = {8 + bytes[0]}; /* past a length and its bytes */
    at[1] = at[0] + 8 + bytes[1];
    at[2] = at[1] + 8 + bytes[2];
    char text[1600];
    (void)snprintf(
        text, sizeof text,
        "<?xml version=\"1.0\"?>\n"
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
        "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n"
        "<UnstructuredGrid>\n"
        "<Piece NumberOfPoints=\"%llu\" NumberOfCells=\"%llu\">\n"
        "<Points>\n<DataArray type=\"Float64\" Name=\"Points\" "
        "NumberOfComponents=\"3\" format=\"appended\" offset=\"0\"/>\n"
        "</Points>\n<Cells>\n"
        "<DataArray type=\"%s\" Name=\"connectivity\" format=\"appended\" "
        "offset=\"%llu\"/>\n"
        "<DataArray type=\"%s\" Name=\"offsets\" format=\"appended\" "
        "offset=\"%llu\"/>\n"
        "<DataArray type=\"UInt8\" Name=\"types\" format=\"appended\" "
        "offset=\"%llu\"/>\n"
        "</Cells>\n</Piece>\n</UnstructuredGrid>\n"
        "<AppendedData encoding=\"raw\">\n_",
        (unsigned long long)n, (unsigned long long)m, type,
        (unsigned long long)at[0], type, (unsigned long long)at[1],
        (unsigned long long)at[2]);
    host_output_text(out, text);
    host_put_whole(out, bytes[0], 8, false);
    for (uint64_t i = 0; i < 3 * n; i++)
        host_put_double(out, points->xyz[i] + 0.0, false);
    host_put_whole(out, bytes[1], 8, false);
    for (uint64_t i = 0; i < m; i++)
        for (int k = 0; k < 4; k++)
            host_put_whole(out, tets->v[i][k], word, false);
    host_put_whole(out, bytes[2], 8, false);
    for (uint64_t i = 0; i < m; i++)
        host_put_whole(out, 4 * (i + 1), word, false);
    host_put_whole(out, bytes[3], 8, false);
    for (uint64_t i = 0; i < m; i++)
        host_output_bytes(out, "\x0a", 1); /* VTK_TETRA */
    host_output_text(out, "\n</AppendedData>\n</VTKFile>\n");
    return error->code;
}

const struct host_format host_format_vtu = {
    .name = "VTK XML",
    .extensions = {".vtu"},
    .read_points = read_vtkxml,
    .read_tetrahedra = read_vtkxml,
    .write_points = write_vtu,
    .write_tetrahedra = write_tetrahedra,
};

const struct host_format host_format_vtp = {
    .name = "VTK XML",
    .extensions = {".vtp"},
    .read_points = read_vtkxml,
    .write_points = write_vtp,
};

const struct host_format host_format_vts = {
    .name = "VTK XML",
    .extensions = {".vts"},
    .read_points = read_vtkxml,
};
