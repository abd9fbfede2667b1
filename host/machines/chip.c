#include "chip.h"

#include <errno.h>
#include <string.h>
#include <sys/mman.h>

#include "host/files/source.h"
#include "node/loader/flash_ram.h"
#include "node/loader/slots.h"
#include "transport/drivers/sign_sodium.h"

enum { BYTES = LOADER_RAM_SECTORS * LOADER_RAM_SECTOR };

/* Whether the board would start just this. */
static bool has(const struct loader_flash *flash,
                const struct loader_image *image)
{
    const struct loader_rules rules = {.flash = flash,
                                       .suite = &sign_sodium,
                                       .key = image->key,
                                       .board = image->board,
                                       .address = image->address,
                                       .room = image->bytes};
    struct loader_slots slots;
    loader_slots_open(&slots, &rules);
    unsigned slot = loader_slots_choose(&slots, false);
    return slot < LOADER_SLOTS &&
           memcmp(slots.image[slot].digest, image->digest,
                  sizeof image->digest) == 0;
}

static int install(void *chip, const struct host_source *source,
                   const char *path, struct host_error *error)
{
    const struct loader_flash flash = LOADER_RAM(chip);
    struct loader_image image;
    if (source->bytes < LOADER_HEADER_BYTES ||
        loader_image_unpack(&image, source->data) != LOADER_GOOD ||
        image.bytes != source->bytes - LOADER_HEADER_BYTES) {
        return host_fail(error, HOST_CUBE,
                         "%s: not a board's image, or not all of it; make it "
                         "with: make firmware",
                         path);
    }
    if (!has(&flash, &image) &&
        !loader_slots_install(&flash, source->data, (uint32_t)source->bytes)) {
        return host_fail(error, HOST_CUBE,
                         "%s: does not fit into a slot of the board's flash; "
                         "give a smaller image",
                         path);
    }
    return 0;
}

int host_chip_install(int fd, const char *path, struct host_error *error)
{
    struct host_source source;
    if (host_source_open(&source, path, false, error) != 0) {
        return error->code;
    }
    void *chip = mmap(NULL, BYTES, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    if (chip == MAP_FAILED) {
        host_fail(error, HOST_BROKEN, "flash: %s; free some memory",
                  strerror(errno));
    } else {
        (void)install(chip, &source, path, error);
        (void)munmap(chip, BYTES);
    }
    host_source_close(&source);
    return error->code;
}
