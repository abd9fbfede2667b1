#include "roles.h"

#include "holder.h"
#include "worker.h"

static const struct node_role *const roles[] = {
    [NODE_WORKER] = &node_worker_role,
    [NODE_HOLDER] = &node_holder_role,
};

const struct node_role *node_role_named(uint32_t number)
{
    return number < sizeof roles / sizeof roles[0] ? roles[number] : NULL;
}
