#include "board_emulated.h"

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "emulator.h"
#include "host/formats/source.h"
#include "node/loader/flash.h"
#include "node/loader/image.h"
#include "node/loader/slots.h"
#include "transport/drivers/sign_sodium.h"
#include "port.h"
#include "host/base/error.h"
#include "host/base/create.h"
#include "host/base/progress.h"
#include "transport/drivers/tcp.h"
#include "transport/drivers/unix_file.h"

static_assert(LOADER_RAM_SECTORS * LOADER_RAM_SECTOR <= HOST_FLASH_BYTES &&
                  (LOADER_CARD_FIRST + LOADER_CARD_BLOCKS) *
                          LOADER_CARD_BLOCK <=
                      HOST_FLASH_BYTES,
              "what a loader knows of it is there");

static void *map(int fd) {
    return mmap(NULL, HOST_FLASH_BYTES, PROT_READ | PROT_WRITE, MAP_SHARED, fd,
                0);
}

static int fill(int fd) {
    static uint8_t erased[1 << 16];
    memset(erased, 0xff, sizeof erased);
    for (size_t at = 0; at < HOST_FLASH_BYTES; at += sizeof erased)
        if (pwrite(fd, erased, sizeof erased, (off_t)at) !=
            (ssize_t)sizeof erased)
            return -1;
    return 0;
}

/* A chip as it is sold, erased, or a card with a table: 0, or -1 and errno. */
static int host_chip_make(int fd, bool card) {
    if (fill(fd) != 0)
        return -1;
    void *bytes = card ? map(fd) : NULL;
    if (bytes == MAP_FAILED)
        return -1;
    if (bytes != NULL) {
        struct loader_card table = LOADER_CARD_IN(bytes);
        (void)loader_card_format(&table);
        (void)munmap(bytes, HOST_FLASH_BYTES);
    }
    return 0;
}

/* Whether the board would start just this. */
static bool has(const struct loader_flash *flash,
                const struct loader_image *image) {
    const struct loader_rules rules = {.flash = flash,
                                       .suite = &sign_sodium,
                                       .key = image->key,
                                       .board = image->board,
                                       .address = image->address,
                                       .room = image->bytes};
    struct loader_slots slots;
    loader_slots_open(&slots, &rules);
    unsigned slot = loader_slots_choose(&slots, false);
    return slot < LOADER_SLOTS &&
           memcmp(slots.image[slot].digest, image->digest,
                  sizeof image->digest) == 0;
}

static int install(const struct loader_flash *flash,
                   const struct host_source *source, const char *path,
                   struct host_error *error) {
    struct loader_image image;
    if (source->bytes < LOADER_HEADER_BYTES ||
        loader_image_unpack(&image, source->data) != LOADER_GOOD ||
        image.bytes != source->bytes - LOADER_HEADER_BYTES) {
        return host_fail(error, HOST_CUBE,
                         "%s: not a board's image, or not all of it; make it "
                         "with: make firmware",
                         path);
    }
    if (!has(flash, &image) &&
        !loader_slots_install(flash, source->data, (uint32_t)source->bytes)) {
        return host_fail(error, HOST_CUBE,
                         "%s: does not fit into a slot of the board's flash; "
                         "give a smaller image",
                         path);
    }
    return 0;
}

/* A card that somebody has given another table has no place for an image. */
static int install_mapped(void *bytes, bool card,
                          const struct host_source *source, const char *path,
                          struct host_error *error) {
    struct loader_card table = LOADER_CARD_IN(bytes);
    const struct loader_flash chip = LOADER_RAM(bytes);
    const struct loader_flash on_card = LOADER_CARD(&table);
    if (card && !loader_card_open(&table)) {
        return host_fail(error, HOST_CUBE,
                         "the board's card: no partition of type DA for "
                         "images; remove the file, and it is made anew");
    }
    return install(card ? &on_card : &chip, source, path, error);
}

/* The file has HOST_FLASH_BYTES, and no board uses it.  0, or HOST_CUBE: what
 * is at the path is no image, or the card has no place for it. */
static int host_chip_install(int fd, bool card, const char *path,
                             struct host_error *error) {
    struct host_source source;
    if (host_source_open_bounded(&source, path, LOADER_IMAGE_MAX, "an image",
                                 error) != 0)
        return error->code;
    void *bytes = map(fd);
    if (bytes == MAP_FAILED) {
        host_fail(error, HOST_BROKEN, "flash: %s; free some memory",
                  strerror(errno));
    } else {
        (void)install_mapped(bytes, card, &source, path, error);
        (void)munmap(bytes, HOST_FLASH_BYTES);
    }
    host_source_close(&source);
    return error->code;
}

/* --- board emulated ------------------------------------------------------- */

/* One board of the cube, and what outlives its process. */
struct board {
    struct host_emulator emulator;
    struct host_console console;
    struct host_qmp qmp;
    int monitor[2]; /* the host's end, and the emulator's */
    int said;       /* what UART 0 has sent, where no frames go over it; */
    off_t heard;    /* so far */
    int flash;
    pid_t pid; /* of the process that qmp speaks to */
    /* Sockets in the folder, where there is one: of UARTs, of the monitor. */
    char wire[HOST_UARTS_MAX][80], control[80];
};

struct cube {
    struct host_cluster cluster;
    struct host_machine machine; /* the cluster's own */
    struct host_troubled troubled;
    int errors; /* what the emulators have said of themselves */
    struct board board[HOST_EMULATED_MAX];
};

/* One at a time, see boards.h. */
static struct cube the_cube;

/* --- boards --------------------------------------------------------------- */

/* In the child. */
static void become(const void *context, unsigned node) {
    const struct cube *cube = context;
    const struct host_cluster *c = &cube->cluster;
    struct host_emulator emulator = cube->board[node].emulator;
    emulator.errors = cube->errors;
    for (unsigned d = 0; d < c->dimension; d++)
        if (emulator.uart[1 + d].wire.path == NULL)
            emulator.uart[1 + d].wire.fd = c->wires.end[node][d];
    if (node == 0 && emulator.uart[0].wire.path == NULL)
        emulator.uart[0].wire.fd = c->wires.end[0][c->dimension];
    host_emulator_become(&emulator, node);
}

static int refuse(const char *what, struct host_error *error) {
    return host_fail(error, HOST_BROKEN, "%s: %s; free some files, or memory",
                     what, strerror(errno));
}

static int refuse_file(const char *name,
                       const struct host_cluster_options *options,
                       struct host_error *error) {
    return host_fail(error, HOST_INPUT,
                     "%s/%s: cannot be written (%s); free %u MB a board there, "
                     "or choose another place",
                     options->directory, name, strerror(errno),
                     HOST_FLASH_BYTES >> 20);
}

/* A file in the folder, or one that has no name. */
static int open_file(const char *name,
                     const struct host_cluster_options *options,
                     struct host_error *error) {
    if (options->directory == NULL) {
        int file = memfd_create(name, MFD_CLOEXEC);
        return file >= 0 ? file : (refuse(name, error), -1);
    }
    int file = host_folder_file(options->folder, name, O_RDWR | O_CREAT);
    if (file < 0 && (errno == ELOOP || errno == EPERM)) {
        host_fail(error, HOST_INPUT,
                  "%s/%s: is no plain file of this user's alone; remove it, or "
                  "choose another place",
                  options->directory, name);
    } else if (file < 0) {
        refuse_file(name, options, error);
    }
    return file;
}

/* A chip that is new, unless a file has one, with the board's image; empty: as
 * it is. */
static int make_flash(struct board *board, unsigned node,
                      const struct host_cluster_options *options,
                      struct host_error *error) {
    struct stat about;
    char name[32];
    if (board->emulator.bare->flash == HOST_FLASH_NONE)
        return 0;
    bool card = board->emulator.bare->flash == HOST_FLASH_CARD;
    snprintf(name, sizeof name, "flash%u", node);
    board->flash = open_file(name, options, error);
    if (board->flash < 0)
        return error->code;
    if ((fstat(board->flash, &about) != 0 ||
         about.st_size != HOST_FLASH_BYTES) &&
        host_chip_make(board->flash, card) != 0) {
        if (options->directory == NULL)
            return refuse(name, error);
        (void)refuse_file(name, options, error);
        (void)unlinkat(options->folder, name, 0); /* half a chip fills what is
                                                     full */
        return error->code;
    }
    board->emulator.flash.fd = board->flash;
    return options->empty ? 0
                          : host_chip_install(board->flash, card,
                                              board->emulator.image, error);
}

/* What UART 0 says where no frames go over it. */
static int make_log(struct board *board, unsigned node,
                    const struct host_cluster_options *options,
                    struct host_error *error) {
    char name[32];
    snprintf(name, sizeof name, "console%u.log", node);
    board->said = open_file(name, options, error);
    if (board->said >= 0 && ftruncate(board->said, 0) != 0)
        refuse(name, error);
    board->emulator.uart[0].log.fd = board->said;
    return error->code;
}

/* What is to be reached from outside: the host's wire or the console, those to
 * nodes that are left out or not joined, and the monitor.  Their paths lead
 * through the open folder, whatever its name leads to meanwhile. */
static void name_files(struct cube *cube, unsigned node,
                       const struct host_cluster_options *options) {
    struct board *board = &cube->board[node];
    struct host_emulator *e = &board->emulator;
    const size_t size = sizeof board->control;
    char name[32];
    e->folder = options->folder;
    snprintf(board->control, size, "/proc/self/fd/%d/qmp%u.socket",
             options->folder, node);
    e->qmp.path = board->control;
    for (unsigned i = 0; 1u << i <= options->nodes; i++) {
        unsigned other = i == 0 ? node : node ^ 1u << (i - 1);
        if (i == 0 || options->open || (options->left_out >> other & 1) != 0) {
            host_emulated_wire(node, i, name);
            snprintf(board->wire[i], size, "/proc/self/fd/%d/%s",
                     options->folder, name);
            e->uart[i].wire.path = board->wire[i];
        }
    }
}

void host_emulated_wire(unsigned node, unsigned uart, char name[32]) {
    if (uart == 0) {
        snprintf(name, 32, node == 0 ? "host.socket" : "console%u.socket",
                 node);
    } else {
        snprintf(name, 32, "%u-%u.socket", node, node ^ 1u << (uart - 1));
    }
}

static int make_board(struct cube *cube, const struct host_bare *bare,
                      unsigned node, const struct host_cluster_options *options,
                      struct host_error *error) {
    struct board *board = &cube->board[node];
    host_console_init(&board->console, node, bare->machine);
    if (host_emulator_find(bare, &board->emulator, error) != 0)
        return error->code;
    if (options->directory != NULL) {
        name_files(cube, node, options);
    } else if (unix_file_pair(board->monitor) != 0) {
        return refuse("monitor", error);
    } else {
        host_qmp_init(&board->qmp, board->monitor[0]);
        board->emulator.qmp.fd = board->monitor[1];
    }
    if (node != 0 && make_log(board, node, options, error) != 0)
        return error->code;
    return make_flash(board, node, options, error);
}

static void close_boards(struct cube *cube) {
    for (unsigned i = 0; i < HOST_EMULATED_MAX; i++) {
        struct board *board = &cube->board[i];
        int *const files[] = {&board->monitor[0], &board->monitor[1],
                              &board->said, &board->flash};
        for (size_t k = 0; k < sizeof files / sizeof files[0]; k++) {
            if (*files[k] >= 0) {
                close(*files[k]);
                *files[k] = -1;
            }
        }
    }
    if (cube->errors >= 0) {
        close(cube->errors);
        cube->errors = -1;
    }
}

/* --- as a machine --------------------------------------------------------- */

/* What consoles have said since. */
static void hear_consoles(struct cube *cube) {
    uint8_t bytes[1024];
    for (unsigned i = 1; i < cube->cluster.nodes; i++) {
        struct board *board = &cube->board[i];
        ssize_t got;
        if (board->said < 0)
            continue;
        while ((got = pread(board->said, bytes, sizeof bytes, board->heard)) >
               0) {
            board->heard += got;
            host_console_hear(&board->console, bytes, (size_t)got);
        }
    }
}

static int make_trouble(struct cube *cube, struct host_error *error) {
    static const enum host_qmp_request requests[] = {
        [HOST_TROUBLE_RESET] = HOST_QMP_RESET,
        [HOST_TROUBLE_STOP] = HOST_QMP_STOP,
        [HOST_TROUBLE_CONT] = HOST_QMP_CONT};
    enum host_trouble_kind kind;
    unsigned node;
    if (!host_trouble_due(&cube->troubled, host_now_us(), &kind, &node))
        return 0;
    if (kind == HOST_TROUBLE_KILL) {
        (void)host_child_kill(&cube->cluster.process[node]);
        return 0;
    }
    return host_qmp_ask(&cube->board[node].qmp, requests[kind], error);
}

/* The last line of what emulators have said of themselves, which begins with
 * their name; a processor's registers may follow. */
static void tell_errors(const struct cube *cube) {
    char text[4096];
    const char *said = NULL, *image = "";
    off_t size = lseek(cube->errors, 0, SEEK_END);
    off_t from =
        size > (off_t)sizeof text - 1 ? size - ((off_t)sizeof text - 1) : 0;
    ssize_t got = pread(cube->errors, text, sizeof text - 1, from);
    text[got > 0 ? got : 0] = '\0';
    for (char *rest = text, *line; (line = strsep(&rest, "\n")) != NULL;)
        said =
            strncmp(line, "qemu", 4) == 0 && strstr(line, ": warning: ") == NULL
                ? line
                : said;
    for (unsigned i = 0; i < cube->cluster.nodes && *image == '\0'; i++)
        image = cube->board[i].emulator.first;
    if (said != NULL)
        host_note("%s; is %s whole? make firmware makes it", said, image);
}

static int machine_check(void *context, struct host_error *error) {
    struct cube *cube = &the_cube;
    hear_consoles(cube);
    if (cube->machine.check(context, error) != 0) {
        tell_errors(cube);
        return error->code;
    }
    for (unsigned i = 0; i < cube->cluster.nodes; i++) {
        struct board *board = &cube->board[i];
        if (board->pid != cube->cluster.process[i].pid) {
            board->pid = cube->cluster.process[i].pid;
            host_qmp_forget(&board->qmp);
        }
    }
    return make_trouble(cube, error);
}

static const char *machine_doubt(void *context, unsigned node) {
    static char text[sizeof "its console says: " + HOST_CONSOLE_TEXT];
    const char *fault = host_console_fault(&the_cube.board[node].console);
    (void)context;
    snprintf(text, sizeof text, "its console says: %s",
             fault == NULL ? "" : fault);
    return fault == NULL ? NULL : text;
}

/* A board has no end: nobody waits for it. */
static bool machine_ended(void *context) {
    (void)context;
    return true;
}

static void machine_stop(void *context) {
    struct cube *cube = &the_cube;
    cube->machine.stop(context);
    hear_consoles(cube);
    close_boards(cube);
}

static struct host_machine machine_of(struct cube *cube) {
    struct host_machine machine = cube->machine;
    machine.pipe = host_console_pipe(&cube->board[0].console, machine.pipe);
    machine.slow = true;
    machine.check = machine_check;
    machine.doubt = machine_doubt;
    machine.ended = machine_ended;
    machine.stop = machine_stop;
    return machine;
}

int host_emulated_start(const struct host_board *board,
                        const struct host_cluster_options *options,
                        struct host_started *started,
                        struct host_error *error) {
    const struct host_bare *bare = board->bare;
    struct cube *cube = &the_cube;
    struct host_cluster_options mine = *options;
    struct host_link link = *options->link;
    struct host_emulator *any = &cube->board[0].emulator;
    memset(cube, 0, sizeof *cube);
    cube->errors = -1;
    for (unsigned i = 0; i < HOST_EMULATED_MAX; i++) {
        struct board *b = &cube->board[i];
        b->monitor[0] = b->monitor[1] = b->said = b->flash = -1;
    }
    for (unsigned i = 0; i < options->nodes && error->code == 0; i++) {
        if ((options->left_out >> i & 1) == 0) {
            any = &cube->board[i].emulator;
            (void)make_board(cube, bare, i, options, error);
        }
    }
    cube->troubled.trouble = options->trouble;
    cube->troubled.nodes = options->nodes;
    link.pair = bare->pair;
    mine.link = &link;
    mine.program = any->program;
    mine.become = become;
    mine.context = cube;
    mine.serial_baud = bare->serial_baud;
    cube->errors = memfd_create("errors", MFD_CLOEXEC);
    if (cube->errors < 0 || fcntl(cube->errors, F_SETFL, O_APPEND) != 0)
        (void)refuse("errors", error);
    if (error->code != 0 ||
        host_cluster_start(&cube->cluster, &mine, error) != 0) {
        close_boards(cube);
        return error->code;
    }
    cube->machine = host_cluster_machine(&cube->cluster);
    started->machine = machine_of(cube);
    started->limited = true;
    started->memory_held = ", held by the board";
    (void)tcp_buffers(cube->cluster.port[0].tcp.fd, &started->send_bytes,
                      &started->receive_bytes);
    return 0;
}
