/* A board that talks garbage, for the system tests: prints the name of a
 * pseudo-terminal, and says there what boot loaders say, and noise, ten times a
 * second until SIGTERM.
 *
 *     babble
 */
#include <fcntl.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

enum { NOISE = 24, EVERY_US = 100000 };

int main(void) {
    static const char banner[] = "U-Boot 2023.01 \033[2J\r\n";
    uint64_t state = 88172645463325252u;
    struct termios raw;
    int board = posix_openpt(O_RDWR | O_NOCTTY);
    if (board < 0 || grantpt(board) != 0 || unlockpt(board) != 0 ||
        tcgetattr(board, &raw) != 0)
        return 1;
    cfmakeraw(&raw);
    (void)tcsetattr(board, TCSANOW, &raw);
    (void)fcntl(board, F_SETFL, O_NONBLOCK);
    (void)printf("%s\n", ptsname(board));
    (void)fflush(stdout);
    for (;;) {
        uint8_t noise[NOISE];
        for (unsigned i = 0; i < NOISE; i++) {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            noise[i] = (uint8_t)state;
        }
        (void)!write(board, noise, sizeof noise);
        (void)!write(board, banner, sizeof banner - 1);
        while (read(board, noise, sizeof noise) > 0) {
        }
        (void)usleep(EVERY_US); /* clock: now and then */
    }
}
