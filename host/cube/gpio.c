#include "gpio.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

/* "Permission denied; join the group.." */
static int refuse(char why[HOST_GPIO_WHY], const char *what, int reason) {
    snprintf(why, HOST_GPIO_WHY, "%s: %s; %s", what, strerror(reason),
             reason == EACCES || reason == EPERM
                 ? "join the group that /dev/gpiochip0 belongs to, or run this "
                   "as root"
                 : "can it be an output, and what the file says of it?");
    return HOST_CUBE;
}

int host_gpio_no_memory(char why[HOST_GPIO_WHY]) {
    snprintf(why, HOST_GPIO_WHY, "no memory; end other programs");
    return HOST_CUBE;
}

int host_gpio_no_chip(char why[HOST_GPIO_WHY], const char *name, int reason,
                      const char *chips) {
    char what[HOST_PIN_NAME_MAX + 8];
    bool none = chips[0] == '\0';
    snprintf(what, sizeof what, "chip %.*s", HOST_PIN_NAME_MAX, name);
    if (none && (reason == EACCES || reason == EPERM))
        return refuse(why, what, reason);
    snprintf(why, HOST_GPIO_WHY, "%s: no such GPIO chip here; %s%s", what,
             none ? "this machine has none that can be opened" : "give one of ",
             chips);
    return HOST_CUBE;
}

int host_gpio_no_line(char why[HOST_GPIO_WHY], const char *chip, size_t lines,
                      const struct host_cube_pin *pin) {
    char line[HOST_PIN_NAME_MAX + 8];
    if (pin->name[0] != '\0')
        snprintf(line, sizeof line, "\"%s\"", pin->name);
    else
        snprintf(line, sizeof line, "%u", pin->offset);
    snprintf(why, HOST_GPIO_WHY,
             "%.60s has no line %s; give one of 0 to %zu, or a name that "
             "gpioinfo shows",
             chip, line, lines - 1);
    return HOST_INPUT;
}

int host_gpio_not_ours(char why[HOST_GPIO_WHY], const char *chip, unsigned line,
                       const char *user, int reason) {
    char what[80];
    snprintf(what, sizeof what, "line %u of %.50s", line, chip);
    if (user == NULL)
        return refuse(why, what, reason);
    snprintf(why, HOST_GPIO_WHY,
             "%s: in use by %s; end that, or give another line", what, user);
    return HOST_CUBE;
}

void host_gpio_list(char chips[HOST_GPIO_CHIPS], const char *name,
                    const char *label) {
    size_t used = strlen(chips);
    if (used + 80 > HOST_GPIO_CHIPS)
        return;
    snprintf(chips + used, HOST_GPIO_CHIPS - used, "%s%s (%s)",
             used == 0 ? "" : ", ", name, label);
}
