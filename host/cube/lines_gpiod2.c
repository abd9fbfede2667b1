/* The calls of libgpiod 2. */
#include <errno.h>
#include <glob.h>
#include <gpiod.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "gpio.h"

struct host_gpio {
    struct gpiod_chip *chip;
    struct gpiod_chip_info *info;
    struct gpiod_line_request *request;
    unsigned line;
};

/* --- a chip --------------------------------------------------------------- */

static bool open_path(struct host_gpio *gpio, const char *path) {
    gpio->chip = gpiod_chip_open(path);
    if (gpio->chip != NULL)
        gpio->info = gpiod_chip_get_info(gpio->chip);
    return gpio->info != NULL;
}

static void close_chip(struct host_gpio *gpio) {
    if (gpio->info != NULL)
        gpiod_chip_info_free(gpio->info);
    if (gpio->chip != NULL)
        gpiod_chip_close(gpio->chip);
    gpio->info = NULL;
    gpio->chip = NULL;
}

/* By its label, as version 1 looks first; else chips has those that there
 * are.  A link to a chip is no second one. */
static bool open_label(struct host_gpio *gpio, const char *label,
                       char chips[HOST_GPIO_CHIPS]) {
    glob_t found = {0};
    struct stat file;
    bool there = false;
    if (glob("/dev/gpiochip*", 0, NULL, &found) != 0)
        return false;
    for (size_t i = 0; i < found.gl_pathc && !there; i++) {
        if (lstat(found.gl_pathv[i], &file) != 0 || !S_ISCHR(file.st_mode))
            continue;
        if (open_path(gpio, found.gl_pathv[i])) {
            const char *own = gpiod_chip_info_get_label(gpio->info);
            host_gpio_list(chips, gpiod_chip_info_get_name(gpio->info), own);
            there = strcmp(own, label) == 0;
        }
        if (!there)
            close_chip(gpio);
    }
    globfree(&found);
    return there;
}

/* By its number, its name in /dev, or its path. */
static bool open_name(struct host_gpio *gpio, const char *name) {
    char path[HOST_PIN_NAME_MAX + 16];
    const char *folder = strncmp(name, "/dev/", 5) == 0 ? "" : "/dev/";
    if (name[0] != '\0' && name[strspn(name, "0123456789")] == '\0')
        folder = "/dev/gpiochip";
    snprintf(path, sizeof path, "%s%s", folder, name);
    return open_path(gpio, path);
}

static int find_chip(struct host_gpio *gpio, const char *name,
                     char why[HOST_GPIO_WHY]) {
    char chips[HOST_GPIO_CHIPS] = "";
    return open_label(gpio, name, chips) || open_name(gpio, name)
               ? 0
               : host_gpio_no_chip(why, name, errno, chips);
}

/* --- a line --------------------------------------------------------------- */

static int find_line(struct host_gpio *gpio, const struct host_cube_pin *pin,
                     char why[HOST_GPIO_WHY]) {
    const char *chip = gpiod_chip_info_get_name(gpio->info);
    size_t lines = gpiod_chip_info_get_num_lines(gpio->info);
    int line = pin->name[0] != '\0'
                   ? gpiod_chip_get_line_offset_from_name(gpio->chip, pin->name)
                   : -1;
    gpio->line = pin->name[0] != '\0' ? (unsigned)line : pin->offset;
    if (gpio->line >= lines)
        return host_gpio_no_line(why, chip, lines, pin);
    struct gpiod_line_info *info =
        gpiod_chip_get_line_info(gpio->chip, gpio->line);
    if (info == NULL)
        return host_gpio_not_ours(why, chip, gpio->line, NULL, errno);
    const char *user = gpiod_line_info_get_consumer(info);
    int status =
        !gpiod_line_info_is_used(info)
            ? 0
            : host_gpio_not_ours(why, chip, gpio->line,
                                 user == NULL ? "the kernel" : user, EBUSY);
    gpiod_line_info_free(info);
    return status;
}

/* -1: errno says why not. */
static int configure(struct gpiod_line_settings *settings,
                     const struct host_cube_pin *pin) {
    gpiod_line_settings_set_active_low(settings, pin->active_low);
    return gpiod_line_settings_set_direction(settings,
                                             GPIOD_LINE_DIRECTION_OUTPUT) ||
                   gpiod_line_settings_set_output_value(
                       settings, GPIOD_LINE_VALUE_INACTIVE) ||
                   gpiod_line_settings_set_drive(
                       settings, pin->open_drain ? GPIOD_LINE_DRIVE_OPEN_DRAIN
                                                 : GPIOD_LINE_DRIVE_PUSH_PULL)
               ? -1
               : 0;
}

static int request(struct host_gpio *gpio, const struct host_cube_pin *pin,
                   char why[HOST_GPIO_WHY]) {
    struct gpiod_line_settings *settings = gpiod_line_settings_new();
    struct gpiod_line_config *lines = gpiod_line_config_new();
    struct gpiod_request_config *ours = gpiod_request_config_new();
    int status = 0;
    if (settings == NULL || lines == NULL || ours == NULL) {
        status = host_gpio_no_memory(why);
    } else {
        gpiod_request_config_set_consumer(ours, "incode");
        if (configure(settings, pin) == 0 &&
            gpiod_line_config_add_line_settings(lines, &gpio->line, 1,
                                                settings) == 0)
            gpio->request = gpiod_chip_request_lines(gpio->chip, ours, lines);
        if (gpio->request == NULL)
            status =
                host_gpio_not_ours(why, gpiod_chip_info_get_name(gpio->info),
                                   gpio->line, NULL, errno);
    }
    gpiod_request_config_free(ours);
    gpiod_line_config_free(lines);
    gpiod_line_settings_free(settings);
    return status;
}

int host_gpio_open(struct host_gpio **gpio, const struct host_cube_pin *pin,
                   char why[HOST_GPIO_WHY]) {
    struct host_gpio *opened = calloc(1, sizeof *opened);
    *gpio = opened;
    if (opened == NULL)
        return host_gpio_no_memory(why);
    int status = find_chip(opened, pin->chip, why);
    status = status == 0 ? find_line(opened, pin, why) : status;
    status = status == 0 ? request(opened, pin, why) : status;
    if (status != 0) {
        host_gpio_close(opened);
        *gpio = NULL;
    }
    return status;
}

int host_gpio_set(struct host_gpio *gpio, bool active) {
    return gpiod_line_request_set_value(gpio->request, gpio->line,
                                        active ? GPIOD_LINE_VALUE_ACTIVE
                                               : GPIOD_LINE_VALUE_INACTIVE);
}

void host_gpio_close(struct host_gpio *gpio) {
    if (gpio == NULL)
        return;
    if (gpio->request != NULL)
        gpiod_line_request_release(gpio->request);
    close_chip(gpio);
    free(gpio);
}
