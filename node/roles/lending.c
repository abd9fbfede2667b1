#include "lending.h"

#include <string.h>

#include "incode/predicates/check.h"
#include "node/common.h"

static uint32_t queue_max(uint32_t nodes) {
    return (nodes - 1) * NODE_PAGES_LENT_MAX;
}

static size_t queue_bytes(uint32_t nodes) {
    return node_aligned(queue_max(nodes) * sizeof(struct node_lent));
}

size_t node_lending_bytes(uint32_t nodes) {
    return queue_bytes(nodes) + node_aligned(nodes);
}

void node_lending_init(struct node_lending *lending, void *memory,
                       const struct node_setup_message *setup,
                       const struct node_shares *shares,
                       struct node_counted *counted, struct node_fault *fault) {
    struct node_lending *l = lending;
    const struct incode_setup *points = &setup->setup;
    memset(l, 0, sizeof *l);
    l->counted = counted;
    l->fault = fault;
    l->shares = shares;
    incode_tree_init(&l->tree, points->bricks,
                     points->cells[0] * points->cells[1] * points->cells[2]);
    l->to_all = l->next = l->tree.pages;
    l->queue = memory;
    l->queue_max = queue_max(setup->nodes);
    l->asked = (uint8_t *)memory + queue_bytes(setup->nodes);
    memset(l->asked, 0, setup->nodes);
}

void node_lending_to_all(struct node_lending *lending, uint32_t first) {
    if (first > lending->tree.pages) {
        node_fault_set(lending->fault, "page # to all, of # pages", first,
                       lending->tree.pages);
        return;
    }
    lending->to_all = first;
}

/* ---- whose a page is ---- */

/* The uniform grid's lists are the host's. */
static uint16_t owner_of(const struct node_lending *l, uint32_t page) {
    uint32_t level = incode_tree_level(&l->tree, page);
    if (level == l->tree.levels)
        return CUBE_HOST;
    uint64_t brick = page - l->tree.base[level];
    for (uint32_t i = 0; i < level; i++)
        brick *= INCODE_FANOUT;
    return node_shares_owner(l->shares, (uint32_t)brick);
}

uint16_t node_lending_keeper(const struct node_lending *lending,
                             uint32_t page) {
    if (page >= lending->to_all && page < lending->next)
        return NODE_LENDING_COMES;
    uint16_t owner = owner_of(lending, page);
    return owner == lending->counted->self ? CUBE_HOST : owner;
}

uint32_t node_lending_room(const struct node_lending *lending,
                           uint16_t keeper) {
    return keeper == CUBE_HOST
               ? NODE_PAGES_IN_FLIGHT_MAX
               : (uint32_t)NODE_PAGES_LENT_MAX - lending->asked[keeper];
}

void node_lending_asked(struct node_lending *lending, uint16_t keeper,
                        uint32_t pages) {
    if (keeper != CUBE_HOST)
        lending->asked[keeper] = (uint8_t)(lending->asked[keeper] + pages);
}

void node_lending_came(struct node_lending *lending, uint32_t page) {
    uint16_t keeper = page < lending->tree.pages ? owner_of(lending, page)
                                                 : lending->counted->self;
    if (keeper != CUBE_HOST && keeper != lending->counted->self &&
        lending->asked[keeper] > 0)
        lending->asked[keeper]--;
}

/* ---- what others ask for ---- */

void node_lending_take(struct node_lending *lending,
                       const struct cube_message *message) {
    struct node_lending *l = lending;
    uint32_t page;
    if (message->size % sizeof page != 0 || message->source == CUBE_HOST) {
        node_fault_set(l->fault, "request in # bytes from node #",
                       message->size, message->source);
        return;
    }
    for (size_t at = 0; at < message->size; at += sizeof page) {
        memcpy(&page, message->data + at, sizeof page);
        if (!node_shares_ready(l->shares) || page >= l->tree.pages ||
            owner_of(l, page) != l->counted->self) {
            node_fault_set(l->fault, "request for page #, which node # has not",
                           page, l->counted->self);
            return;
        }
        if (l->queued == l->queue_max) {
            node_fault_set(l->fault, "more than # pages requested at a time",
                           l->queue_max, 0);
            return;
        }
        l->queue[l->queued++] = (struct node_lent){page, message->source};
    }
}

/* Pages to all come in order, so the number of an altered one is known. */
uint32_t node_lending_take_to_all(struct node_lending *lending,
                                  struct node_page_check *check,
                                  struct incode_triangulator *triangulator,
                                  const struct cube_message *message) {
    struct node_lending *l = lending;
    struct node_page page;
    bool right = node_page_check_take(check, message, &page);
    if (right && (page.number < l->to_all || page.number + 1 != l->next)) {
        node_fault_set(l->fault, "page # to all, expected the one below #",
                       page.number, l->next);
    }
    if (node_fault_is_set(l->fault) || l->next == l->to_all)
        return INCODE_NONE;
    l->next--;
    if (!right)
        return l->next;
    if (incode_triangulator_put(triangulator, page.number, page.bytes,
                                page.size) != 0) {
        node_fault_set(l->fault,
                       "content of page # in # bytes is out of its limits",
                       page.number, (uint32_t)page.size);
        return INCODE_NONE;
    }
    uint64_t *label = incode_triangulator_label(triangulator, page.number);
    if (label != NULL)
        *label = page.tag;
    return INCODE_NONE;
}

/* ---- and how they get it ---- */

static void take_off(struct node_lending *l, uint32_t i) {
    l->queue[i] = l->queue[--l->queued];
}

static bool lend(struct node_lending *l, struct incode_triangulator *t,
                 const struct node_lent *lent) {
    struct node_page_message body;
    uint16_t to = (uint16_t)lent->node;
    if (cube_room(l->counted->cube, to) == 0)
        return false;
    body.head.page = lent->page;
    size_t size =
        sizeof body.head + incode_triangulator_copy(t, lent->page, body.data);
    memcpy(body.head.tag, incode_triangulator_label(t, lent->page),
           sizeof body.head.tag);
    node_counted_put(l->counted, to, NODE_PAGE, &body, size);
    l->bytes_out += size;
    l->sent++;
    return true;
}

/* To the host, who sends the page instead. */
static bool pass(struct node_lending *l, const struct node_lent *lent) {
    const uint32_t words[2] = {lent->node, lent->page};
    if (node_counted_write(l->counted, CUBE_HOST, NODE_PAGE_PASSED, words,
                           sizeof words) != 0)
        return false;
    l->bytes_out += sizeof words;
    l->passed++;
    return true;
}

unsigned node_lending_send(struct node_lending *lending,
                           struct incode_triangulator *triangulator) {
    struct node_lending *l = lending;
    unsigned sent = 0;
    for (uint32_t i = 0; i < l->queued;) {
        const struct node_lent *lent = &l->queue[i];
        bool gone =
            incode_triangulator_has(triangulator, lent->page)
                ? lend(l, triangulator, lent)
                : !incode_triangulator_fetch(triangulator, lent->page) &&
                      pass(l, lent);
        if (gone) {
            take_off(l, i);
            sent++;
        } else {
            i++;
        }
    }
    return sent;
}
