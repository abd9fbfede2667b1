#include "collect.h"

#include <string.h>

#include "transport/check.h"

enum { BROADCAST = NCUBE_INNER, GATHER, REDUCE, BARRIER_COME, BARRIER_GO };

static unsigned relative(const struct ncube *n, unsigned root) {
    LINK_ASSERT(n->config.self < 1u << n->config.dimension &&
                root < 1u << n->config.dimension);
    return n->config.self ^ root;
}

/* Children of a node that is `relative` to the root: those with one bit more,
 * below its lowest. */
static unsigned children(const struct ncube *n, unsigned relative) {
    return relative == 0 ? n->config.dimension
                         : (unsigned)__builtin_ctz(relative);
}

static size_t least(size_t a, size_t b) {
    return a < b ? a : b;
}

/* --- pieces of a message ------------------------------------------------- */

struct piece {
    uint8_t *into;
    size_t expected;
    bool right;
    void (*combine)(void *into, const void *from, size_t bytes);
};

static void take(void *context, const uint8_t *data, size_t size) {
    struct piece *piece = context;
    piece->right = size == piece->expected;
    if (!piece->right || size == 0) {
        return;
    }
    if (piece->combine != NULL) {
        piece->combine(piece->into, data, size);
    } else {
        memcpy(piece->into, data, size);
    }
}

static int receive(struct ncube *n, unsigned from, int type,
                   struct piece *piece) {
    int source = (int)from;
    struct ncube_sink sink = {take, piece};
    if (ncube_receive(n, &source, &type, &sink) != 0) {
        return -1;
    }
    if (!piece->right) {
        n->failure = NCUBE_NOT_SOUND; /* the nodes disagree on the size */
        return -1;
    }
    return 0;
}

/* One message at least, so that what is empty arrives too. */
static int receive_all(struct ncube *n, unsigned from, int type, uint8_t *data,
                       size_t size, size_t most,
                       void (*combine)(void *, const void *, size_t)) {
    size_t done = 0;
    do {
        struct piece piece = {NULL, least(size - done, most), false, combine};
        piece.into = data + done;
        if (receive(n, from, type, &piece) != 0) {
            return -1;
        }
        done += piece.expected;
    } while (done < size);
    return 0;
}

static int send_all(struct ncube *n, unsigned to, unsigned type,
                    const uint8_t *data, size_t size, size_t most) {
    size_t done = 0;
    do {
        size_t part = least(size - done, most);
        if (ncube_send(n, data + done, part, to, type) != 0) {
            return -1;
        }
        done += part;
    } while (done < size);
    return 0;
}

/* --- what all do --------------------------------------------------------- */

/* The largest subtree first. */
static int send_to_children(struct ncube *n, unsigned root, unsigned type,
                            const uint8_t *data, size_t size) {
    unsigned self = relative(n, root);
    for (unsigned k = children(n, self); k-- > 0;) {
        if (ncube_send(n, data, size, root ^ (self | 1u << k), type) != 0) {
            return -1;
        }
    }
    return 0;
}

/* Not the cube's own message to all: on its way it may pass by others that a
 * neighbour wrote before, and so stand before what is asked for. */
int ncube_broadcast(struct ncube *n, unsigned root, void *data, size_t size) {
    unsigned self = relative(n, root);
    uint8_t *bytes = data;
    size_t done = 0;
    do {
        struct piece piece = {bytes + done, least(size - done, NCUBE_BYTES_MAX),
                              false, NULL};
        if (self != 0 &&
            receive(n, root ^ (self & (self - 1)), BROADCAST, &piece) != 0) {
            return -1;
        }
        if (send_to_children(n, root, BROADCAST, piece.into, piece.expected) !=
            0) {
            return -1;
        }
        done += piece.expected;
    } while (done < size);
    return 0;
}

static void hold(void *context, const uint8_t *data, size_t size) {
    struct piece *piece = context;
    memcpy(piece->into, data, size);
    piece->expected = size;
}

/* All pieces of the nodes below child k go on to the parent, in order. */
static int pass_on(struct ncube *n, unsigned child, unsigned parent,
                   size_t pieces) {
    for (size_t i = 0; i < pieces; i++) {
        struct piece piece = {n->out + NCUBE_HEAD, 0, true, NULL};
        struct ncube_sink sink = {hold, &piece};
        int source = (int)child, type = GATHER;
        if (ncube_receive(n, &source, &type, &sink) != 0 ||
            ncube_send(n, piece.into, piece.expected, parent, GATHER) != 0) {
            return -1;
        }
    }
    return 0;
}

/* A node sends its own bytes, then those of its first child's subtree, of the
 * second's, ..: so they come in ascending order of the numbers relative to the
 * root. */
int ncube_gather(struct ncube *n, unsigned root, const void *own, size_t size,
                 void *all) {
    unsigned self = relative(n, root), count = children(n, self);
    unsigned parent = root ^ (self & (self - 1));
    size_t pieces =
        size == 0 ? 1 : (size + NCUBE_BYTES_MAX - 1) / NCUBE_BYTES_MAX;
    uint8_t *rows = all;
    int status = 0;
    if (self == 0 && size > 0) {
        memcpy(rows + root * size, own, size);
    }
    if (self != 0) {
        status = send_all(n, parent, GATHER, own, size, NCUBE_BYTES_MAX);
    }
    for (unsigned k = 0; k < count && status == 0; k++) {
        unsigned below = 1u << k, child = root ^ (self | below);
        if (self != 0) {
            status = pass_on(n, child, parent, below * pieces);
            continue;
        }
        for (unsigned i = 0; i < below && status == 0; i++) {
            status = receive_all(n, child, GATHER,
                                 rows + (root ^ (below + i)) * size, size,
                                 NCUBE_BYTES_MAX, NULL);
        }
    }
    return status;
}

int ncube_reduce(struct ncube *n, unsigned root, void *data, size_t size,
                 size_t element,
                 void (*combine)(void *into, const void *from, size_t bytes)) {
    unsigned self = relative(n, root), count = children(n, self);
    LINK_ASSERT(element >= 1 && element <= NCUBE_BYTES_MAX);
    size_t most = NCUBE_BYTES_MAX / element * element;
    for (unsigned k = 0; k < count; k++) {
        unsigned child = root ^ (self | 1u << k);
        if (receive_all(n, child, REDUCE, data, size, most, combine) != 0) {
            return -1;
        }
    }
    return self == 0 ? 0
                     : send_all(n, root ^ (self & (self - 1)), REDUCE, data,
                                size, most);
}

int ncube_barrier(struct ncube *n) {
    unsigned self = relative(n, 0), count = children(n, self);
    struct piece nothing = {NULL, 0, false, NULL};
    for (unsigned k = 0; k < count; k++) {
        if (receive(n, self | 1u << k, BARRIER_COME, &nothing) != 0) {
            return -1;
        }
    }
    if (self != 0 &&
        (ncube_send(n, NULL, 0, self & (self - 1), BARRIER_COME) != 0 ||
         receive(n, self & (self - 1), BARRIER_GO, &nothing) != 0)) {
        return -1;
    }
    return send_to_children(n, 0, BARRIER_GO, NULL, 0);
}
