#include "resolve.h"

#include <netdb.h>
#include <stdio.h>
#include <string.h>

#include "host/base/parse.h"

int host_resolve(const char *text, struct tcp_address *address, char *why,
                 size_t size) {
    struct addrinfo hints = {.ai_socktype = SOCK_STREAM}, *found = NULL;
    char host[256];
    const char *colon = strrchr(text, ':');
    uint64_t port = 0;
    if (tcp_address_parse(address, text) == 0) {
        return 0;
    }
    if (colon == NULL || (size_t)(colon - text) >= sizeof host ||
        host_parse_number(colon + 1, 1, 65535, &port) != 0) {
        snprintf(why, size,
                 "not a host with a port; write \"name:7001\", "
                 "\"10.0.0.7:7001\" or \"[2001:db8::7]:7001\"");
        return HOST_INPUT;
    }
    snprintf(host, sizeof host, "%.*s", (int)(colon - text), text);
    int status = getaddrinfo(host, colon + 1, &hints, &found);
    if (status != 0) {
        snprintf(why, size, "host %s: %s; correct the name or give its address",
                 host, gai_strerror(status));
        return HOST_CUBE;
    }
    memcpy(&address->to, found->ai_addr, found->ai_addrlen);
    address->size = found->ai_addrlen;
    freeaddrinfo(found);
    return 0;
}
