/* The calls of libgpiod 1.6. */
#include <errno.h>
#include <gpiod.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "gpio.h"

struct host_gpio {
    struct gpiod_chip *chip;
    struct gpiod_line *line; /* of the chip, and closed with it */
};

/* --- why not -------------------------------------------------------------- */

static int refuse(char why[HOST_GPIO_WHY], int code, const char *what,
                  const char *next) {
    snprintf(why, HOST_GPIO_WHY, "%s; %s", what, next);
    return code;
}

/* "Permission denied; join the group.." */
static int refuse_errno(char why[HOST_GPIO_WHY], const char *what, int reason) {
    snprintf(why, HOST_GPIO_WHY, "%s: %s; %s", what, strerror(reason),
             reason == EACCES || reason == EPERM
                 ? "join the group that /dev/gpiochip0 belongs to, or run this "
                   "as root"
                 : "can it be an output, and what the file says of it?");
    return HOST_CUBE;
}

/* No chip of that name: those that there are. */
static int refuse_chip(char why[HOST_GPIO_WHY], const char *name, int reason) {
    char what[HOST_PIN_NAME_MAX + 8], next[HOST_GPIO_WHY / 2] = "";
    size_t used = 0;
    struct gpiod_chip *chip;
    struct gpiod_chip_iter *chips = gpiod_chip_iter_new();
    while (chips != NULL && (chip = gpiod_chip_iter_next(chips)) != NULL) {
        used +=
            used + 80 > sizeof next
                ? 0
                : (size_t)snprintf(next + used, sizeof next - used, "%s%s (%s)",
                                   used == 0 ? "" : ", ", gpiod_chip_name(chip),
                                   gpiod_chip_label(chip));
    }
    if (chips != NULL)
        gpiod_chip_iter_free(chips);
    snprintf(what, sizeof what, "chip %.*s", HOST_PIN_NAME_MAX, name);
    if (used == 0 && (reason == EACCES || reason == EPERM))
        return refuse_errno(why, what, reason);
    snprintf(why, HOST_GPIO_WHY, "%s: no such GPIO chip here; %s%s", what,
             used == 0 ? "this machine has none that can be opened"
                       : "give one of ",
             next);
    return HOST_CUBE;
}

/* --- a line --------------------------------------------------------------- */

static int find_line(struct host_gpio *gpio, const struct host_cube_pin *pin,
                     char why[HOST_GPIO_WHY]) {
    char what[160], next[80];
    unsigned count = gpiod_chip_num_lines(gpio->chip);
    gpio->line = pin->name[0] != '\0'
                     ? gpiod_chip_find_line(gpio->chip, pin->name)
                     : gpiod_chip_get_line(gpio->chip, pin->offset);
    if (gpio->line != NULL)
        return 0;
    snprintf(next, sizeof next,
             "give one of 0 to %u, or a name that gpioinfo shows", count - 1);
    if (pin->name[0] != '\0') {
        snprintf(what, sizeof what, "%s has no line \"%s\"",
                 gpiod_chip_name(gpio->chip), pin->name);
    } else {
        snprintf(what, sizeof what, "%s has no line %u",
                 gpiod_chip_name(gpio->chip), pin->offset);
    }
    return refuse(why, HOST_INPUT, what, next);
}

static int request(struct host_gpio *gpio, const struct host_cube_pin *pin,
                   char why[HOST_GPIO_WHY]) {
    char what[160];
    const char *user = gpiod_line_consumer(gpio->line);
    int flags = (pin->active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0) |
                (pin->open_drain ? GPIOD_LINE_REQUEST_FLAG_OPEN_DRAIN : 0);
    snprintf(what, sizeof what, "line %u of %s", gpiod_line_offset(gpio->line),
             gpiod_chip_name(gpio->chip));
    if (gpiod_line_is_used(gpio->line)) {
        size_t used = strlen(what);
        snprintf(what + used, sizeof what - used, ": in use by %s",
                 user == NULL ? "the kernel" : user);
        return refuse(why, HOST_CUBE, what, "end that, or give another line");
    }
    return gpiod_line_request_output_flags(gpio->line, "incode", flags, 0) == 0
               ? 0
               : refuse_errno(why, what, errno);
}

int host_gpio_open(struct host_gpio **gpio, const struct host_cube_pin *pin,
                   char why[HOST_GPIO_WHY]) {
    struct host_gpio *opened = calloc(1, sizeof *opened);
    *gpio = opened;
    if (opened == NULL)
        return refuse(why, HOST_CUBE, "no memory", "end other programs");
    opened->chip = gpiod_chip_open_lookup(pin->chip);
    int status = opened->chip == NULL ? refuse_chip(why, pin->chip, errno)
                                      : find_line(opened, pin, why);
    status = status == 0 ? request(opened, pin, why) : status;
    if (status != 0) {
        host_gpio_close(opened);
        *gpio = NULL;
    }
    return status;
}

int host_gpio_set(struct host_gpio *gpio, bool active) {
    return gpiod_line_set_value(gpio->line, active);
}

void host_gpio_close(struct host_gpio *gpio) {
    if (gpio != NULL && gpio->chip != NULL)
        gpiod_chip_close(gpio->chip);
    free(gpio);
}
