#include "options.h"

#include <string.h>
#include <unistd.h>

#include "node/version.h"

static const char help[] =
    "Usage: incode-node ARGUMENT VALUE ...\n"
    "A node of a cube, as a process.  incode cube FILE prints the line for "
    "each "
    "node of\n"
    "a cube file.\n"
    "\n"
    "  --node N           its number; without, a neighbour tells it\n"
    "  --dimension N      of the cube: 2^N nodes, 0 to 10\n"
    "  --memory BYTES     data memory in all, stack included (4194304);\n"
    "                     below 4 GiB\n"
    "  --stack BYTES      of it, 48 KiB or more (65536)\n"
    "  --window N         frames a link and direction, 1 to 64 (0: by memory)\n"
    "  --serial-baud BAUD the cube has serial wires, the slowest so fast (0: "
    "none)\n"
    "  --host-port 0|1    besides node 0, this node has a host port (0)\n"
    "  --dead US          microseconds of silence after which a link is given "
    "up (0:\n"
    "                     never)\n"
    "  --key FILE         64 hexadecimal digits, as incode key FILE makes "
    "them: the key\n"
    "                     of the cube, without which no wire goes over TCP\n"
    "  --insecure [LINKS] these (as in 0,2), or all, go over TCP without a "
    "key: whoever\n"
    "                     reaches their addresses can take them over\n"
    "  --board linux      what this program is for: on another it does not "
    "start\n"
    "  --wire LINK=WIRE   opens the wire of that link, 0 to dimension (the "
    "host's):\n"
    "                     listen:ADDRESS:PORT, call:ADDRESS:PORT (in "
    "numbers),\n"
    "                     unix-listen:PATH, unix-call:PATH (of this machine "
    "and "
    "user),\n"
    "                     serial:DEVICE:BAUD or serial:DEVICE:BAUD:rtscts\n"
    "\n"
    "Of the host that starts nodes itself:\n"
    "  --host-ports N     nodes 0 to N - 1 have host ports, a power of two to "
    "8 "
    "(1)\n"
    "  --links FD,FD,..   the wires of links 0, 1, .. are these open files\n"
    "  --epoch N          of this start, never repeated\n"
    "  --awake US         microseconds to stay awake when there is nothing to "
    "do\n"
    "\n"
    "  --help, --version  print this, or the version\n"
    "\n"
    "Exit status: 0 done, 2 wrong usage, 4 it cannot start.\n";

static const char no_such[] = "no such argument";
static const char see_help[] = "see incode-node --help";

bool linux_options_answer(const char *argument) {
    static const char version[] = "incode-node " NODE_VERSION "\n";
    if (strcmp(argument, "--help") == 0 || strcmp(argument, "-h") == 0 ||
        strcmp(argument, "help") == 0) {
        (void)!write(STDOUT_FILENO, help, sizeof help - 1);
        return true;
    }
    if (strcmp(argument, "--version") == 0 || strcmp(argument, "-V") == 0) {
        (void)!write(STDOUT_FILENO, version, sizeof version - 1);
        return true;
    }
    return false;
}

static bool read_number(const char **text, uint64_t *value) {
    const char *at = *text;
    *value = 0;
    while (*at >= '0' && *at <= '9' && *value < UINT64_MAX / 100)
        *value = 10 * *value + (uint64_t)(*at++ - '0');
    bool good = at != *text;
    *text = at;
    return good;
}

static const char *read_links(const char *text, struct linux_options *options) {
    uint64_t fd;
    while (*text != '\0') {
        if (options->links_count == CUBE_LINKS_MAX ||
            !read_number(&text, &fd) || fd > INT16_MAX ||
            (*text != ',' && *text != '\0'))
            return "not open files as in 5,6,7";
        options->links[options->links_count++] = (int)fd;
        text += *text == ',';
    }
    return NULL;
}

static const char *read_wire(const char *text, struct linux_options *options) {
    const char *at = text;
    uint64_t link;
    if (!read_number(&at, &link) || *at != '=')
        return "not as in 2=call:10.0.0.1:7001";
    if (link >= CUBE_LINKS_MAX)
        return "no such link";
    if (options->wire[link] != NULL)
        return "that link has a wire already";
    options->wire[link] = text;
    options->wires_count++;
    return NULL;
}

static const char *read_insecure(const char *text,
                                 struct linux_options *options) {
    uint64_t link;
    while (*text != '\0') {
        if (!read_number(&text, &link) || link >= CUBE_LINKS_MAX ||
            (*text != ',' && *text != '\0'))
            return "not links as in 0,2";
        options->insecure |= 1u << link;
        text += *text == ',';
    }
    return NULL;
}

/* Whether an argument stands alone: --insecure without links. */
static bool is_alone(const char *name, const char *next) {
    return strcmp(name, "--insecure") == 0 &&
           (next == NULL || strncmp(next, "--", 2) == 0);
}

/* An argument and its value; what is wrong with it, or NULL. */
static const char *read_one(const char *name, const char *text,
                            struct linux_options *options) {
    const struct {
        const char *name;
        uint64_t *value, most;
    } known[] = {{"--node", &options->node, (1u << CUBE_DIMENSION_MAX) - 1},
                 {"--dimension", &options->dimension, CUBE_DIMENSION_MAX},
                 {"--memory", &options->memory, UINT32_MAX},
                 {"--stack", &options->stack, UINT32_MAX},
                 {"--window", &options->window, LINK_WINDOW_MAX},
                 {"--epoch", &options->epoch, UINT32_MAX},
                 {"--serial-baud", &options->serial_baud, UINT32_MAX},
                 {"--host-port", &options->host_port, 1},
                 {"--host-ports", &options->host_ports, CUBE_HOST_PORTS_MAX},
                 {"--dead", &options->dead, UINT32_MAX},
                 {"--awake", &options->awake, UINT32_MAX}};
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        if (strcmp(name, known[i].name) == 0) {
            bool good = read_number(&text, known[i].value) && *text == '\0';
            return !good                             ? "not a number"
                   : *known[i].value > known[i].most ? "too large"
                                                     : NULL;
        }
    }
    if (strcmp(name, "--links") == 0)
        return read_links(text, options);
    if (strcmp(name, "--wire") == 0)
        return read_wire(text, options);
    if (strcmp(name, "--board") == 0) {
        return strcmp(text, "linux") == 0 ? NULL
                                          : "another board's program starts it";
    }
    if (strcmp(name, "--insecure") == 0)
        return read_insecure(text, options);
    if (strcmp(name, "--key") == 0) {
        options->key = text;
        return NULL;
    }
    return no_such;
}

/* Every link has a wire, and there are no others. */
static bool wires_fit(const struct linux_options *options) {
    unsigned links = (unsigned)options->dimension +
                     (options->node == 0 || options->host_port != 0 ||
                              options->node < options->host_ports
                          ? 1
                          : 0);
    if (options->node == LINUX_UNNAMED) {
        links = options->links_count + options->wires_count;
        if (links == 0)
            return false; /* nobody could say who it is */
    }
    if (options->wires_count == 0)
        return options->links_count == links;
    for (unsigned i = 0; i < links; i++)
        if (options->wire[i] == NULL)
            return false;
    return options->links_count == 0 && options->wires_count == links;
}

/* Whether every link that --insecure names goes over TCP, and one at least
 * where it names none. */
static bool insecure_fits(const struct linux_options *options) {
    uint32_t net = 0, named = options->insecure;
    for (unsigned i = 0; i < CUBE_LINKS_MAX; i++) {
        const char *wire = options->wire[i];
        const char *kind = wire == NULL ? "" : strchr(wire, '=') + 1;
        bool tcp =
            strncmp(kind, "call:", 5) == 0 || strncmp(kind, "listen:", 7) == 0;
        net |= (uint32_t)tcp << i;
    }
    return named == UINT32_MAX ? net != 0 : (named & ~net) == 0;
}

bool linux_options_read(char **argv, struct linux_options *options,
                        struct linux_fault *fault) {
    memset(fault, 0, sizeof *fault);
    if (argv[0] == NULL) {
        fault->where = "arguments";
        fault->what = "none is given, and a node has to know its wires";
        fault->next = "incode run starts nodes by itself, and incode cube FILE "
                      "prints the lines for a cube of your own";
        return false;
    }
    fault->next = see_help;
    for (; argv[0] != NULL; argv += 2) {
        fault->where = argv[0];
        if (is_alone(argv[0], argv[1])) {
            options->insecure = UINT32_MAX;
            argv--;
            continue;
        }
        fault->what = "wants a value";
        if (argv[1] == NULL)
            return false;
        fault->what = read_one(argv[0], argv[1], options);
        if (fault->what != NULL) {
            fault->value = fault->what == no_such ? NULL : argv[1];
            return false;
        }
    }
    if (options->node != LINUX_UNNAMED &&
        options->node >= UINT64_C(1) << options->dimension) {
        fault->where = "--node";
        fault->what = "there is no such node in a cube of that --dimension";
        return false;
    }
    fault->where = options->links_count > 0 ? "--links" : "--wire";
    fault->what = "not one for each link: those to neighbours, and to the host "
                  "from node 0 and with --host-port 1";
    fault->next = "incode cube FILE prints those of a cube";
    if (!wires_fit(options))
        return false;
    fault->where = "--insecure";
    fault->what = "does nothing for a link that does not go over TCP";
    fault->next = "leave it out, or name links with call: or listen:";
    return insecure_fits(options);
}
