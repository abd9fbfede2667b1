#include "hdf5.h"

#include <dlfcn.h>
#include <errno.h>
#include <signal.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

/* The soname that was found when this was built, and its package. */
#ifndef HDF5_LIBRARY
#define HDF5_LIBRARY "libhdf5_serial.so"
#endif
#ifndef HDF5_PACKAGE
#define HDF5_PACKAGE "the HDF5 library"
#endif

struct symbol {
    const char *name;
    size_t at; /* in struct host_hdf5 */
    bool is_id;
};

static const struct symbol symbols[] = {
#define CALL_AT(name) {"H5" #name, offsetof(struct host_hdf5, H5##name), false},
    HOST_HDF5_CALLS(CALL_AT)
#define ID_AT(name) {#name, offsetof(struct host_hdf5, name), true},
        HOST_HDF5_IDS(ID_AT)};

static int load(struct host_hdf5 *h, const char *path,
                struct host_error *error) {
    void *library = dlopen(HDF5_LIBRARY, RTLD_NOW | RTLD_LOCAL);
    bool found = library != NULL;
    for (size_t i = 0; found && i < sizeof symbols / sizeof symbols[0]; i++) {
        void *at = (char *)h + symbols[i].at;
        void *symbol = dlsym(library, symbols[i].name);
        found = symbol != NULL && (!symbols[i].is_id || h->H5open() >= 0);
        if (found && symbols[i].is_id)
            memcpy(at, symbol, sizeof(hid_t));
        else if (found)
            memcpy(at, &symbol, sizeof symbol);
    }
    if (!found) {
        const char *why = dlerror();
        return host_fail(error, HOST_INPUT,
                         "%s: VTKHDF needs the HDF5 library, which cannot be "
                         "loaded (%s); install " HDF5_PACKAGE ", or use .vtu",
                         path, why == NULL ? "it does not start" : why);
    }
    h->H5Eset_auto2(H5E_DEFAULT, NULL, NULL); /* it prints no errors */
    return 0;
}

/* In memory that both processes share. */
struct report {
    struct host_error error;
    bool done;
};

/* Processor seconds for so many bytes, however they unpack. */
static void limit(size_t bytes) {
    struct rlimit none = {0, 0}, time;
    rlim_t most = 60 + 8 * (bytes >> 20);
    (void)setrlimit(RLIMIT_CORE, &none);
    if (getrlimit(RLIMIT_CPU, &time) == 0 && time.rlim_cur > most) {
        time.rlim_cur = most;
        (void)setrlimit(RLIMIT_CPU, &time);
    }
}

/* No handler of this program's runs in it, and it does not outlive it. */
static _Noreturn void child(const struct host_hdf5_work *work,
                            struct report *report, pid_t parent,
                            const sigset_t *signals) {
    struct host_error error = {0};
    struct host_hdf5 h = {0};
    for (int i = 1; i < NSIG; i++)
        (void)signal(i, SIG_DFL);
    (void)signal(SIGINT, SIG_IGN); /* its parent ends by that, and then it */
    (void)signal(SIGXFSZ, SIG_IGN);
    (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
    (void)sigprocmask(SIG_SETMASK, signals, NULL);
    limit(work->bytes);
    if (getppid() == parent && load(&h, work->path, &error) == 0 &&
        work->run != NULL)
        work->run(work->context, &h, &error);
    report->error = error;
    report->done = true;
    _exit(0);
}

static int run_apart(const struct host_hdf5_work *work, struct report *report,
                     struct host_error *error) {
    sigset_t all, before;
    int status = 0;
    pid_t parent = getpid();
    (void)sigfillset(&all);
    (void)pthread_sigmask(SIG_SETMASK, &all, &before);
    pid_t pid = fork();
    if (pid == 0)
        child(work, report, parent, &before);
    (void)pthread_sigmask(SIG_SETMASK, &before, NULL);
    if (pid < 0)
        return host_fail_memory(error, "a process");
    while (waitpid(pid, &status, 0) < 0 && errno == EINTR) {
    }
    if (report->done) {
        *error = report->error;
    } else {
        host_fail(error, HOST_INPUT,
                  "%s: the HDF5 library has crashed on this file (%s); %s",
                  work->path,
                  WIFSIGNALED(status) ? strsignal(WTERMSIG(status))
                                      : "it ended the process",
                  work->instead);
    }
    return error->code;
}

int host_hdf5_run(const struct host_hdf5_work *work, struct host_error *error) {
    struct report *report = mmap(NULL, sizeof *report, PROT_READ | PROT_WRITE,
                                 MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (report == MAP_FAILED)
        return host_fail_memory(error, "a process");
    run_apart(work, report, error);
    (void)munmap(report, sizeof *report);
    return error->code;
}
