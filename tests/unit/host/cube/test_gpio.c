/* A chip that is not there, whatever this machine has: libgpiod's own answer.
 * Chips that are, the virtual machine of tests/system/full/vm_lines.sh has. */

#include "host/cube/gpio.h"
#include "tests/unit/test.h"

TEST(no_such_chip) {
    static const char *const names[] = {"no such chip", "/dev/null",
                                        "/dev/no-such-chip"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        struct host_cube_pin pin = {.wire = -1};
        struct host_gpio *gpio = (struct host_gpio *)&pin;
        char why[HOST_GPIO_WHY] = "";
        memcpy(pin.chip, names[i], strlen(names[i]) + 1);
        assert_int_equal(host_gpio_open(&gpio, &pin, why), HOST_CUBE);
        assert_null(gpio);
        assert_non_null(strstr(why, names[i]));
        assert_non_null(strstr(why, ": no such GPIO chip here; "));
    }
    host_gpio_close(NULL);
}
