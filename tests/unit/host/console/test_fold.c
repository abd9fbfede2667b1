/* Answers that are equal share a row, also where a time in them differs a bit.
 */

#include "host/console/fold.h"
#include "tests/unit/test.h"

static char said[2000];

static void take(void *context, const char *text) {
    (void)context;
    strcat(said, text);
    strcat(said, "\n");
}

static const char *folded(const uint32_t *time_s, unsigned count) {
    struct host_fold fold = {0};
    for (unsigned i = 0; i < count; i++)
        host_fold_add_timed(&fold, i, "up \1 all", time_s[i]);
    said[0] = '\0';
    host_fold_print(&fold, "TIME", take, NULL);
    host_fold_free(&fold);
    return said;
}

TEST(times_that_are_near_share_a_row) {
    assert_string_equal(folded((uint32_t[]){7, 7}, 2),
                        "NODES  TIME\n0-1    up       7 s all\n");
    assert_string_equal(folded((uint32_t[]){59, 58, 61, 60}, 4),
                        "NODES  TIME\n0-3    up   58-61 s all\n");
    assert_string_equal(folded((uint32_t[]){125, 130}, 2),
                        "NODES  TIME\n0-1    up     2 min all\n");
    assert_string_equal(folded((uint32_t[]){7200, 7900}, 2),
                        "NODES  TIME\n0-1    up       2 h all\n");
}

/* One that has begun anew is seen. */
TEST(times_that_are_not_do_not) {
    assert_string_equal(folded((uint32_t[]){3600, 3605, 12}, 3),
                        "NODES  TIME\n0-1    up       1 h all\n"
                        "2      up      12 s all\n");
}

TEST(a_row_without_a_time_is_another) {
    struct host_fold fold = {0};
    host_fold_add(&fold, 0, "no answer");
    host_fold_add_timed(&fold, 1, "no answer", 5);
    host_fold_add(&fold, 2, "no answer");
    assert_int_equal(fold.count, 2);
    host_fold_free(&fold);
}
