#include "text.h"

#include <stdarg.h>
#include <stdbool.h>
#include <string.h>

#include "transport/text.h"

void host_text_printable(char *out, size_t size, const char *text)
{
    struct cube_text printable = cube_text_in(out, size);
    cube_text_printable(&printable, text);
}

/* --- for a shell ---------------------------------------------------------- */

/* What no shell reads as anything but itself; zsh reads = at the start. */
static bool is_plain(const char *text)
{
    static const char plain[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                "abcdefghijklmnopqrstuvwxyz"
                                "0123456789_@%+:,./-=";
    return text[0] != '\0' && text[0] != '=' &&
           text[strspn(text, plain)] == '\0';
}

struct quoting {
    char *out;
    size_t size, used; /* used > size: it does not fit */
    bool open;         /* within '..' */
};

static void put(struct quoting *q, const char *words, size_t bytes)
{
    if (q->used + bytes < q->size) {
        memcpy(q->out + q->used, words, bytes);
        q->used += bytes;
    } else {
        q->used = q->size;
    }
}

static void set_open(struct quoting *q, bool open)
{
    if (q->open != open) {
        put(q, "'", 1);
        q->open = open;
    }
}

/* The bytes of one character, of which a terminal would obey some.  `$'..'` is
 * younger than most shells: printf makes them. */
static void put_character(struct quoting *q, const char *at, size_t bytes,
                          bool shown)
{
    char octal[sizeof "\"$(printf '\\377')\""];
    if (*at == '\'') {
        set_open(q, false);
        put(q, "\\'", 2);
        return;
    }
    set_open(q, shown || *at == '\n');
    if (q->open) {
        put(q, at, bytes);
        return;
    }
    for (size_t i = 0; i < bytes; i++) {
        put(q, octal,
            (size_t)snprintf(octal, sizeof octal, "\"$(printf '\\%03o')\"",
                             (unsigned)(unsigned char)at[i]));
    }
}

int host_text_quote(char *out, size_t size, const char *text)
{
    struct quoting q = {out, size, 0, false};
    bool plain = is_plain(text);
    if (plain || *text == '\0') {
        put(&q, plain ? text : "''", plain ? strlen(text) : 2);
    }
    while (!plain && *text != '\0') {
        size_t shown = cube_text_shown(text);
        put_character(&q, text, shown > 0 ? shown : 1, shown > 0);
        text += shown > 0 ? shown : 1;
    }
    set_open(&q, false);
    bool fits = q.used < size;
    out[fits ? q.used : 0] = '\0';
    return fits ? 0 : -1;
}

/* --- for a terminal --------------------------------------------------------
 */

void host_say(FILE *stream, const char *format, ...)
{
    char raw[HOST_SAY_BYTES], line[HOST_SAY_BYTES];
    size_t size = strlen(format);
    bool ends = size > 0 && format[size - 1] == '\n';
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(raw, sizeof raw, format, arguments);
    va_end(arguments);
    size = strlen(raw);
    if (ends && raw[size - 1] == '\n') {
        raw[size - 1] = '\0';
    }
    host_text_printable(line, sizeof line, raw);
    (void)fprintf(stream, "%s%s", line, ends ? "\n" : "");
}
