#include "paging.h"

#include <stdio.h>
#include <string.h>

#include "notices.h"

/* Of what a node has more, somewhat more than half goes to pages: 79 in 512K,
 * 1,334 in 4M. */
static double needed_for(uint64_t memory, uint64_t frames, uint64_t pages) {
    double more = pages > frames ? (double)(pages - frames) : 0;
    return (double)memory + 2.0 * INCODE_PAGE_BYTES * more;
}

uint64_t host_paging_memory(uint64_t memory, uint64_t frames, uint64_t pages) {
    double needed = needed_for(memory, frames, pages);
    uint64_t enough = 1;
    while (enough <= memory ||
           ((double)enough < needed && enough < HOST_MEMORY_MAX)) {
        enough *= 2;
    }
    return enough < HOST_MEMORY_MAX ? enough : HOST_MEMORY_MAX;
}

static const char *size_text(uint64_t bytes, char *text, size_t size) {
    unsigned shift = bytes % (1 << 20) != 0 ? 10 : bytes < 1 << 30 ? 20 : 30;
    snprintf(text, size, "%llu%c", (unsigned long long)(bytes >> shift),
             shift == 10   ? 'K'
             : shift == 20 ? 'M'
                           : 'G');
    return text;
}

/* Of nodes that have their setup, the most pages that one holds. */
static uint64_t frames_of(const struct host_service *s) {
    uint64_t frames = 0;
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        uint64_t has = s->report[i].map.map.pages;
        frames = has > frames ? has : frames;
    }
    return frames;
}

static void tell(struct host_service *s) {
    char line[HOST_NOTICE_BYTES], now[24], then[24];
    uint64_t frames = frames_of(s), pages = s->order->tree.pages;
    uint64_t enough = host_paging_memory(s->memory, frames, pages);
    bool holds = (double)enough >= needed_for(s->memory, frames, pages);
    unsigned long long part = 100 * frames / pages;
    bool file = s->memory_of != NULL;
    snprintf(line, sizeof line,
             "%s%s %s: a node holds %llu %% of these points at a time, and "
             "much of the time goes into pages that it asks for again; ",
             file ? s->memory_of : "", file ? ": memory" : "--memory",
             size_text(s->memory, now, sizeof now), part < 100 ? part : 99);
    size_t at = strlen(line);
    size_text(enough, then, sizeof then);
    snprintf(line + at, sizeof line - at,
             enough <= s->memory ? "more nodes would share them"
             : file              ? "nodes with %s would hold %s of them"
                                 : "--memory %s would hold %s of them",
             then, holds ? "all" : "more");
    host_notice_line(s, line);
}

/* Each node needs each page once, in each generation of the wiring. */
static void look(struct host_service *s, uint64_t pages) {
    uint64_t needed =
        (uint64_t)s->order->tree.pages * s->machine->nodes * s->generations;
    if (s->memory == 0 || s->paging_told || pages <= needed ||
        pages - needed < HOST_PAGING_AGAIN_MIN ||
        (pages - needed) * HOST_PAGING_TETRAHEDRA < s->tets->count) {
        return;
    }
    s->paging_told = true;
    tell(s);
}

void host_paging_sent(struct host_service *service) {
    service->pages_sent++;
    look(service, service->pages_sent);
}

void host_paging_end(struct host_service *service) {
    uint64_t pages = 0;
    for (unsigned i = 0; i < service->machine->nodes; i++) {
        pages += service->report[i].statistics.statistics.page_requests;
    }
    look(service, pages);
}
