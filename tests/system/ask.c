/* Types a line to an emulated board's console, as a person at a terminal does,
 * and prints the record that answers, which begins with an end of line.
 *
 *     ask PATH WORD
 *
 * 1: there was no answer to any of twenty.
 */
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

enum { ANSWER_MS = 1000, TIMES = 20 };

/* The next byte; -1: none came in time. */
static int next(int fd)
{
    unsigned char byte;
    struct pollfd ready = {.fd = fd, .events = POLLIN};
    return poll(&ready, 1, ANSWER_MS) == 1 && read(fd, &byte, 1) == 1 ? byte
                                                                      : -1;
}

/* To the beginning of an answer: 00 FF, \r. */
static int find_answer(int fd)
{
    int last[3] = {1, 1, 1}, byte;
    while ((byte = next(fd)) >= 0) {
        last[0] = last[1], last[1] = last[2], last[2] = byte;
        if (last[0] == 0 && last[1] == 0xff && last[2] == '\r') {
            return 0;
        }
    }
    return -1;
}

int main(int argc, char **argv)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    char line[100];
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0), byte;
    if (argc != 3) {
        fprintf(stderr, "ask PATH WORD\n");
        return 2;
    }
    (void)snprintf(address.sun_path, sizeof address.sun_path, "%s", argv[1]);
    int size = snprintf(line, sizeof line, "%s\r", argv[2]);
    if (fd < 0 ||
        connect(fd, (struct sockaddr *)&address, sizeof address) != 0) {
        perror(argv[1]);
        return 1;
    }
    for (int i = 0; i < TIMES; i++) {
        if (write(fd, line, (size_t)size) == size && find_answer(fd) == 0) {
            while ((byte = next(fd)) > 0) {
                if (byte != '\r') {
                    putchar(byte);
                }
            }
            return 0;
        }
    }
    return 1;
}
