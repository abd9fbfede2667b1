/* A line of a GPIO chip as an output, whichever version of libgpiod drives it:
 * lines_gpiod1.c has the calls of version 1, and the Makefile takes the file of
 * the version that is installed. */
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

#endif
