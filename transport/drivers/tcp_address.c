#include "tcp_address.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/un.h>

int tcp_address_parse(struct tcp_address *address, const char *text) {
    struct sockaddr_in *v4 = (struct sockaddr_in *)&address->to;
    struct sockaddr_in6 *v6 = (struct sockaddr_in6 *)&address->to;
    char host[INET6_ADDRSTRLEN + 2], *end;
    const char *colon = strrchr(text, ':');
    memset(address, 0, sizeof *address);
    if (colon == NULL || colon[1] < '0' || colon[1] > '9' ||
        (size_t)(colon - text) >= sizeof host) {
        return -1;
    }
    unsigned long port = strtoul(colon + 1, &end, 10);
    if (*end != '\0' || port == 0 || port > 65535) {
        return -1;
    }
    size_t length = (size_t)(colon - text);
    memcpy(host, text, length);
    host[length] = '\0';
    if (length > 2 && host[0] == '[' && host[length - 1] == ']') {
        host[length - 1] = '\0';
        v6->sin6_family = AF_INET6;
        v6->sin6_port = htons((uint16_t)port);
        address->size = sizeof *v6;
        return inet_pton(AF_INET6, host + 1, &v6->sin6_addr) == 1 ? 0 : -1;
    }
    v4->sin_family = AF_INET;
    v4->sin_port = htons((uint16_t)port);
    address->size = sizeof *v4;
    return inet_pton(AF_INET, host, &v4->sin_addr) == 1 ? 0 : -1;
}

_Static_assert(sizeof((struct sockaddr_un *)0)->sun_path == TCP_PATH_MAX + 1,
               "a path and its end");

int tcp_address_set_path(struct tcp_address *address, const char *path) {
    struct sockaddr_un *at = (struct sockaddr_un *)&address->to;
    size_t length = strlen(path);
    memset(address, 0, sizeof *address);
    if (length == 0 || length > TCP_PATH_MAX) {
        return -1;
    }
    at->sun_family = AF_UNIX;
    memcpy(at->sun_path, path, length + 1);
    address->size =
        (socklen_t)(offsetof(struct sockaddr_un, sun_path) + length + 1);
    return 0;
}

const char *tcp_address_path(const struct tcp_address *address) {
    return address->to.any.sa_family == AF_UNIX
               ? ((const struct sockaddr_un *)&address->to)->sun_path
               : NULL;
}

bool tcp_address_is_any(const struct tcp_address *address) {
    const struct sockaddr_in *v4 = (const struct sockaddr_in *)&address->to;
    const struct sockaddr_in6 *v6 = (const struct sockaddr_in6 *)&address->to;
    return address->to.any.sa_family == AF_INET6
               ? IN6_IS_ADDR_UNSPECIFIED(&v6->sin6_addr)
               : address->to.any.sa_family == AF_INET &&
                     v4->sin_addr.s_addr == htonl(INADDR_ANY);
}
