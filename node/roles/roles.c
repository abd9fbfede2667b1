#include "roles.h"

#include "builder.h"
#include "exchange.h"
#include "holder.h"
#include "linda_builder.h"
#include "linda_manager.h"
#include "linda_worker.h"
#include "manager.h"
#include "worker.h"

static const struct node_role *const roles[] = {
    [NODE_WORKER] = &node_worker_role,
    [NODE_HOLDER] = &node_holder_role,
    [NODE_MANAGER] = &node_manager_role,
    [NODE_BUILDER] = &node_builder_role,
    [NODE_LINDA_MANAGER] = &node_linda_manager_role,
    [NODE_LINDA_BUILDER] = &node_linda_builder_role,
    [NODE_LINDA_WORKER] = &node_linda_worker_role,
    [NODE_EXCHANGE] = &node_exchange_role,
};

const struct node_role *node_role_named(uint32_t number) {
    return number < sizeof roles / sizeof roles[0] ? roles[number] : NULL;
}
