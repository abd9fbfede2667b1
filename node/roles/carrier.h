/* What carries lists of faces from a face manager to tetrahedron builders, and
 * answers back: messages from node to node (lists.h), or a tuple space.  Each
 * end sees the same: a manager sends struct incode_list and is sent struct
 * incode_answers, a builder the other way round, as many bytes of them as are
 * in use (incode/paper/list.h).
 *
 * Memory: the struct.  Work: every function returns at once.
 *
 *     while (carrier.has_room(carrier.context) && lend(&list))
 *         carrier.send(carrier.context, &list, incode_list_bytes(list.count));
 *     while ((data = carrier.first(carrier.context, &size)) != NULL)
 *         carrier.drop(carrier.context);   // and use it before
 */
#ifndef NODE_CARRIER_H
#define NODE_CARRIER_H

#include <stdbool.h>
#include <stddef.h>

struct node_carrier {
    void *context;
    /* Whether it takes something to send now.  It must have room for what is
     * sent back before it does. */
    bool (*has_room)(void *context);
    /* Sends, where it has room. */
    void (*send)(void *context, const void *data, size_t size);
    /* What was sent to this end and waits, one of them: the same until it is
     * dropped; NULL: nothing. */
    const void *(*first)(void *context, size_t *size);
    void (*drop)(void *context);
};

#endif
