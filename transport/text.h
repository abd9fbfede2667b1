/* Builds a text of bounded size from words and numbers, for messages to a user,
 * without stdio. */
#ifndef TRANSPORT_TEXT_H
#define TRANSPORT_TEXT_H

#include <stddef.h>
#include <stdint.h>

struct cube_text {
    char *data; /* ends with a 0 at data[size] */
    size_t size, size_max;
};

/* An empty text in bytes_max bytes, at least 1, the final 0 included. */
struct cube_text cube_text_in(char *data, size_t bytes_max);

/* Appends as much as there is room for. */
void cube_text_put(struct cube_text *text, const char *words);
void cube_text_number(struct cube_text *text, uint32_t number);

/* The same for words from outside: a name, a file, a peer.  Bytes that a
 * terminal would not print as they are (controls, marks of the direction of
 * writing, invalid UTF-8) become \xNN; other characters stay.  Ends before the
 * first character that does not fit. */
void cube_text_printable(struct cube_text *text, const char *words);

/* Bytes of the first of `words` that is shown as it is; 0: it is not. */
size_t cube_text_shown(const char *words);

#endif
