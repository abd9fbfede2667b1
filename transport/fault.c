/* Wrong wires in words. */
#include "cube_internal.h"

struct words {
    char *text;
    unsigned size;
};

static void say(struct words *w, const char *text)
{
    while (*text != '\0' && w->size + 1 < CUBE_FAULT_BYTES) {
        w->text[w->size++] = *text++;
    }
    w->text[w->size] = '\0';
}

static void say_number(struct words *w, unsigned number)
{
    char digits[11];
    unsigned at = sizeof digits - 1;
    digits[at] = '\0';
    do {
        digits[--at] = (char)('0' + number % 10);
        number /= 10;
    } while (number > 0);
    say(w, digits + at);
}

static void say_end(struct words *w, const char *before, unsigned node)
{
    say(w, before);
    if (node == CUBE_HOST) {
        say(w, "the host");
    } else {
        say(w, "node ");
        say_number(w, node);
    }
}

static void say_link(struct words *w, const char *before, unsigned link)
{
    say(w, before);
    say(w, "link ");
    say_number(w, link);
}

void cube_wrong_text(const struct cube_wrong *wrong, unsigned dimension,
                     uint16_t spare_node, char text[CUBE_FAULT_BYTES])
{
    struct words w;
    w.text = text;
    w.size = 0;
    bool host = wrong->node == CUBE_HOST;
    bool to_host = !host && wrong->link >= dimension;
    unsigned node =
        host ? wrong->link == 0 || spare_node == 0 ? wrong->link : spare_node
        : to_host ? CUBE_HOST
                  : wrong->node ^ 1u << wrong->link;
    unsigned link = host ? dimension : to_host ? wrong->node != 0 : wrong->link;
    say_end(&w, "", wrong->node);
    say_link(&w, " ", wrong->link);
    if (wrong->refusal == LINK_WRONG_WIRE && wrong->peer_node != node) {
        say_end(&w, " is wired to ", wrong->peer_node);
        say_end(&w, ", expected ", node);
    } else if (wrong->refusal == LINK_WRONG_WIRE) {
        say_end(&w, " is wired to ", wrong->peer_node);
        say_link(&w, " ", wrong->peer_link);
        say_link(&w, ", expected ", link);
    } else {
        say_end(&w, ": ", wrong->peer_node);
        say(&w, wrong->refusal == LINK_WRONG_VERSION
                    ? " speaks another version of the protocol"
                : wrong->refusal == LINK_WRONG_GREETING
                    ? " is set to a cube of another dimension"
                    : " has other sizes of frames or messages");
    }
}

bool cube_wiring_fault(const struct cube *cube, char text[CUBE_FAULT_BYTES])
{
    text[0] = '\0';
    if (cube->wiring.wrong_count == 0) {
        return false;
    }
    cube_wrong_text(&cube->wiring.wrong[0], cube->config.dimension,
                    cube->config.spare_node, text);
    return true;
}
