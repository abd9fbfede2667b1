/* An image as a file of the host's.
 *
 * Memory: the file's bytes.  Work: a pass over them; two scalar multiplications
 * for a signature.
 *
 *     if (host_image_open(&file, "mps2-an500.img", &error) != 0)
 *         return error.code;
 *     if (host_image_fault(&file) != LOADER_GOOD) puts("it is damaged");
 *     host_image_close(&file);
 */
#ifndef HOST_IMAGE_FILE_H
#define HOST_IMAGE_FILE_H

#include "host/formats/source.h"
#include "node/loader/image.h"

struct host_image {
    struct host_source source; /* its bytes, the header first */
    struct loader_image image;
};

/* With a header and all of the code.  HOST_INPUT: it cannot be read, is none,
 * or not all of one. */
int host_image_open(struct host_image *file, const char *path,
                    struct host_error *error);
void host_image_close(struct host_image *file);

/* LOADER_WRONG_DIGEST, or what loader_image_signed says of its own key:
 * LOADER_UNSIGNED, LOADER_WRONG_SIGNATURE or LOADER_GOOD. */
enum loader_fault host_image_fault(const struct host_image *file);

/* Of a header's first LOADER_NAMED_BYTES, and the code. */
void host_image_digest(const uint8_t *header, const uint8_t *code, size_t size,
                       uint8_t digest[SIGN_DIGEST_BYTES]);

#endif
