#include "page_check.h"

#include <string.h>

/* ---- HalfSipHash ---- */

struct sip {
    uint32_t v0, v1, v2, v3;
};

static inline uint32_t left(uint32_t x, unsigned bits) {
    return x << bits | x >> (32 - bits);
}

static inline struct sip rounds(struct sip s, unsigned count) {
    for (; count > 0; count--) {
        s.v0 += s.v1;
        s.v1 = left(s.v1, 5) ^ s.v0;
        s.v0 = left(s.v0, 16);
        s.v2 += s.v3;
        s.v3 = left(s.v3, 8) ^ s.v2;
        s.v0 += s.v3;
        s.v3 = left(s.v3, 7) ^ s.v0;
        s.v2 += s.v1;
        s.v1 = left(s.v1, 13) ^ s.v2;
        s.v2 = left(s.v2, 16);
    }
    return s;
}

static inline struct sip absorb(struct sip s, uint32_t word) {
    s.v3 ^= word;
    s = rounds(s, 2);
    s.v0 ^= word;
    return s;
}

uint64_t node_half_siphash(uint64_t key, const uint32_t *words, size_t count,
                           const uint8_t *bytes, size_t size) {
    const uint32_t k0 = (uint32_t)key, k1 = (uint32_t)(key >> 32);
    struct sip s = {k0, k1 ^ 0xee, k0 ^ 0x6c796765, k1 ^ 0x74656462};
    uint32_t word, last = (uint32_t)(count * sizeof word + size) << 24;
    for (size_t i = 0; i < count; i++)
        s = absorb(s, words[i]);
    for (; size >= sizeof word; bytes += sizeof word, size -= sizeof word) {
        memcpy(&word, bytes, sizeof word);
        s = absorb(s, word);
    }
    for (size_t i = 0; i < size; i++)
        last |= (uint32_t)bytes[i] << 8 * i;
    s = absorb(s, last);
    s.v2 ^= 0xee;
    s = rounds(s, 4);
    uint32_t low = s.v1 ^ s.v3;
    s.v1 ^= 0xdd;
    s = rounds(s, 4);
    return (uint64_t)(s.v1 ^ s.v3) << 32 | low;
}

/* ---- pages ---- */

static uint64_t tag_of(uint64_t key, uint32_t page, const uint8_t *bytes,
                       size_t size) {
    const uint32_t words[] = {page, (uint32_t)size};
    return node_half_siphash(key, words, 2, bytes, size);
}

size_t node_page_seal(struct node_page_message *message, uint64_t key,
                      size_t bytes) {
    uint64_t tag = tag_of(key, message->head.page, message->data, bytes);
    memcpy(message->head.tag, &tag, sizeof tag);
    return sizeof message->head + bytes;
}

void node_page_check_init(struct node_page_check *check,
                          const struct node_setup_message *setup,
                          struct node_counted *counted,
                          struct node_fault *fault) {
    memset(check, 0, sizeof *check);
    check->counted = counted;
    check->fault = fault;
    check->key = setup->page_key;
}

bool node_page_check_take(struct node_page_check *check,
                          const struct cube_message *message,
                          struct node_page *page) {
    struct node_page_head head;
    *page =
        (struct node_page){.number = INCODE_NONE, .source = message->source};
    if (message->size < sizeof head) {
        if (message->source == CUBE_HOST) {
            node_fault_set(check->fault, "page in # bytes, expected # at least",
                           message->size, sizeof head);
        } else {
            node_page_check_report(check, message->source, INCODE_NONE);
        }
        return false;
    }
    memcpy(&head, message->data, sizeof head);
    page->number = head.page;
    memcpy(&page->tag, head.tag, sizeof head.tag);
    page->bytes = message->data + sizeof head;
    page->size = message->size - sizeof head;
    bool right =
        page->tag == tag_of(check->key, page->number, page->bytes, page->size);
    if (!right)
        node_page_check_report(check, message->source, page->number);
    return right;
}

void node_page_check_report(struct node_page_check *check, uint16_t sender,
                            uint32_t page) {
    if (!check->owed) {
        check->owed = true;
        check->wrong = (struct node_wrong_page_message){page, sender};
    }
}

unsigned node_page_check_send(struct node_page_check *check) {
    if (!check->owed ||
        node_counted_write(check->counted, CUBE_HOST, NODE_WRONG_PAGE,
                           &check->wrong, sizeof check->wrong) != 0)
        return 0;
    check->owed = false;
    return 1;
}
