/* Pages with their host's tag: a keyed checksum of a page's number, size and
 * bytes.  The host draws the key for each run, and the setup carries it.  The
 * tag travels with the page, is kept with it, and is sent on with it; no node
 * makes a tag.  So a node notices a page that was altered on the way, or by the
 * node that kept it, and reports to the host which node sent it.
 *
 * This is a guard against faulty nodes.  Each node knows the key, so a node
 * that is programmed to forge pages can.
 *
 * The checksum is HalfSipHash-2-4 with a result of 64 bits (Aumasson and
 * Bernstein, SipHash: a fast short-input PRF, 2012, in its form of 32 bits):
 * additions, rotations and exclusive ors alone.
 *
 * Work: a pass over the page: 13,300 instructions on x86-64, 2 us; some
 * 10,000 on a Cortex-M3, 0.4 ms at 25 MHz. */
#ifndef NODE_PAGE_CHECK_H
#define NODE_PAGE_CHECK_H

#include <stdbool.h>

#include "common.h"
#include "message.h"

/* HalfSipHash-2-4 of some words, then some bytes. */
uint64_t node_half_siphash(uint64_t key, const uint32_t *words, size_t count,
                           const uint8_t *bytes, size_t size);

/* Makes the tag of head.page and `bytes` bytes of data, which the caller has
 * filled in.  Returns the size of the message. */
size_t node_page_seal(struct node_page_message *message, uint64_t key,
                      size_t bytes);

/* A page that has arrived; bytes: in its message. */
struct node_page {
    uint32_t number;
    uint16_t source; /* of the message */
    uint64_t tag;
    const uint8_t *bytes;
    size_t size;
};

struct node_page_check {
    struct node_counted *counted;
    struct node_fault *fault;
    uint64_t key;
    bool owed; /* a report waits to be sent: */
    struct node_wrong_page_message wrong;
};

/* counted and fault must outlive the check. */
void node_page_check_init(struct node_page_check *check,
                          const struct node_setup_message *setup,
                          struct node_counted *counted,
                          struct node_fault *fault);

/* Takes NODE_PAGE or NODE_PAGE_TO_ALL.  True: *page is as the host made it.
 * False: the page was altered and will be reported; page->number is as it
 * arrived.  Or the message was too short for a page, which is a fault if the
 * host sent it; then page->number is INCODE_NONE. */
bool node_page_check_take(struct node_page_check *check,
                          const struct cube_message *message,
                          struct node_page *page);

/* Reports to the host that `sender` has sent a page that it should not have
 * sent.  Only the first report is kept until it is sent. */
void node_page_check_report(struct node_page_check *check, uint16_t sender,
                            uint32_t page);

/* Sends the report that waits, if the link has room.  Returns the messages. */
unsigned node_page_check_send(struct node_page_check *check);

#endif
