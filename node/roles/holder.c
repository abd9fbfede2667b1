#include "holder.h"

#include <string.h>

#include "incode/pages/pages.h"
#include "incode/predicates/check.h"
#include "node/common.h"
#include "node/page_check.h"

struct frame {
    struct node_page_message message; /* with the page's number */
    uint16_t size;                    /* of its data; 0: nothing here */
    bool loading;                     /* the host has been asked */
    bool fresh; /* here, but not yet passed on to the node that wants it */
};

struct holder {
    struct node_counted *counted;
    struct node_fault *fault;
    struct node_page_check check;
    uint32_t holders;
    struct incode_tree tree; /* of the points, */
    double lo[3], hi[3];     /* and their box */
    struct frame *frames;
    uint32_t frame_count, frames_used;
    /* Requests that wait: for this page, by that node. */
    uint32_t page[NODE_PAGES_IN_FLIGHT_MAX];
    uint16_t source[NODE_PAGES_IN_FLIGHT_MAX];
    uint32_t queued;
    uint64_t hits, misses, bytes_in, bytes_out;
};

static size_t holder_arena_min(size_t memory,
                               const struct node_setup_message *setup) {
    (void)memory, (void)setup;
    return node_aligned(sizeof(struct holder)) + sizeof(struct frame);
}

static bool holder_start(void *self, size_t bytes,
                         const struct node_setup_message *setup,
                         struct node_counted *counted,
                         struct node_fault *fault) {
    struct holder *h = self;
    size_t own = node_aligned(sizeof *h);
    if (bytes < holder_arena_min(bytes, setup)) {
        node_fault_set(fault, "the node's memory does not hold a page", 0, 0);
        return false;
    }
    const struct incode_setup *points = &setup->setup;
    const char *why = incode_setup_fault(points);
    if (why != NULL) {
        node_fault_set(fault, why, 0, 0);
        return false;
    }
    if (setup->holders == 0) {
        node_fault_set(fault, "invalid setup: a holder among # holders", 0, 0);
        return false;
    }
    if (!node_keepers_fit(setup, counted->self, true, fault))
        return false;
    memset(h, 0, sizeof *h);
    h->counted = counted;
    h->fault = fault;
    node_page_check_init(&h->check, setup, counted, fault);
    h->holders = setup->holders;
    incode_tree_init(&h->tree, points->bricks,
                     points->cells[0] * points->cells[1] * points->cells[2]);
    memcpy(h->lo, points->lo, sizeof h->lo);
    memcpy(h->hi, points->hi, sizeof h->hi);
    h->frames = (void *)((uint8_t *)self + own);
    h->frame_count = (uint32_t)((bytes - own) / sizeof h->frames[0]);
    memset(h->frames, 0, h->frame_count * sizeof h->frames[0]);
    return true;
}

static struct frame *frame_of(const struct holder *h, uint32_t page) {
    return &h->frames[node_keeper_place(page, h->holders) % h->frame_count];
}

static void take_request(struct holder *h, const struct cube_message *message) {
    const uint32_t bytes = sizeof h->page[0];
    if (message->size % bytes != 0) {
        node_fault_set(h->fault, "request in # bytes, expected # a page",
                       message->size, bytes);
        return;
    }
    for (size_t at = 0; at < message->size; at += bytes) {
        uint32_t page;
        memcpy(&page, message->data + at, sizeof page);
        if (page >= h->tree.pages ||
            node_keeper(page, h->holders) != h->counted->self) {
            node_fault_set(h->fault, "request for page #, which node # has not",
                           page, h->counted->self);
            return;
        }
        if (h->queued == NODE_PAGES_IN_FLIGHT_MAX) {
            node_fault_set(h->fault, "more than # pages requested at a time",
                           NODE_PAGES_IN_FLIGHT_MAX, 0);
            return;
        }
        h->page[h->queued] = page;
        h->source[h->queued] = message->source;
        h->queued++;
    }
}

/* A page that arrived altered is requested again: nodes still wait for it. */
static void take_page(struct holder *h, const struct cube_message *message) {
    struct node_page page;
    bool right = node_page_check_take(&h->check, message, &page);
    if (page.number == INCODE_NONE)
        return;
    struct frame *frame = frame_of(h, page.number);
    bool due = page.source == CUBE_HOST && frame->loading &&
               frame->message.head.page == page.number;
    if (right && page.source != CUBE_HOST) {
        node_page_check_report(&h->check, page.source, page.number);
    } else if (right && !due) {
        node_fault_set(h->fault, "page # was not requested", page.number, 0);
    } else if (due && !right) {
        frame->loading = false;
    } else if (due && !incode_page_is_sound(&h->tree, h->lo, h->hi, page.number,
                                            page.bytes, page.size)) {
        node_fault_set(h->fault,
                       "content of page # in # bytes is out of its limits",
                       page.number, (uint32_t)page.size);
    } else if (due) {
        memcpy(&frame->message, message->data, message->size);
        frame->size = (uint16_t)page.size;
        frame->loading = false;
        frame->fresh = true;
    }
}

static void holder_message(void *self, const struct cube_message *message,
                           uint64_t now_us) {
    struct holder *h = self;
    (void)now_us;
    h->bytes_in += message->size;
    if (message->type == NODE_PAGE_REQUEST) {
        take_request(h, message);
    } else if (message->type == NODE_PAGE) {
        take_page(h, message);
    } else if (message->type == NODE_JOB) {
        node_fault_set(h->fault, "a job for a node that holds pages", 0, 0);
    } else if (message->type != NODE_CREDIT) { /* it has no results */
        node_fault_set(h->fault,
                       "message of type # for a node that holds pages",
                       message->type, 0);
    }
}

static bool holds(const struct frame *frame, uint32_t page) {
    return frame->message.head.page == page && frame->size > 0;
}

/* To each who waits for a page that is there, as links have room. */
static unsigned send_pages(struct holder *h) {
    unsigned sent = 0;
    for (uint32_t i = 0; i < h->queued;) {
        struct frame *frame = frame_of(h, h->page[i]);
        size_t size = sizeof frame->message.head + frame->size;
        if (!holds(frame, h->page[i]) ||
            node_counted_write(h->counted, h->source[i], NODE_PAGE,
                               &frame->message, size) != 0) {
            i++;
            continue;
        }
        h->hits += !frame->fresh;
        frame->fresh = false;
        h->queued--;
        h->page[i] = h->page[h->queued];
        h->source[i] = h->source[h->queued];
        h->bytes_out += size;
        sent++;
    }
    return sent;
}

/* Takes a frame for a page and notes it as wanted.  A page that has just come
 * goes to who waits for it first: otherwise two pages of one frame could
 * displace each other for ever. */
static bool claim(struct holder *h, struct frame *frame, uint32_t page) {
    if (frame->loading || frame->fresh)
        return false;
    h->frames_used += frame->size == 0;
    frame->message.head.page = page;
    frame->size = 0;
    frame->loading = true;
    h->misses++;
    return true;
}

/* Asks for pages that are not there.  What a frame held is given up only when
 * the request is sure to leave. */
static unsigned ask_host(struct holder *h) {
    uint32_t wanted[NODE_PAGES_A_REQUEST], count = 0;
    if (cube_room(h->counted->cube, CUBE_HOST) == 0)
        return 0;
    for (uint32_t i = 0; i < h->queued && count < NODE_PAGES_A_REQUEST; i++) {
        struct frame *frame = frame_of(h, h->page[i]);
        if (!holds(frame, h->page[i]) && claim(h, frame, h->page[i]))
            wanted[count++] = h->page[i];
    }
    if (count == 0)
        return 0;
    node_counted_put(h->counted, CUBE_HOST, NODE_PAGE_REQUEST, wanted,
                     count * sizeof wanted[0]);
    h->bytes_out += count * sizeof wanted[0];
    return 1;
}

static unsigned holder_send(void *self) {
    struct holder *h = self;
    unsigned sent = send_pages(h) + ask_host(h);
    return sent + node_page_check_send(&h->check);
}

static unsigned holder_work(void *self, struct node_pace *pace) {
    (void)self, (void)pace;
    return 0;
}

static uint32_t holder_done(const void *self) {
    (void)self;
    return 0; /* there are no jobs */
}

static void holder_end(void *self, uint64_t now_us) {
    (void)self, (void)now_us;
}

/* It waits for the host alone, which knows of that. */
static uint32_t holder_awaited(const void *self) {
    (void)self;
    return INCODE_NONE;
}

static uint32_t holder_held(const void *self) {
    const struct holder *h = self;
    return h->queued + h->check.owed;
}

static void holder_totals(const void *self,
                          struct node_finished_message *totals,
                          uint64_t now_us) {
    const struct holder *h = self;
    (void)now_us;
    totals->pages_held = h->hits;
    totals->pages_forwarded = h->misses;
    totals->bytes_in = h->bytes_in;
    totals->bytes_out = h->bytes_out;
    totals->memory_high_water =
        node_aligned(sizeof *h) + h->frames_used * sizeof h->frames[0];
}

static void holder_map(const void *self, struct node_map *map) {
    const struct holder *h = self;
    map->pages = h->frame_count;
    map->tables[0].bytes = (uint32_t)node_aligned(sizeof *h);
    map->tables[0].count = NODE_PAGES_IN_FLIGHT_MAX;
    map->tables[1].bytes = (uint32_t)(h->frame_count * sizeof h->frames[0]);
    map->tables[1].count = h->frame_count;
}

static void holder_gauge(const void *self, struct incode_gauge *gauge) {
    const struct holder *h = self;
    gauge->pages = h->frame_count;
    gauge->held = h->frames_used;
}

const struct node_role node_holder_role = {
    .name = "holder",
    .tables = {{"queue of requests", "pages"},
               {"page frames", "pages of 1568 bytes"}},
    .arena_min = holder_arena_min,
    .start = holder_start,
    .message = holder_message,
    .work = holder_work,
    .send = holder_send,
    .done = holder_done,
    .end = holder_end,
    .awaited = holder_awaited,
    .held = holder_held,
    .totals = holder_totals,
    .gauge = holder_gauge,
    .map = holder_map,
};
