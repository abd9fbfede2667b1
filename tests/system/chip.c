/* An emulated board's flash chip as a file, for tests:
 *
 *     chip FILE              says what is in it
 *     chip FILE card -       makes a new one a memory card
 *     chip FILE put IMAGE    for a new one: with this image, as from the shop
 *     chip FILE try IMAGE    as it is once an image was brought: on trial
 *     chip FILE break SLOT   a byte of that slot's code is another
 *     chip FILE held -       blocks that it has of an image that is coming
 */
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "node/loader/flash.h"
#include "node/loader/slots.h"
#include "node/loader/image.h"
#include "transport/drivers/sign_sodium.h"

enum { CHIP = 16 << 20, IMAGE_MAX = 1 << 20 };

static uint8_t *open_chip(const char *path) {
    int fd = open(path, O_RDWR | O_CREAT, 0600);
    off_t size = fd < 0 ? -1 : lseek(fd, 0, SEEK_END);
    void *chip = MAP_FAILED;
    if (size >= 0 && ftruncate(fd, CHIP) == 0)
        chip = mmap(NULL, CHIP, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    if (chip == MAP_FAILED) {
        perror(path);
        exit(1);
    }
    if (size != CHIP)
        memset(chip, 0xff, CHIP);
    return chip;
}

static uint32_t read_image(const char *path, uint8_t *bytes) {
    FILE *file = fopen(path, "rb");
    size_t size = file == NULL ? 0 : fread(bytes, 1, IMAGE_MAX, file);
    if (file != NULL)
        (void)fclose(file);
    if (size <= LOADER_HEADER_BYTES) {
        fprintf(stderr, "%s: no image\n", path);
        exit(1);
    }
    return (uint32_t)size;
}

/* Into the slot that is not in use. */
static bool try_image(const struct loader_flash *flash,
                      struct loader_slots *slots, const uint8_t *bytes,
                      uint32_t size) {
    struct loader_layout layout = loader_layout(flash);
    unsigned slot = slots->state.slot == 0 ? 1 : 0;
    for (uint32_t s = 0; s < layout.sectors; s++) {
        (void)flash->erase(flash->context,
                           layout.first + slot * layout.sectors + s);
    }
    return size <= layout.bytes &&
           loader_flash_put(flash, loader_slot_at(&layout, flash, slot), bytes,
                            size) &&
           loader_slots_use(slots, slot, true);
}

/* By their marks in a journal. */
static unsigned held(const struct loader_flash *flash) {
    struct loader_layout layout = loader_layout(flash);
    unsigned most = 0;
    for (unsigned slot = 0; slot < LOADER_SLOTS; slot++) {
        uint32_t marks =
            loader_journal_at(&layout, flash, slot) + loader_marks_in(flash);
        uint32_t apart = loader_mark_apart(flash);
        unsigned count = 0;
        for (unsigned i = 0; i < layout.bytes / LOADER_BLOCK_BYTES; i++) {
            static const uint8_t none[] = {0xff, 0xff, 0xff, 0xff};
            uint8_t mark[LOADER_MARK_BYTES];
            flash->read(flash->context, marks + apart * i, mark, sizeof mark);
            count += memcmp(mark, none, sizeof mark) != 0;
        }
        most = count > most ? count : most;
    }
    return most;
}

static void tell(const struct loader_flash *flash,
                 const struct loader_slots *slots) {
    struct loader_layout layout = loader_layout(flash);
    printf("slot %u%s, tries %u, floor %u\n", slots->state.slot,
           slots->state.trial ? " on trial" : "", slots->state.tries,
           slots->state.floor);
    for (unsigned i = 0; i < LOADER_SLOTS; i++) {
        uint8_t header[LOADER_HEADER_BYTES];
        struct loader_image image;
        flash->read(flash->context, loader_slot_at(&layout, flash, i), header,
                    sizeof header);
        if (loader_image_unpack(&image, header) == LOADER_GOOD) {
            printf("slot %u: %s, number %u, ", i, image.board, image.number);
            for (unsigned k = 0; k < 8; k++)
                printf("%02x", image.digest[k]);
            printf("\n");
        }
    }
}

int main(int argc, char **argv) {
    static uint8_t bytes[IMAGE_MAX];
    const char *what = argc == 4 ? argv[2] : "";
    if (argc != 2 && argc != 4) {
        fprintf(stderr, "chip FILE [card - | put IMAGE | try IMAGE | break "
                        "SLOT | held -]\n");
        return 2;
    }
    uint8_t *chip = open_chip(argv[1]);
    struct loader_card card = LOADER_CARD_IN(chip);
    const struct loader_flash in_chip = LOADER_RAM(chip);
    const struct loader_flash on_card = LOADER_CARD(&card);
    bool is_card = strcmp(what, "card") == 0 ? loader_card_format(&card)
                                             : loader_card_open(&card);
    const struct loader_flash flash = is_card ? on_card : in_chip;
    const struct loader_rules rules = {.flash = &flash, .suite = &sign_sodium};
    struct loader_slots slots;
    bool good = true;
    loader_slots_open(&slots, &rules);
    if (strcmp(what, "put") == 0) {
        good = loader_slots_install(&flash, bytes, read_image(argv[3], bytes));
    } else if (strcmp(what, "try") == 0) {
        good = try_image(&flash, &slots, bytes, read_image(argv[3], bytes));
    } else if (strcmp(what, "break") == 0) {
        unsigned slot = (unsigned)strtoul(argv[3], NULL, 10);
        chip[card.first * LOADER_CARD_BLOCK + loader_slots_code(&slots, slot) +
             1000] ^= 1;
    } else if (strcmp(what, "held") == 0) {
        printf("%u\n", held(&flash));
    } else {
        tell(&flash, &slots);
    }
    return good ? 0 : 1;
}
