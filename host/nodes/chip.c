#include "chip.h"

#include <assert.h>
#include <errno.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "emulator.h"
#include "host/formats/source.h"
#include "node/loader/flash_card.h"
#include "node/loader/flash_ram.h"
#include "node/loader/messages.h"
#include "node/loader/slots.h"
#include "transport/drivers/sign_sodium.h"

static_assert(LOADER_RAM_SECTORS * LOADER_RAM_SECTOR <= HOST_FLASH_BYTES &&
                  (LOADER_CARD_FIRST + LOADER_CARD_BLOCKS) *
                          LOADER_CARD_BLOCK <=
                      HOST_FLASH_BYTES,
              "what a loader knows of it is there");

static void *map(int fd) {
    return mmap(NULL, HOST_FLASH_BYTES, PROT_READ | PROT_WRITE, MAP_SHARED, fd,
                0);
}

static int fill(int fd) {
    static uint8_t erased[1 << 16];
    memset(erased, 0xff, sizeof erased);
    for (size_t at = 0; at < HOST_FLASH_BYTES; at += sizeof erased) {
        if (pwrite(fd, erased, sizeof erased, (off_t)at) !=
            (ssize_t)sizeof erased) {
            return -1;
        }
    }
    return 0;
}

int host_chip_make(int fd, bool card) {
    if (fill(fd) != 0) {
        return -1;
    }
    void *bytes = card ? map(fd) : NULL;
    if (bytes == MAP_FAILED) {
        return -1;
    }
    if (bytes != NULL) {
        struct loader_card table = LOADER_CARD_IN(bytes);
        (void)loader_card_format(&table);
        (void)munmap(bytes, HOST_FLASH_BYTES);
    }
    return 0;
}

/* Whether the board would start just this. */
static bool has(const struct loader_flash *flash,
                const struct loader_image *image) {
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

static int install(const struct loader_flash *flash,
                   const struct host_source *source, const char *path,
                   struct host_error *error) {
    struct loader_image image;
    if (source->bytes < LOADER_HEADER_BYTES ||
        loader_image_unpack(&image, source->data) != LOADER_GOOD ||
        image.bytes != source->bytes - LOADER_HEADER_BYTES) {
        return host_fail(error, HOST_CUBE,
                         "%s: not a board's image, or not all of it; make it "
                         "with: make firmware",
                         path);
    }
    if (!has(flash, &image) &&
        !loader_slots_install(flash, source->data, (uint32_t)source->bytes)) {
        return host_fail(error, HOST_CUBE,
                         "%s: does not fit into a slot of the board's flash; "
                         "give a smaller image",
                         path);
    }
    return 0;
}

/* A card that somebody has given another table has no place for an image. */
static int install_mapped(void *bytes, bool card,
                          const struct host_source *source, const char *path,
                          struct host_error *error) {
    struct loader_card table = LOADER_CARD_IN(bytes);
    const struct loader_flash chip = LOADER_RAM(bytes);
    const struct loader_flash on_card = LOADER_CARD(&table);
    if (card && !loader_card_open(&table)) {
        return host_fail(error, HOST_CUBE,
                         "the board's card: no partition of type DA for "
                         "images; remove the file, and it is made anew");
    }
    return install(card ? &on_card : &chip, source, path, error);
}

int host_chip_install(int fd, bool card, const char *path,
                      struct host_error *error) {
    struct host_source source;
    if (host_source_open_bounded(&source, path, LOADER_IMAGE_MAX, "an image",
                                 error) != 0) {
        return error->code;
    }
    void *bytes = map(fd);
    if (bytes == MAP_FAILED) {
        host_fail(error, HOST_BROKEN, "flash: %s; free some memory",
                  strerror(errno));
    } else {
        (void)install_mapped(bytes, card, &source, path, error);
        (void)munmap(bytes, HOST_FLASH_BYTES);
    }
    host_source_close(&source);
    return error->code;
}
