/* A line of a GPIO chip as an output, whichever version of libgpiod drives it:
 * lines_gpiod1.c has the calls of version 1, lines_gpiod2.c those of version 2,
 * and the Makefile takes the file of the version that is installed. */
#ifndef HOST_GPIO_H
#define HOST_GPIO_H

#include "host/nodes/cube_file.h"

enum { HOST_GPIO_WHY = 320 };

struct host_gpio;

/* Takes the line for this process, and makes it an output that is inactive.  0,
 * HOST_INPUT: the chip has no such line; or HOST_CUBE; and why, as "WHAT;
 * NEXT". */
int host_gpio_open(struct host_gpio **gpio, const struct host_cube_pin *pin,
                   char why[HOST_GPIO_WHY]);

/* 0, or -1 and errno.  It calls the kernel alone. */
int host_gpio_set(struct host_gpio *gpio, bool active);

/* Gives it back; the kernel leaves the level to the chip's driver. */
void host_gpio_close(struct host_gpio *gpio);

/* --- for the two files that call libgpiod --------------------------------- */

/* Why not, as "WHAT; NEXT"; each is the status of host_gpio_open.  chip is what
 * the kernel calls it. */
int host_gpio_no_memory(char why[HOST_GPIO_WHY]);

/* It was not opened, for this errno.  chips: those that there are. */
int host_gpio_no_chip(char why[HOST_GPIO_WHY], const char *name, int reason,
                      const char *chips);

/* Of a chip with so many lines. */
int host_gpio_no_line(char why[HOST_GPIO_WHY], const char *chip, size_t lines,
                      const struct host_cube_pin *pin);

/* user: what has it, as far as the kernel says; NULL: it was refused for this
 * errno. */
int host_gpio_not_ours(char why[HOST_GPIO_WHY], const char *chip, unsigned line,
                       const char *user, int reason);

enum { HOST_GPIO_CHIPS = HOST_GPIO_WHY / 2 };

/* One more for the list of chips, as far as it has room. */
void host_gpio_list(char chips[HOST_GPIO_CHIPS], const char *name,
                    const char *label);

#endif
