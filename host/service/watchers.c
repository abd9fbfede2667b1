#include "watchers.h"

#include <string.h>

enum { LOOK_US = 50000, ANSWERS_US = 2000000 };

static bool any(const struct host_node_set *set) {
    static const struct host_node_set none;
    return memcmp(set, &none, sizeof none) != 0;
}

void host_watching_look(struct host_watching *watching,
                        const struct host_machine *machine, uint64_t now_us,
                        const struct host_watchers_progress *progress) {
    const struct host_watchers *them = machine->watchers;
    struct host_watching *o = watching;
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

bool host_watching_due(const struct host_watching *watching, unsigned node,
                       struct node_question_message *question) {
    *question = (struct node_question_message){
        HOST_WATCHERS_TAG, (uint32_t)watching->question.what, 0};
    return watching->asked && host_node_set_has(&watching->due, node);
}

void host_watching_sent(struct host_watching *watching, unsigned node) {
    host_node_set_remove(&watching->due, node);
}

void host_watching_leave_out(struct host_watching *watching, unsigned node) {
    host_node_set_remove(&watching->due, node);
    host_node_set_remove(&watching->waited, node);
}

bool host_watching_take(struct host_watching *watching,
                        const struct host_machine *machine,
                        const struct cube_message *message) {
    const struct host_watchers *them = machine->watchers;
    struct node_answer_head head;
    if (message->size < sizeof head)
        return false;
    memcpy(&head, message->data, sizeof head);
    if (head.tag != HOST_WATCHERS_TAG)
        return false;
    if (watching->asked && head.what == (uint32_t)watching->question.what &&
        host_node_set_has(&watching->waited, message->source)) {
        them->answer(them->context, message->source,
                     message->data + sizeof head, message->size - sizeof head);
        host_watching_leave_out(watching, message->source);
    }
    return true;
}

void host_watching_again(struct host_watching *watching) {
    watching->due = watching->waited;
}
