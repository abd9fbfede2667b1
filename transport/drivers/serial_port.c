#include "serial_port.h"

#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <libserialport.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

/* Device numbers, for ever: of the slaves, wherever they are mounted, and of
 * what every master is opened by. */
enum { PSEUDO_FIRST = 136, PSEUDO_LAST = 143, PTMX_MAJOR = 5, PTMX_MINOR = 2 };

/* --- who has it ----------------------------------------------------------- */

static bool is_pseudo_terminal(dev_t device) {
    return major(device) >= PSEUDO_FIRST && major(device) <= PSEUDO_LAST;
}

/* Pseudo-terminals have numbers of their own in every container, where another
 * file system makes them. */
static bool is_same(const struct stat *a, const struct stat *b) {
    return S_ISCHR(a->st_mode) && a->st_rdev == b->st_rdev &&
           (!is_pseudo_terminal(a->st_rdev) || a->st_dev == b->st_dev);
}

/* Whether an open file is the master of the pseudo-terminal of that number. */
static bool is_master(const char *pid, const char *fd, int number) {
    char path[PATH_MAX], line[64];
    int index = -1;
    snprintf(path, sizeof path, "/proc/%s/fdinfo/%s", pid, fd);
    FILE *file = fopen(path, "re");
    while (file != NULL && fgets(line, sizeof line, file) != NULL)
        (void)sscanf(line, "tty-index: %d", &index);
    if (file != NULL)
        fclose(file);
    return index == number;
}

/* A process that has made a pseudo-terminal and holds its master stands in the
 * place of the cable: it may keep the slave open as well, as socat does, so
 * that the master is not hung up before somebody comes. */
static bool has_open(const char *pid, const struct stat *device) {
    char path[PATH_MAX];
    struct dirent *entry;
    struct stat about;
    bool found = false, made = false;
    int number = is_pseudo_terminal(device->st_rdev)
                     ? (int)((major(device->st_rdev) - PSEUDO_FIRST) << 8 |
                             minor(device->st_rdev))
                     : -1;
    snprintf(path, sizeof path, "/proc/%s/fd", pid);
    DIR *fds = opendir(path);
    while (fds != NULL && !made && (entry = readdir(fds)) != NULL) {
        if (entry->d_name[0] == '.' ||
            fstatat(dirfd(fds), entry->d_name, &about, 0) != 0 ||
            !S_ISCHR(about.st_mode))
            continue;
        found = found || is_same(&about, device);
        made = number >= 0 &&
               about.st_rdev == makedev(PTMX_MAJOR, PTMX_MINOR) &&
               is_master(pid, entry->d_name, number);
    }
    if (fds != NULL)
        closedir(fds);
    return found && !made;
}

static void read_name(const char *pid, char *name, size_t size) {
    char path[PATH_MAX];
    snprintf(path, sizeof path, "/proc/%s/comm", pid);
    FILE *file = fopen(path, "re");
    snprintf(name, size, "a program without a name");
    if (file != NULL) {
        (void)fgets(name, (int)size, file);
        name[strcspn(name, "\n")] = '\0';
        fclose(file);
    }
}

/* The process other than this that has a device open: its number and its name,
 * as far as /proc tells; 0: none that it tells of.  Whoever has the master of a
 * pseudo-terminal does not count. */
static int serial_port_holder(const char *device, char *name, size_t size) {
    struct stat about;
    struct dirent *entry;
    int holder = 0;
    if (stat(device, &about) != 0)
        return 0;
    DIR *processes = opendir("/proc");
    while (processes != NULL && holder == 0 &&
           (entry = readdir(processes)) != NULL) {
        int pid = isdigit((unsigned char)entry->d_name[0])
                      ? (int)strtol(entry->d_name, NULL, 10)
                      : 0;
        if (pid > 0 && pid != getpid() && has_open(entry->d_name, &about)) {
            read_name(entry->d_name, name, size);
            holder = pid;
        }
    }
    if (processes != NULL)
        closedir(processes);
    return holder;
}

/* --- which it is ---------------------------------------------------------- */

/* Whether a terminal is plugged in at "1-1.3", by the path that /sys gives. */
static bool is_at(const char *device, const char *position) {
    char link[PATH_MAX], path[PATH_MAX], want[SERIAL_NAME_MAX + 2];
    const char *base = strrchr(device, '/');
    snprintf(link, sizeof link, "/sys/class/tty/%s/device",
             base == NULL ? device : base + 1);
    snprintf(want, sizeof want, "/%s/", position);
    return realpath(link, path) != NULL && strstr(path, want) != NULL;
}

static bool fits(struct sp_port *port, const char *name) {
    if (strncmp(name, "usb:", 4) == 0) {
        const char *number = sp_get_port_usb_serial(port);
        return number != NULL && strcmp(number, name + 4) == 0;
    }
    return is_at(sp_get_port_name(port), name + 3);
}

/* The device that a name stands for: 0, or -1 and the fault. */
static int find(struct serial_port *port) {
    const char *name = port->settings.name;
    struct sp_port **list;
    unsigned count = 0;
    if (strncmp(name, "usb:", 4) != 0 && strncmp(name, "at:", 3) != 0) {
        snprintf(port->device, sizeof port->device, "%s", name);
        return 0;
    }
    if (sp_list_ports(&list) != SP_OK) {
        snprintf(port->fault, sizeof port->fault,
                 "%s: this machine does not list its ports; is /sys mounted?",
                 name);
        return -1;
    }
    for (size_t i = 0; list[i] != NULL; i++) {
        if (fits(list[i], name) && count++ == 0) {
            snprintf(port->device, sizeof port->device, "%s",
                     sp_get_port_name(list[i]));
        }
    }
    sp_free_port_list(list);
    if (count != 1) {
        snprintf(port->fault, sizeof port->fault,
                 count == 0
                     ? "%s: no such port; plug the adapter in, or give another"
                     : "%s: fits several ports; give one as at:BUS-PORT",
                 name);
    }
    return count == 1 ? 0 : -1;
}

/* --- opening -------------------------------------------------------------- */

#define PLUG_IN "plug it in, or give another: ls /dev/serial/by-id"

static int refuse(struct serial_port *port, const char *why, const char *help) {
    snprintf(port->fault, sizeof port->fault, "%s: %s; %s", port->device, why,
             help);
    return -1;
}

/* Tells who has the port, where somebody has it. */
static int refuse_used(struct serial_port *port) {
    char name[64], why[128];
    int pid = serial_port_holder(port->device, name, sizeof name);
    if (pid == 0)
        return refuse(port, "in use", "close the program that uses it");
    snprintf(why, sizeof why, "in use by process %d (%s)", pid, name);
    return refuse(port, why, "end that, or give another port");
}

static int refuse_errno(struct serial_port *port, int reason) {
    return reason == EBUSY    ? refuse_used(port)
           : reason == EACCES ? refuse(port, strerror(reason),
                                       "join its group, and log in anew")
                              : refuse(port, strerror(reason), PLUG_IN);
}

/* For this process alone, also against one that may override TIOCEXCL. */
static bool hold(const struct serial_port *port, int fd) {
    char name[64];
    return ioctl(fd, TIOCEXCL) == 0 && flock(fd, LOCK_EX | LOCK_NB) == 0 &&
           serial_port_holder(port->device, name, sizeof name) == 0;
}

/* Both lines in one step: some boards reset on one without the other. */
static void set_lines(const struct serial_port *port, int fd) {
    int lines = (port->settings.dtr ? TIOCM_DTR : 0) |
                (port->settings.rts ? TIOCM_RTS : 0);
    int have = 0, mask = TIOCM_DTR | TIOCM_RTS;
    if (port->settings.rts_cts)
        mask = TIOCM_DTR; /* RTS is the driver's */
    if (ioctl(fd, TIOCMGET, &have) == 0 && (have & mask) != (lines & mask)) {
        lines = (have & ~mask) | (lines & mask);
        (void)ioctl(fd, TIOCMSET, &lines);
    }
}

/* Rate and flow control by the library, which knows rates without a name. */
static int set_rate(struct sp_port *library,
                    const struct serial_port_settings *s) {
    if (s->baud != 0 && sp_set_baudrate(library, (int)s->baud) != SP_OK)
        return -1;
    return !s->rts_cts ||
                   sp_set_flowcontrol(library, SP_FLOWCONTROL_RTSCTS) == SP_OK
               ? 0
               : -1;
}

static int open_by_library(struct serial_port *port, const char *path) {
    struct sp_port *library = NULL;
    int fd = -1;
    if (sp_get_port_by_name(path, &library) != SP_OK)
        return refuse(port, "no such serial port", PLUG_IN);
    if (sp_open(library, SP_MODE_READ_WRITE) != SP_OK) {
        int reason = sp_last_error_code();
        sp_free_port(library);
        return refuse_errno(port, reason);
    }
    int held = -1, status = -1;
    if (sp_get_port_handle(library, &held) == SP_OK && hold(port, held)) {
        status =
            serial_raw(held) == 0 && set_rate(library, &port->settings) == 0
                ? 0
                : refuse(port, "does not take its settings",
                         "try another baud rate");
    } else {
        (void)refuse_used(port);
    }
    if (status == 0) {
        /* The library's close would be ours without its deadline. */
        fd = fcntl(held, F_DUPFD_CLOEXEC, 0);
        set_lines(port, held);
    } else {
        (void)tcflush(held, TCOFLUSH);
    }
    (void)sp_close(library);
    sp_free_port(library);
    return status == 0 && fd < 0 ? refuse_errno(port, errno) : fd;
}

static int open_terminal(struct serial_port *port, const char *path) {
    int fd = serial_open(path, port->settings.baud, false);
    if (fd < 0)
        return refuse_errno(port, errno);
    if (!hold(port, fd)) {
        serial_close(fd);
        return refuse_used(port);
    }
    return fd;
}

/* The name may be a link, which may lead elsewhere the next time; the library
 * knows devices by their own names alone. */
static int open_device(struct serial_port *port) {
    char path[PATH_MAX];
    struct stat about;
    if (realpath(port->device, path) == NULL || stat(path, &about) != 0)
        return refuse_errno(port, errno);
    if (!S_ISCHR(about.st_mode))
        return refuse(port, "not a serial port", "give the device of one");
    return is_pseudo_terminal(about.st_rdev) ? open_terminal(port, path)
                                             : open_by_library(port, path);
}

static uint64_t clock_us(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
}

static int look(struct serial_port *port) {
    int fd = find(port) == 0 ? open_device(port) : -1;
    port->look_us = clock_us();
    if (fd < 0)
        return -1;
    port->pipe.fd = fd;
    port->pipe.counts = true;
    port->pipe.closed = false;
    port->pipe.ahead_microbytes = 0;
    port->fault[0] = '\0';
    return 0;
}

/* The pipe is closed: the port is let go, and looked for from time to time. */
static void recover(void *context) {
    struct serial_port *port = context;
    if (port->pipe.fd >= 0) {
        serial_close(port->pipe.fd);
        port->pipe.fd = -1;
        refuse(port, "the port is gone", "plug it in");
    }
    if (clock_us() - port->look_us >= SERIAL_LOOK_US && look(port) == 0)
        port->returned++;
}

int serial_port_open(struct serial_port *port,
                     const struct serial_port_settings *settings) {
    memset(port, 0, sizeof *port);
    port->settings = *settings;
    serial_pipe_init(&port->pipe, -1, settings->baud);
    port->pipe.recover = recover;
    port->pipe.context = port;
    return look(port);
}

void serial_port_close(struct serial_port *port) {
    serial_close(port->pipe.fd);
    port->pipe.fd = -1;
    port->pipe.closed = true;
    port->pipe.recover = NULL;
}

int serial_port_set(const struct serial_port *port, bool rts, bool high) {
    int line = rts ? TIOCM_RTS : TIOCM_DTR;
    if (port->pipe.fd < 0) {
        errno = ENODEV;
        return -1;
    }
    return ioctl(port->pipe.fd, high ? TIOCMBIS : TIOCMBIC, &line);
}
