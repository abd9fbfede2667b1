/* The words by which commands name a cube, as advice repeats them. */

#include "host/cube/site.h"
#include "tests/unit/test.h"

static const char *told(struct host_site_options options, size_t size) {
    static char text[200];
    host_site_text(&options, text, size);
    return text;
}

TEST(words_are_those_that_were_given) {
    assert_string_equal(
        told((struct host_site_options){.cube = "my lab.cube"}, 200),
        "--cube 'my lab.cube'");
    assert_string_equal(told((struct host_site_options){.port = "/dev/ttyUSB0",
                                                        .baud = 9600,
                                                        .nodes = 4},
                             200),
                        "--port /dev/ttyUSB0 --cube-nodes 4 --baud 9600");
    assert_string_equal(
        told((struct host_site_options){.tcp = "lab:5000", .insecure = true},
             200),
        "--tcp lab:5000 --insecure");
    assert_string_equal(
        told((struct host_site_options){.tcp = "lab:5000", .key = "lab.key"},
             200),
        "--tcp lab:5000 --key lab.key");
}

/* Half a word would be another. */
TEST(what_does_not_fit_is_left_to_the_user) {
    for (size_t size = 12; size < 20; size++) {
        assert_string_equal(
            told((struct host_site_options){.cube = "a-long-name.cube"}, size),
            "--cube FILE");
    }
}
