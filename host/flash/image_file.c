#include "image_file.h"

#include <stdalign.h>
#include <string.h>

#include "node/loader/messages.h"
#include "transport/drivers/sign_sodium.h"

int host_image_open(struct host_image *file, const char *path,
                    struct host_error *error) {
    if (host_source_open_bounded(&file->source, path, LOADER_IMAGE_MAX,
                                 "an image", error) != 0) {
        return error->code;
    }
    size_t bytes = file->source.bytes;
    bool good =
        bytes >= LOADER_HEADER_BYTES &&
        loader_image_unpack(&file->image, file->source.data) == LOADER_GOOD;
    size_t all = LOADER_HEADER_BYTES + (good ? (size_t)file->image.bytes : 0);
    if (!good) {
        host_fail(error, HOST_INPUT,
                  "%s: no image, or one with a damaged header; make firmware "
                  "builds images, and incode sign makes one of a board's "
                  "binary",
                  path);
    } else if (bytes != all) {
        host_fail(error, HOST_INPUT,
                  "%s: %zu bytes, %s than the %zu that its header tells of; "
                  "copy or build it anew",
                  path, bytes, bytes < all ? "fewer" : "more", all);
    } else {
        return 0;
    }
    host_image_close(file);
    return error->code;
}

void host_image_close(struct host_image *file) {
    host_source_close(&file->source);
}

void host_image_digest(const uint8_t *header, const uint8_t *code, size_t size,
                       uint8_t digest[SIGN_DIGEST_BYTES]) {
    alignas(64) uint8_t hash[SIGN_HASH_BYTES];
    sign_sodium.begin(hash);
    sign_sodium.add(hash, header, LOADER_NAMED_BYTES);
    sign_sodium.add(hash, code, size);
    sign_sodium.end(hash, digest);
}

enum loader_fault host_image_fault(const struct host_image *file) {
    uint8_t digest[SIGN_DIGEST_BYTES];
    const uint8_t *header = file->source.data;
    host_image_digest(header, header + LOADER_HEADER_BYTES, file->image.bytes,
                      digest);
    return memcmp(digest, file->image.digest, sizeof digest) != 0
               ? LOADER_WRONG_DIGEST
               : loader_image_signed(header, &sign_sodium, file->image.key);
}
