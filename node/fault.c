#include "fault.h"

#include "transport/text.h"

void node_fault_set(struct node_fault *fault, const char *words, uint32_t a,
                    uint32_t b) {
    struct cube_text text;
    if (node_fault_is_set(fault)) {
        return;
    }
    text = cube_text_in(fault->text, sizeof fault->text);
    for (uint32_t figure = a; *words != '\0'; words++) {
        char character[2] = {*words, '\0'};
        if (*words == '#') {
            cube_text_number(&text, figure);
            figure = b;
        } else {
            cube_text_put(&text, character);
        }
    }
    fault->size = text.size;
}
