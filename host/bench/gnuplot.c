#include "gnuplot.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "host/base/create.h"

/* gnuplot, with these as its standard input and output: as waitpid has it, or
 * -1. */
static int gnuplot(const char *word, int in, int out) {
    int status = 0;
    pid_t child = fork();
    if (child == 0) {
        (void)dup2(in, STDIN_FILENO);
        (void)dup2(out, STDOUT_FILENO);
        (void)execlp("gnuplot", "gnuplot", word, (char *)NULL);
        _exit(127);
    }
    return child < 0 || waitpid(child, &status, 0) < 0 ? -1 : status;
}

int host_gnuplot_there(const char *path, struct host_error *error) {
    int nothing = open("/dev/null", O_RDWR | O_CLOEXEC);
    int status = nothing < 0 ? -1 : gnuplot("--version", nothing, nothing);
    (void)close(nothing);
    return status == 0 ? 0
                       : host_fail(error, HOST_INPUT,
                                   "%s: gnuplot is not installed; install "
                                   "gnuplot-nox, or leave --svg out",
                                   path);
}

/* With its standard input from the script and its output to the file, whose
 * name may have any letters. */
int host_gnuplot_draw(FILE *script, const char *path,
                      struct host_error *error) {
    (void)fflush(script);
    rewind(script);
    FILE *out = host_create_over(path);
    if (out == NULL) {
        return host_fail(error, HOST_INPUT, "%s: %s; choose another file", path,
                         strerror(errno));
    }
    int status = gnuplot("-", fileno(script), fileno(out));
    (void)fclose(out);
    if (status != 0) {
        (void)unlink(path);
        return host_fail(error, HOST_BROKEN,
                         "%s: gnuplot does not draw it; see what it says",
                         path);
    }
    return 0;
}
