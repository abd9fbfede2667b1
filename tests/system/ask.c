/* Types a line to an emulated board's console, as a person at a terminal does,
 * and prints the record that answers, which begins with an end of line.
 *
 *     ask PATH WORD
 *
 * Without an answer the line is typed again: one that comes while a board
 * begins anew is lost, or its first letters are, and then the board says that
 * it does not know the rest.  1: there was no whole answer within two minutes,
 * whatever else the board said.
 */
#include <poll.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

enum { AGAIN_MS = 3000, DEADLINE_MS = 120000, BYTES_MAX = 65536 };

/* clock: two minutes in all. */
static int64_t now_ms(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

/* The next byte; -1: none has come by then. */
static int next(int fd, int64_t end_ms) {
    unsigned char byte;
    struct pollfd ready = {.fd = fd, .events = POLLIN};
    int64_t wait_ms = end_ms - now_ms();
    return wait_ms > 0 && poll(&ready, 1, (int)wait_ms) == 1 &&
                   read(fd, &byte, 1) == 1
               ? byte
               : -1;
}

/* To the beginning of an answer: 00 FF, \r. */
static bool find_answer(int fd, int64_t end_ms) {
    int last[3] = {1, 1, 1}, byte;
    while ((byte = next(fd, end_ms)) >= 0) {
        last[0] = last[1], last[1] = last[2], last[2] = byte;
        if (last[0] == 0 && last[1] == 0xff && last[2] == '\r')
            return true;
    }
    return false;
}

/* Whether the answer is that the board does not know the end of the word. */
static bool is_torn(const char *text, const char *word) {
    static const char unknown[] = ": no such word";
    text += strspn(text, "\n");
    for (const char *tail = word + 1; word[0] != 0 && *tail != 0; tail++) {
        size_t length = strlen(tail);
        if (strncmp(text, tail, length) == 0 &&
            strncmp(text + length, unknown, sizeof unknown - 1) == 0)
            return true;
    }
    return false;
}

/* To its end, 00, which frames may come behind; false: it has none in time, or
 * it answers the end of the word. */
static bool print_answer(int fd, int64_t end_ms, const char *word) {
    static char text[BYTES_MAX + 1];
    size_t size = 0;
    int byte;
    while ((byte = next(fd, end_ms)) > 0)
        if (byte != '\r' && size < BYTES_MAX)
            text[size++] = (char)byte;
    text[size] = 0;
    return byte == 0 && !is_torn(text, word) &&
           fwrite(text, 1, size, stdout) == size;
}

int main(int argc, char **argv) {
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    char line[100];
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
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
    int64_t end_ms = now_ms() + DEADLINE_MS, now;
    while ((now = now_ms()) < end_ms) {
        int64_t again_ms = now + AGAIN_MS < end_ms ? now + AGAIN_MS : end_ms;
        if (send(fd, line, (size_t)size, MSG_NOSIGNAL | MSG_DONTWAIT) != size)
            break;
        if (find_answer(fd, again_ms) && print_answer(fd, again_ms, argv[2]))
            return 0;
    }
    return 1;
}
