#include "onlookers.h"

#include <string.h>

enum { LOOK_US = 50000, ANSWERS_US = 2000000 };

static bool any(const struct host_node_set *set) {
    static const struct host_node_set none;
    return memcmp(set, &none, sizeof none) != 0;
}

void host_onlooking_look(struct host_onlooking *onlooking,
                         const struct host_machine *machine, uint64_t now_us,
                         const struct host_onlookers_progress *progress) {
    const struct host_onlookers *them = machine->onlookers;
    struct host_onlooking *o = onlooking;
    if (them == NULL || (!o->asked && now_us - o->look_us < LOOK_US))
        return;
    if (!o->asked) {
        o->look_us = now_us;
        o->asked = them->ask(them->context, now_us, &o->question);
        o->due = o->waited = o->question.nodes;
        o->asked_us = now_us;
    }
    if (o->asked && (!any(&o->waited) || now_us - o->asked_us >= ANSWERS_US)) {
        them->answered(them->context, now_us, progress);
        o->asked = false;
        memset(&o->due, 0, sizeof o->due);
        memset(&o->waited, 0, sizeof o->waited);
    }
}

bool host_onlooking_due(const struct host_onlooking *onlooking, unsigned node,
                        struct node_question_message *question) {
    *question = (struct node_question_message){
        HOST_ONLOOKERS_TAG, (uint32_t)onlooking->question.what, 0};
    return onlooking->asked && host_node_set_has(&onlooking->due, node);
}

void host_onlooking_sent(struct host_onlooking *onlooking, unsigned node) {
    host_node_set_remove(&onlooking->due, node);
}

void host_onlooking_leave_out(struct host_onlooking *onlooking, unsigned node) {
    host_node_set_remove(&onlooking->due, node);
    host_node_set_remove(&onlooking->waited, node);
}

bool host_onlooking_take(struct host_onlooking *onlooking,
                         const struct host_machine *machine,
                         const struct cube_message *message) {
    const struct host_onlookers *them = machine->onlookers;
    struct node_answer_head head;
    if (message->size < sizeof head)
        return false;
    memcpy(&head, message->data, sizeof head);
    if (head.tag != HOST_ONLOOKERS_TAG)
        return false;
    if (onlooking->asked && head.what == (uint32_t)onlooking->question.what &&
        host_node_set_has(&onlooking->waited, message->source)) {
        them->answer(them->context, message->source,
                     message->data + sizeof head, message->size - sizeof head);
        host_onlooking_leave_out(onlooking, message->source);
    }
    return true;
}

void host_onlooking_again(struct host_onlooking *onlooking) {
    onlooking->due = onlooking->waited;
}
