/* Wrong wires in words. */
#include "cube_internal.h"
#include "text.h"

static void say_end(struct cube_text *t, const char *before, unsigned node) {
    cube_text_put(t, before);
    if (node == CUBE_HOST) {
        cube_text_put(t, "the host");
    } else {
        cube_text_put(t, "node ");
        cube_text_number(t, node);
    }
}

static void say_link(struct cube_text *t, const char *before, unsigned link) {
    cube_text_put(t, before);
    cube_text_put(t, "link ");
    cube_text_number(t, link);
}

static void say_why(struct cube_text *t, unsigned refusal, unsigned dimension) {
    if (refusal == LINK_WRONG_VERSION) {
        cube_text_put(t, " has another protocol version, expected ");
        cube_text_number(t, LINK_VERSION);
    } else if (refusal == LINK_WRONG_GREETING) {
        cube_text_put(t, " has another cube dimension, expected ");
        cube_text_number(t, dimension);
    } else {
        cube_text_put(t, " has other sizes of frames or messages");
    }
}

void cube_wrong_text(const struct cube_wrong *wrong,
                     const struct cube_config *config,
                     char text[CUBE_FAULT_BYTES]) {
    struct cube_text t = cube_text_in(text, CUBE_FAULT_BYTES);
    struct link_end peer = cube_peer_of(config, wrong->node, wrong->link);
    say_end(&t, "", wrong->node);
    say_link(&t, " ", wrong->link);
    if (wrong->refusal == LINK_WRONG_WIRE && wrong->peer_node != peer.node) {
        say_end(&t, " is wired to ", wrong->peer_node);
        say_end(&t, ", expected ", peer.node);
    } else if (wrong->refusal == LINK_WRONG_WIRE) {
        say_end(&t, " is wired to ", wrong->peer_node);
        say_link(&t, " ", wrong->peer_link);
        say_link(&t, ", expected ", peer.port);
    } else {
        say_end(&t, ": ", wrong->peer_node);
        say_why(&t, wrong->refusal, config->dimension);
    }
}

bool cube_wiring_fault(const struct cube *cube, char text[CUBE_FAULT_BYTES]) {
    text[0] = '\0';
    if (cube->wiring.wrong_count == 0)
        return false;
    cube_wrong_text(&cube->wiring.wrong[0], &cube->config, text);
    return true;
}
