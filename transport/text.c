#include "text.h"

struct cube_text cube_text_in(char *data, size_t bytes_max)
{
    struct cube_text text = {data, 0, bytes_max - 1};
    data[0] = '\0';
    return text;
}

void cube_text_put(struct cube_text *text, const char *words)
{
    while (*words != '\0' && text->size < text->size_max) {
        text->data[text->size++] = *words++;
    }
    text->data[text->size] = '\0';
}

void cube_text_number(struct cube_text *text, uint32_t number)
{
    char digits[11];
    unsigned at = sizeof digits - 1;
    digits[at] = '\0';
    do {
        digits[--at] = (char)('0' + number % 10);
        number /= 10;
    } while (number > 0);
    cube_text_put(text, digits + at);
}
