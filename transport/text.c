#include "text.h"

#include <stdbool.h>
#include <string.h>

struct cube_text cube_text_in(char *data, size_t bytes_max) {
    struct cube_text text = {data, 0, bytes_max - 1};
    data[0] = '\0';
    return text;
}

void cube_text_put(struct cube_text *text, const char *words) {
    while (*words != '\0' && text->size < text->size_max)
        text->data[text->size++] = *words++;
    text->data[text->size] = '\0';
}

void cube_text_number(struct cube_text *text, uint32_t number) {
    char digits[11];
    unsigned at = sizeof digits - 1;
    digits[at] = '\0';
    do {
        digits[--at] = (char)('0' + number % 10);
        number /= 10;
    } while (number > 0);
    cube_text_put(text, digits + at);
}

static bool is_obeyed(uint32_t code) {
    return code < 0x20 || (code >= 0x7f && code < 0xa0) || code == 0x61c ||
           code == 0x200e || code == 0x200f ||
           (code >= 0x2028 && code <= 0x202e) ||
           (code >= 0x2066 && code <= 0x2069);
}

/* UTF-8 as RFC 3629 has it: the shortest form, no surrogates, nothing past
 * U+10FFFF. */
size_t cube_text_shown(const char *words) {
    const uint8_t *at = (const uint8_t *)words;
    static const uint32_t least[] = {0, 0x80, 0x800, 0x10000};
    size_t more = at[0] < 0x80   ? 0
                  : at[0] < 0xc0 ? 4
                  : at[0] < 0xe0 ? 1
                  : at[0] < 0xf0 ? 2
                  : at[0] < 0xf8 ? 3
                                 : 4;
    if (more == 4)
        return 0;
    uint32_t code = more == 0 ? at[0] : at[0] & (0x3fu >> more);
    for (size_t i = 1; i <= more; i++) {
        if ((at[i] & 0xc0) != 0x80) /* the final 0 as well */
            return 0;
        code = code << 6 | (at[i] & 0x3f);
    }
    bool valid = code >= least[more] && code <= 0x10ffff &&
                 (code < 0xd800 || code > 0xdfff);
    return valid && !is_obeyed(code) ? more + 1 : 0;
}

void cube_text_printable(struct cube_text *text, const char *words) {
    static const char digits[] = "0123456789abcdef";
    while (*words != '\0') {
        unsigned byte = (unsigned char)*words;
        const char escape[4] = {'\\', 'x', digits[byte >> 4],
                                digits[byte & 15]};
        size_t shown = cube_text_shown(words);
        size_t bytes = shown > 0 ? shown : sizeof escape;
        if (bytes > text->size_max - text->size)
            break;
        memcpy(text->data + text->size, shown > 0 ? words : escape, bytes);
        text->size += bytes;
        words += shown > 0 ? shown : 1;
    }
    text->data[text->size] = '\0';
}
