#include "vtk_array.h"

#include <string.h>
#include <zlib.h>

#include "host/base/memory.h"
#include "rows.h"

/* A deflated byte holds at most 1,032 (zlib's own figure). */
enum { INFLATION_MAX = 1032 };

void vtk_array_free(struct vtk_array *array) {
    host_unmap(array->data, array->capacity);
    *array = (struct vtk_array){0};
}

static int reserve(struct vtk_array *array, size_t bytes,
                   struct host_error *error) {
    array->data = host_map(bytes);
    array->capacity = bytes;
    array->bytes = 0;
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
    const struct vtk_coding *coding;
    const uint8_t *from;
    size_t bytes;
};

/* The first `most` bytes of what is packed, decoded. */
static int plain(struct vtk_array *out, const struct packed *p, size_t most,
                 struct host_error *error) {
    size_t limit = p->bytes;
    if (reserve(out, most < limit ? most : limit, error) != 0)
        return error->code;
    if (p->coding->base64) {
        out->bytes = decode(p->from, p->bytes, out->data, out->capacity);
    } else {
        memcpy(out->data, p->from, out->capacity);
        out->bytes = out->capacity;
    }
    if (out->bytes < most) {
        return host_source_fail(p->source, error,
                                "an array ends before its stated length; the "
                                "file is cut short, get it whole");
    }
    return 0;
}

static uint64_t header_word(const struct vtk_array *a, size_t i,
                            const struct vtk_coding *coding) {
    enum host_number type = coding->wide_header ? HOST_U64 : HOST_U32;
    return host_whole_at(a->data + i * host_number_bytes(type), type,
                         coding->big);
}

static int damaged(const struct packed *p, struct host_error *error) {
    return host_source_fail(p->source, error,
                            "a packed array is damaged; get the file again");
}

static int inflate_blocks(struct vtk_array *out, const struct packed *p,
                          const struct vtk_array *head,
                          const struct vtk_array *in, uint64_t blocks,
                          struct host_error *error) {
    uint64_t size = header_word(head, 1, p->coding);
    uint64_t last = header_word(head, 2, p->coding);
    size_t at = head->bytes;
    for (uint64_t b = 0; b < blocks; b++) {
        uint64_t packed = header_word(head, 3 + (size_t)b, p->coding);
        uLongf n = (uLongf)(b + 1 == blocks && last != 0 ? last : size);
        uLongf expected = n;
        if (packed > in->bytes - at || n > out->capacity - out->bytes ||
            uncompress(out->data + out->bytes, &n, in->data + at,
                       (uLong)packed) != Z_OK ||
            n != expected)
            return damaged(p, error);
        at += (size_t)packed;
        out->bytes += n;
    }
    return 0;
}

/* Header: blocks, bytes a block, bytes of a last partial block, then the
 * packed bytes of each. */
static int unpack_blocks(struct vtk_array *out, const struct packed *p,
                         struct host_error *error) {
    size_t word = p->coding->wide_header ? 8 : 4;
    struct vtk_array head = {0}, in = {0};
    uint64_t blocks = 0, packed = 0;
    if (plain(&head, p, word, error) == 0) {
        blocks = header_word(&head, 0, p->coding);
        if (blocks > p->bytes / word)
            damaged(p, error);
    }
    vtk_array_free(&head);
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
    vtk_array_free(&head);
    vtk_array_free(&in);
    return error->code;
}

static int unpack_plain(struct vtk_array *out, const struct packed *p,
                        struct host_error *error) {
    size_t word = p->coding->wide_header ? 8 : 4;
    struct vtk_array head = {0};
    uint64_t bytes = 0;
    if (plain(&head, p, word, error) == 0) {
        bytes = header_word(&head, 0, p->coding);
        if (bytes > p->bytes)
            damaged(p, error);
    }
    vtk_array_free(&head);
    if (error->code == 0 && plain(out, p, word + (size_t)bytes, error) == 0) {
        memmove(out->data, out->data + word, (size_t)bytes);
        out->bytes = (size_t)bytes;
    }
    return error->code;
}

int vtk_array_unpack(struct vtk_array *array, const struct host_source *source,
                     const struct vtk_coding *coding, const uint8_t *from,
                     size_t bytes, struct host_error *error) {
    struct packed p = {source, coding, from, bytes};
    if (coding->base64) { /* leading blanks of inline data */
        while (p.bytes > 0 && (*p.from == ' ' || *p.from == '\n' ||
                               *p.from == '\r' || *p.from == '\t')) {
            p.from++;
            p.bytes--;
        }
    }
    *array = (struct vtk_array){0};
    if (coding->compressed)
        return unpack_blocks(array, &p, error);
    return unpack_plain(array, &p, error);
}
