#include "lists.h"

#include <string.h>

#include "incode/paper/list.h"
#include "incode/predicates/check.h"
#include "node/common.h"

size_t node_lists_bytes(uint32_t places) {
    return node_aligned(NODE_OUTBOX_BYTES(places));
}

void node_lists_init(struct node_lists *lists, void *memory, uint32_t places,
                     uint8_t sends, uint32_t each_max,
                     struct node_counted *counted, struct node_fault *fault) {
    INCODE_ASSERT(places >= 1 && each_max >= 1 && each_max <= UINT8_MAX);
    memset(lists, 0, sizeof *lists);
    lists->counted = counted;
    lists->fault = fault;
    lists->sends = sends;
    lists->each_max = each_max;
    node_outbox_init(&lists->inbox, memory, places);
}

void node_lists_add(struct node_lists *lists, uint16_t peer) {
    INCODE_ASSERT(lists->peers < NODE_BUILDERS_MAX);
    lists->peer[lists->peers++] = peer;
}

/* ---- the carrier ---- */

/* The builder with the fewest lists whose link has room; NODE_BUILDERS_MAX:
 * none may have one more. */
static uint32_t idlest(const struct node_lists *l) {
    uint32_t best = NODE_BUILDERS_MAX, least = l->each_max;
    if (l->out + l->inbox.used >= l->inbox.slot_count)
        return best;
    for (uint32_t k = 0; k < l->peers && least > 0; k++) {
        uint32_t i =
            l->next + k < l->peers ? l->next + k : l->next + k - l->peers;
        if (l->owed[i] < least && cube_room(l->counted->cube, l->peer[i]) > 0) {
            least = l->owed[i];
            best = i;
        }
    }
    return best;
}

static bool has_room(void *context) {
    struct node_lists *l = context;
    if (l->sends == NODE_ANSWERS)
        return cube_room(l->counted->cube, l->peer[0]) > 0;
    return idlest(l) < NODE_BUILDERS_MAX;
}

static void send(void *context, const void *data, size_t size) {
    struct node_lists *l = context;
    uint32_t i = l->sends == NODE_ANSWERS ? 0 : idlest(l);
    INCODE_ASSERT(i < l->peers);
    node_counted_put(l->counted, l->peer[i], l->sends, data, size);
    l->bytes_out += size;
    if (l->sends == NODE_LIST) {
        l->owed[i]++;
        l->out++;
        l->next = i + 1 < l->peers ? i + 1 : 0;
    }
}

static const void *first(void *context, size_t *size) {
    const struct node_lists *l = context;
    const struct node_outbox_slot *slot = node_outbox_first(&l->inbox);
    if (slot == NULL)
        return NULL;
    *size = slot->size;
    return slot->data;
}

static void drop(void *context) {
    struct node_lists *l = context;
    node_outbox_drop(&l->inbox);
}

struct node_carrier node_lists_carrier(struct node_lists *lists) {
    return (struct node_carrier){lists, has_room, send, first, drop};
}

/* ---- what comes ---- */

static uint32_t find(const struct node_lists *l, uint16_t peer) {
    uint32_t i = 0;
    while (i < l->peers && l->peer[i] != peer)
        i++;
    return i;
}

/* Its size is what its number of faces or answers takes. */
static bool is_whole(const struct node_lists *l,
                     const struct cube_message *message) {
    uint32_t head[2];
    if (message->size < sizeof head)
        return false;
    memcpy(head, message->data, sizeof head);
    return head[1] <= INCODE_LIST_MAX &&
           message->size == (l->sends == NODE_LIST
                                 ? incode_answers_bytes(head[1])
                                 : incode_list_bytes(head[1]));
}

void node_lists_take(struct node_lists *lists,
                     const struct cube_message *message) {
    struct node_lists *l = lists;
    uint32_t i = find(l, message->source);
    if (i == l->peers) {
        node_fault_set(l->fault,
                       "list or answers from node #, which is none "
                       "of its peers",
                       message->source, 0);
        return;
    }
    if (!is_whole(l, message)) {
        node_fault_set(l->fault, "list or answers of # bytes from node #",
                       message->size, message->source);
        return;
    }
    if ((l->sends == NODE_LIST && l->owed[i] == 0) ||
        node_outbox_free(&l->inbox) == 0) {
        node_fault_set(l->fault,
                       "list or answers from node #, more than # are due",
                       message->source, l->inbox.used);
        return;
    }
    l->bytes_in += message->size;
    if (l->sends == NODE_LIST) {
        l->owed[i]--;
        l->out--;
    }
    uint8_t *data = node_outbox_open(&l->inbox);
    memcpy(data, message->data, message->size);
    if (l->sends == NODE_LIST) { /* whatever the message says */
        memcpy(data + offsetof(struct incode_answers, builder),
               &message->source, sizeof message->source);
    }
    node_outbox_close(&l->inbox, message->type, message->size);
}

uint16_t node_lists_owing(const struct node_lists *lists) {
    for (uint32_t i = 0; i < lists->peers; i++)
        if (lists->owed[i] > 0)
            return lists->peer[i];
    return CUBE_HOST;
}

uint32_t node_lists_held(const struct node_lists *lists) {
    return lists->inbox.used;
}
