#include "begin.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include "host/formats/output.h"

/* Of what was closed, nothing is read, and writing to it remains an error. */
static void open_standard(void) {
    int file;
    do {
        file = open("/dev/null", O_RDONLY);
    } while (file >= 0 && file <= STDERR_FILENO);
    if (file > STDERR_FILENO) {
        (void)close(file);
    }
}

void host_begin(const char *name) {
    (void)prctl(PR_SET_NAME, name);
    open_standard();
    (void)signal(SIGCHLD, SIG_DFL);
    host_output_guard();
}
