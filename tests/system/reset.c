/* Presses the reset button of an emulated board, by the socket of its monitor.
 *
 *     reset PATH
 *
 * Ends with 0 once the emulator has said that it is done.
 */
#include <poll.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

enum { ANSWER_MS = 60000 };

/* Reads until a text has come; clock: a minute at most between two bytes. */
static bool hears(int fd, const char *text) {
    static char said[4096];
    size_t size = 0;
    struct pollfd wait = {fd, POLLIN, 0};
    while (size + 1 < sizeof said && poll(&wait, 1, ANSWER_MS) > 0) {
        ssize_t got = read(fd, said + size, 1);
        if (got <= 0)
            return false;
        said[++size] = '\0';
        if (strstr(said, text) != NULL)
            return true;
    }
    return false;
}

static bool says(int fd, const char *command) {
    char line[100];
    int size = snprintf(line, sizeof line, "{\"execute\": \"%s\"}\n", command);
    return write(fd, line, (size_t)size) == size && hears(fd, "\"return\"");
}

int main(int argc, char **argv) {
    struct sockaddr_un there = {.sun_family = AF_UNIX};
    int fd = socket(AF_UNIX, SOCK_STREAM, 0);
    if (argc != 2 || strlen(argv[1]) >= sizeof there.sun_path) {
        fprintf(stderr, "usage: reset PATH\n");
        return 2;
    }
    memcpy(there.sun_path, argv[1], strlen(argv[1]));
    if (connect(fd, (struct sockaddr *)&there, sizeof there) != 0 ||
        !hears(fd, "\"QMP\"") || !says(fd, "qmp_capabilities") ||
        !says(fd, "system_reset")) {
        perror(argv[1]);
        return 1;
    }
    return 0;
}
