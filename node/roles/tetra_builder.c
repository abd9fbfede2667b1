#include "tetra_builder.h"

#include <string.h>

#include "incode/predicates/check.h"
#include "node/common.h"
#include "builder.h"
#include "lists.h"

size_t node_tetra_builder_min(const struct node_setup_message *setup) {
    uint32_t lists = setup->jobs_per_worker;
    lists = lists < 1 ? 1 : lists > INCODE_LISTS_MAX ? INCODE_LISTS_MAX : lists;
    return incode_builder_min(lists);
}

static bool is_sound(const struct node_setup_message *setup,
                     struct node_fault *fault) {
    const char *why = incode_setup_fault(&setup->setup);
    if (why != NULL) {
        node_fault_set(fault, why, 0, 0);
        return false;
    }
    if (setup->jobs_per_worker < 1 ||
        setup->jobs_per_worker > INCODE_LISTS_MAX) {
        node_fault_set(fault,
                       "invalid setup: # lists a builder, allowed are 1..#",
                       setup->jobs_per_worker, INCODE_LISTS_MAX);
        return false;
    }
    return true;
}

bool node_tetra_builder_start(struct node_tetra_builder *t, void *memory,
                              size_t bytes,
                              const struct node_setup_message *setup,
                              const struct node_carrier *carrier,
                              struct node_counted *counted,
                              struct node_fault *fault) {
    if (!is_sound(setup, fault) ||
        !node_keepers_fit(setup, counted->self, false, fault))
        return false;
    if (bytes < node_tetra_builder_min(setup)) {
        node_fault_set(fault, "the node's memory is too small for a builder", 0,
                       0);
        return false;
    }
    memset(t, 0, sizeof *t);
    t->fault = fault;
    t->carrier = *carrier;
    node_requests_init(&t->requests, setup, NULL, counted, fault);
    const struct incode_page_source source = node_requests_source(&t->requests);
    incode_builder_init(&t->builder, memory, bytes, &setup->setup,
                        setup->jobs_per_worker, &source, &counted->yield);
    t->builder.number = counted->self;
    return true;
}

bool node_tetra_builder_message(struct node_tetra_builder *t,
                                const struct cube_message *message) {
    struct incode_maker *maker = &t->builder.maker;
    struct node_page page;
    if (message->type != NODE_PAGE)
        return message->type == NODE_CREDIT;
    t->bytes_in += message->size;
    if (node_requests_take(&t->requests, message, &page)) {
        int status =
            incode_maker_page(maker, page.number, page.bytes, page.size);
        node_requests_judge(&t->requests, status, &page);
    } else if (page.number != INCODE_NONE &&
               incode_pager_loading(&maker->pager, page.number)) {
        node_requests_again(&t->requests, page.number, true);
    }
    return true;
}

/* ---- work ---- */

static bool take_list(struct node_tetra_builder *t) {
    struct incode_list list;
    size_t size;
    const void *data;
    if (incode_builder_held(&t->builder) == t->builder.lists ||
        (data = t->carrier.first(t->carrier.context, &size)) == NULL)
        return false;
    bool fits = size >= offsetof(struct incode_list, v) && size <= sizeof list;
    list.count = 0;
    memcpy(&list, data, fits ? size : 0);
    t->carrier.drop(t->carrier.context);
    if (!fits || size != incode_list_bytes(list.count)) {
        node_fault_set(t->fault, "a list of # in # bytes", list.count,
                       (uint32_t)size);
        return false;
    }
    return incode_builder_take(&t->builder, &list);
}

static bool send_answers(struct node_tetra_builder *t) {
    const struct incode_answers *answers = incode_builder_answers(&t->builder);
    if (answers == NULL || !t->carrier.has_room(t->carrier.context))
        return false;
    t->carrier.send(t->carrier.context, answers,
                    incode_answers_bytes(answers->count));
    incode_builder_drop(&t->builder);
    return true;
}

static bool work_on(void *context, uint32_t units, uint32_t *spent) {
    struct node_tetra_builder *t = context;
    uint64_t before = t->builder.spent;
    if (node_fault_is_set(t->fault))
        return false;
    bool moved = take_list(t);
    enum incode_step step = incode_builder_step(&t->builder, units);
    moved = send_answers(t) || moved;
    if (step == INCODE_BROKEN)
        node_fault_set(t->fault, incode_builder_fault(&t->builder), 0, 0);
    *spent = (uint32_t)(t->builder.spent - before);
    return moved || step == INCODE_WORKED;
}

unsigned node_tetra_builder_work(struct node_tetra_builder *t,
                                 struct node_pace *pace) {
    return node_pace_work(pace, work_on, t);
}

uint32_t node_tetra_builder_held(const struct node_tetra_builder *t) {
    return incode_builder_held(&t->builder);
}

uint32_t node_tetra_builder_awaited(const struct node_tetra_builder *t) {
    return incode_pager_awaited(&t->builder.maker.pager);
}

void node_tetra_builder_totals(const struct node_tetra_builder *t,
                               struct node_finished_message *totals) {
    totals->bytes_in = t->bytes_in;
    totals->bytes_out = t->requests.bytes_out;
    incode_builder_statistics(&t->builder, &totals->statistics);
    totals->memory_high_water = totals->statistics.memory_high_water;
}

void node_tetra_builder_gauge(const struct node_tetra_builder *t,
                              struct incode_gauge *gauge) {
    gauge->pages = t->builder.maker.pager.frame_count;
    gauge->held = t->builder.maker.pager.frames_used;
}

void node_tetra_builder_map(const struct node_tetra_builder *t,
                            struct node_map *map) {
    const struct incode_pager *pager = &t->builder.maker.pager;
    size_t frames = incode_pager_bytes(pager->frame_count);
    map->tables[0].bytes = (uint32_t)(t->builder.bytes - frames);
    map->tables[1].bytes = (uint32_t)frames;
    map->tables[1].count = pager->frame_count;
    map->pages = pager->frame_count;
}

/* --- builder -------------------------------------------------------------- */

struct builder {
    struct node_tetra_builder tetra;
    struct node_lists lists;
    size_t inbox_bytes;
    uint64_t first_us, last_us; /* when lists came */
};

static uint32_t places(const struct node_setup_message *setup) {
    uint32_t lists = setup->jobs_per_worker;
    return lists < 1 ? 1 : lists > INCODE_LISTS_MAX ? INCODE_LISTS_MAX : lists;
}

static size_t builder_arena_min(size_t memory,
                                const struct node_setup_message *setup) {
    (void)memory;
    return node_aligned(sizeof(struct builder)) +
           node_lists_bytes(places(setup)) + node_tetra_builder_min(setup);
}

static bool builder_start(void *self, size_t bytes,
                          const struct node_setup_message *setup,
                          struct node_counted *counted,
                          struct node_fault *fault) {
    struct builder *b = self;
    uint8_t *memory = (uint8_t *)self + node_aligned(sizeof *b);
    size_t inbox = node_lists_bytes(places(setup));
    size_t own = node_aligned(sizeof *b) + inbox;
    if (bytes < own) {
        node_fault_set(fault, "the node's memory does not hold lists", 0, 0);
        return false;
    }
    if (setup->manager >= setup->nodes || setup->manager == counted->self) {
        node_fault_set(fault, "invalid setup: node # builds for face manager #",
                       counted->self, setup->manager);
        return false;
    }
    memset(b, 0, sizeof *b);
    b->inbox_bytes = inbox;
    node_lists_init(&b->lists, memory, places(setup), NODE_ANSWERS,
                    places(setup), counted, fault);
    node_lists_add(&b->lists, setup->manager);
    const struct node_carrier carrier = node_lists_carrier(&b->lists);
    return node_tetra_builder_start(&b->tetra, memory + inbox, bytes - own,
                                    setup, &carrier, counted, fault);
}

static void builder_message(void *self, const struct cube_message *message,
                            uint64_t now_us) {
    struct builder *b = self;
    if (message->type == NODE_LIST) {
        b->first_us = b->first_us == 0 ? now_us : b->first_us;
        b->last_us = now_us;
        node_lists_take(&b->lists, message);
    } else if (message->type == NODE_JOB) {
        node_fault_set(b->tetra.fault, "a job for a node that builds", 0, 0);
    } else if (!node_tetra_builder_message(&b->tetra, message)) {
        node_fault_set(b->tetra.fault, "message of type # for a builder",
                       message->type, 0);
    }
}

static unsigned builder_work(void *self, struct node_pace *pace) {
    struct builder *b = self;
    return node_tetra_builder_work(&b->tetra, pace);
}

static unsigned builder_send(void *self) {
    struct builder *b = self;
    return node_requests_send(&b->tetra.requests);
}

static uint32_t builder_done(const void *self) {
    (void)self;
    return 0; /* there are no jobs */
}

static void builder_end(void *self, uint64_t now_us) {
    (void)self, (void)now_us;
}

static uint32_t builder_awaited(const void *self) {
    const struct builder *b = self;
    return node_tetra_builder_awaited(&b->tetra);
}

static uint32_t builder_held(const void *self) {
    const struct builder *b = self;
    return node_tetra_builder_held(&b->tetra) + node_lists_held(&b->lists);
}

static void builder_totals(const void *self,
                           struct node_finished_message *totals,
                           uint64_t now_us) {
    const struct builder *b = self;
    (void)now_us;
    node_tetra_builder_totals(&b->tetra, totals);
    totals->wall_us = b->last_us - b->first_us;
    totals->bytes_in += b->lists.bytes_in;
    totals->bytes_out += b->lists.bytes_out;
    totals->memory_high_water += node_aligned(sizeof *b) + b->inbox_bytes;
}

static void builder_map(const void *self, struct node_map *map) {
    const struct builder *b = self;
    node_tetra_builder_map(&b->tetra, map);
    map->tables[0].bytes += (uint32_t)node_aligned(sizeof *b);
    map->tables[2].bytes = (uint32_t)b->inbox_bytes;
    map->tables[2].count = b->lists.inbox.slot_count;
}

static void builder_gauge(const void *self, struct incode_gauge *gauge) {
    const struct builder *b = self;
    node_tetra_builder_gauge(&b->tetra, gauge);
}

const struct node_role node_builder_role = {
    .name = "builder",
    .tables = {{"maker, its local points, lists at work", NULL},
               {"page frames", "pages of 1568 bytes"},
               {"lists that wait", "lists"}},
    .arena_min = builder_arena_min,
    .start = builder_start,
    .message = builder_message,
    .work = builder_work,
    .send = builder_send,
    .done = builder_done,
    .end = builder_end,
    .awaited = builder_awaited,
    .held = builder_held,
    .totals = builder_totals,
    .gauge = builder_gauge,
    .map = builder_map,
};
