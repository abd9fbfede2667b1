/* Resets the board of a node by the line that a cube file names, as commands
 * for a cube do.
 *
 *     pulse FILE NODE [stay]
 *
 * Ends as incode does: 3 or 4 with the reason on standard error.
 */
#include <stdio.h>
#include <stdlib.h>

#include "host/cube/lines.h"

int main(int argc, char **argv) {
    struct host_cube_file file;
    struct host_lines lines;
    struct host_error error = {0};
    if (argc < 3) {
        fprintf(stderr, "usage: pulse FILE NODE [stay]\n");
        return HOST_USAGE;
    }
    unsigned node = (unsigned)strtoul(argv[2], NULL, 10);
    if (host_cube_file_read(&file, argv[1], &error) == 0) {
        if (host_lines_open(&lines, &file, NULL, &error) == 0) {
            (void)host_lines_reset(&lines, node, argc > 3, &error);
            host_lines_close(&lines);
        }
        host_cube_file_free(&file);
    }
    if (error.code != 0)
        fprintf(stderr, "incode: %s\n", error.text);
    return error.code;
}
