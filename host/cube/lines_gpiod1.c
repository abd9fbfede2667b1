/* The calls of libgpiod 1.6. */
#include <errno.h>
#include <gpiod.h>
#include <stdlib.h>

#include "gpio.h"

struct host_gpio {
    struct gpiod_chip *chip;
    struct gpiod_line *line; /* of the chip, and closed with it */
};

/* No chip of that name: those that there are. */
static int refuse_chip(char why[HOST_GPIO_WHY], const char *name, int reason) {
    char found[HOST_GPIO_CHIPS] = "";
    struct gpiod_chip *chip;
    struct gpiod_chip_iter *chips = gpiod_chip_iter_new();
    while (chips != NULL && (chip = gpiod_chip_iter_next(chips)) != NULL)
        host_gpio_list(found, gpiod_chip_name(chip), gpiod_chip_label(chip));
    if (chips != NULL)
        gpiod_chip_iter_free(chips);
    return host_gpio_no_chip(why, name, reason, found);
}

static int find_line(struct host_gpio *gpio, const struct host_cube_pin *pin,
                     char why[HOST_GPIO_WHY]) {
    gpio->line = pin->name[0] != '\0'
                     ? gpiod_chip_find_line(gpio->chip, pin->name)
                     : gpiod_chip_get_line(gpio->chip, pin->offset);
    return gpio->line != NULL
               ? 0
               : host_gpio_no_line(why, gpiod_chip_name(gpio->chip),
                                   gpiod_chip_num_lines(gpio->chip), pin);
}

static int request(struct host_gpio *gpio, const struct host_cube_pin *pin,
                   char why[HOST_GPIO_WHY]) {
    const char *user = gpiod_line_consumer(gpio->line);
    int flags = (pin->active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0) |
                (pin->open_drain ? GPIOD_LINE_REQUEST_FLAG_OPEN_DRAIN : 0);
    bool used = gpiod_line_is_used(gpio->line);
    if (!used &&
        gpiod_line_request_output_flags(gpio->line, "incode", flags, 0) == 0)
        return 0;
    if (used && user == NULL)
        user = "the kernel";
    return host_gpio_not_ours(why, gpiod_chip_name(gpio->chip),
                              gpiod_line_offset(gpio->line), used ? user : NULL,
                              errno);
}

int host_gpio_open(struct host_gpio **gpio, const struct host_cube_pin *pin,
                   char why[HOST_GPIO_WHY]) {
    struct host_gpio *opened = calloc(1, sizeof *opened);
    *gpio = opened;
    if (opened == NULL)
        return host_gpio_no_memory(why);
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
