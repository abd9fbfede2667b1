# Bare boards: those folders that have a board.mk, which gives the compiler's
# prefix, the processor's flags (machine) and the sources beside the board's own
# and those of boards/bare.  An image is a main's objects and all of these; what
# it does not need, the linker leaves out.  image_at, image_end: of a board with
# a loader, from where to where that copies images.  code_at, code_end: of what
# runs first, a loader or a test; or an image without a loader.
bare_boards := $(patsubst boards/%/board.mk,%,$(wildcard boards/*/board.mk))
bare_rest   := $(addprefix boards/bare/,sqrt.c program.c loader.c)
# With -ffreestanding alone each memcpy of a few bytes is a call.  What serves
# interrupts is to be short.
BARE_OPT    ?= -O3
BARE = -std=c11 -I. $(WARNINGS) -Werror $(BARE_OPT) -g -ffreestanding -fbuiltin \
	$(FLOATING) -ffunction-sections -fdata-sections -fstack-usage \
	-fcallgraph-info=su
images := $(bare_boards:%=$(BUILD)/firmware/%.img)
# Tests on a board: other mains with its start-up code.  That of
# tests/boards/NAME.c is firmware/tests/BOARD-NAME.img, which runs without a
# loader; bare_with_NAME: sources that it needs beside.
bare_mains := $(patsubst tests/boards/%.c,%,$(wildcard tests/boards/*.c))
trials := $(foreach b,$(bare_boards), \
	$(bare_mains:%=$(BUILD)/firmware/tests/$(b)-%.img))
images: $(images)
bare: images $(trials)

# The cases of arithmetic, on boards and here.
arithmetic := $(filter-out %/native.c,$(wildcard tests/arithmetic/*.c))
bare_with_arithmetic := $(arithmetic)

# bare_compile BOARD FOLDER: of objects there.
define bare_compile
$(BUILD)/firmware/$(2)/%.o: %.c $(BUILD)/firmware/flags
	@mkdir -p $$(@D)
	$$(say) CC $$@
	$$(Q)$$(bare_cc_$(1)) $$(BARE) -MMD -MP -c $$< -o $$@
$(BUILD)/firmware/$(2)/%.o: %.S $(BUILD)/firmware/flags
	@mkdir -p $$(@D)
	$$(say) AS $$@
	$$(Q)$$(bare_cc_$(1)) -I. -g -MMD -MP -c $$< -o $$@
$(BUILD)/firmware/$(2)/boards/bare/memory.o: private BARE += \
	-fno-tree-loop-distribute-patterns
endef

# bare_board BOARD: bare_BOARD is its objects without a main.
define bare_board
image_at :=
image_end :=
code_at := 0
code_end :=
include boards/$(1)/board.mk
bare_cc_$(1) := $$(prefix)gcc $$(machine)
bare_copy_$(1) := $$(prefix)objcopy
bare_at_$(1) := $$(image_at)
bare_to_$(1) := $$(image_end)
bare_from_$(1) := $$(code_at)
bare_until_$(1) := $$(code_end)
bare_parts_$(1) := $$(filter-out $$(bare_rest),$$(wildcard boards/bare/*.c)) \
	$$(wildcard boards/$(1)/*.[cS]) $$(sources)
bare_$(1) := $$(patsubst %,$(BUILD)/firmware/$(1)/%.o,$$(basename \
	$$(freestanding) $$(bare_parts_$(1))))
$(call bare_compile,$(1),$(1))
$(BUILD)/firmware/$(1)/boards/%.o: private BARE_OPT = -O2
$(BUILD)/firmware/$(1).elf: \
	$(BUILD)/firmware/$(1)/boards/bare/program.o
$(BUILD)/firmware/$(1).elf: $$(bare_$(1)) \
		boards/$(1)/board.ld boards/bare/start.ld
	$$(say) LINK $$@
	$$(Q)$$(if $$(bare_at_$(1)),$$(call \
		bare_link,$(1),$$(bare_at_$(1)),$$(bare_to_$(1))),$$(call \
		bare_link,$(1),$$(bare_from_$(1)),$$(bare_until_$(1))))
$(if $(shell grep image_at boards/$(1)/board.mk),$(call bare_loader,$(1)),
$(BUILD)/firmware/$(1).img: $(BUILD)/firmware/$(1).elf
	$$(Q)$$(bare_copy_$(1)) -O binary $$< $$@)
endef

# bare_loader BOARD: its loader, firmware/loader/BOARD.img, and the program as an
# image that it takes.  The loader is small rather than fast.
define bare_loader
images: $(BUILD)/firmware/loader/$(1).img
bare_loader_$(1) := $$(patsubst %,$(BUILD)/firmware/loader/$(1)/%.o,$$(basename \
	$$(loader_parts) $$(bare_parts_$(1))))
bare_sodium_$(1) := $$(sodium_parts:%=$(BUILD)/firmware/loader/$(1)/sodium/%.o)
$(call bare_compile,$(1),loader/$(1))
$(BUILD)/firmware/loader/$(1)/%.o: private BARE_OPT = -Os
$(BUILD)/firmware/loader/$(1)/transport/drivers/%.o: private BARE += -isystem \
	$$(sodium)/include
$(BUILD)/firmware/loader/$(1)/transport/drivers/sign_sodium.o: \
	$$(sodium)/small
$$(bare_sodium_$(1)): $(BUILD)/firmware/loader/$(1)/sodium/%.o: \
		$$(sodium)/small $(BUILD)/firmware/flags
	@mkdir -p $$(@D)
	$$(say) CC $$@
	$$(Q)$$(bare_cc_$(1)) $$(filter-out -W% -I.,$$(BARE)) -w -DNDEBUG \
		-I $$(sodium)/include/sodium -I $$(sodium)/include -c $$(sodium)/$$*.c -o $$@
$(BUILD)/firmware/loader/$(1)/sign_key.o: $(BUILD)/firmware/sign_key.c
	$$(Q)$$(bare_cc_$(1)) $$(BARE) -c $$< -o $$@
$(BUILD)/firmware/loader/$(1).elf: $$(bare_loader_$(1)) $$(bare_sodium_$(1)) \
		$(BUILD)/firmware/loader/$(1)/sign_key.o \
		boards/$(1)/board.ld boards/bare/start.ld
	$$(say) LINK $$@
	$$(Q)$$(call bare_link,$(1),$$(bare_from_$(1)),$$(or \
		$$(bare_until_$(1)),$$(bare_at_$(1))))
$(BUILD)/firmware/loader/$(1).img: $(BUILD)/firmware/loader/$(1).elf
	$$(Q)$$(bare_copy_$(1)) -O binary $$< $$@
$(BUILD)/firmware/$(1).img: $(BUILD)/firmware/$(1).elf $(BUILD)/incode \
		$(BUILD)/firmware/sign
	$$(say) SIGN $$@
	$$(Q)$$(call bare_sign,$(1))
$(foreach m,$(bare_images),$(call bare_image,$(1),$(m)))
endef

# Tests of a loader: other mains as images that it takes.  That of
# tests/boards/images/NAME.c is firmware/tests/image-BOARD-NAME.img.
bare_images := $(patsubst tests/boards/images/%.c,%,$(wildcard \
	tests/boards/images/*.c))
# bare_image BOARD NAME
define bare_image
bare: $(BUILD)/firmware/tests/image-$(1)-$(2).img
$(BUILD)/firmware/tests/image-$(1)-$(2).elf: \
		$(BUILD)/firmware/$(1)/tests/boards/images/$(2).o \
		$$(bare_$(1)) boards/$(1)/board.ld boards/bare/start.ld
	@mkdir -p $$(@D)
	$$(say) LINK $$@
	$$(Q)$$(call bare_link,$(1),$$(bare_at_$(1)),$$(bare_to_$(1)))
$(BUILD)/firmware/tests/image-$(1)-$(2).img: \
		$(BUILD)/firmware/tests/image-$(1)-$(2).elf $(BUILD)/incode \
		$(BUILD)/firmware/sign
	$$(say) SIGN $$@
	$$(Q)$$(call bare_sign,$(1))

endef

# bare_main BOARD NAME
define bare_main
$(BUILD)/firmware/tests/$(1)-$(2).elf: $$(patsubst \
		%.c,$(BUILD)/firmware/$(1)/%.o,tests/boards/$(2).c $$(bare_with_$(2))) \
		$$(bare_$(1)) boards/$(1)/board.ld boards/bare/start.ld
	@mkdir -p $$(@D)
	$$(say) LINK $$@
	$$(Q)$$(call bare_link,$(1),$$(bare_from_$(1)),$$(bare_until_$(1)))
$(BUILD)/firmware/tests/$(1)-$(2).img: $(BUILD)/firmware/tests/$(1)-$(2).elf
	$$(Q)$$(bare_copy_$(1)) -O binary $$< $$@
endef
# Code from an address on, up to another.
bare_link = $(bare_cc_$(1)) -nostdlib -nostartfiles -Wl,--gc-sections \
	-Wl,--build-id=none -Wl,--orphan-handling=error -Wl,--defsym=CODE_AT=$(2) \
	-Wl,--defsym=CODE_END=$(or $(3),0x400000) -Wl,--fatal-warnings \
	-Wl,-Map=$(@:.elf=.map) -T boards/$(1)/board.ld -L boards/bare \
	$(filter %.o,$^) -lgcc -o $@
bare_sign = $(bare_copy_$(1)) -O binary $< $@ && \
	$(BUILD)/incode sign $@ --key '$(sign_key)' --board $(1) \
		--address $(bare_at_$(1))

# The parts of the freestanding rooms that a loader needs; what of the
# distribution's libsodium, made small (boards/bare/libsodium).
loader_parts := boards/bare/loader.c boards/sodium_utils.c \
	transport/drivers/sign_sodium.c $(wildcard node/loader/*.c transport/*.c) \
	$(addprefix node/,answers.c common.c identity.c looks.c)
sodium       := $(BUILD)/libsodium
sodium_parts := crypto_generichash/blake2b/ref/blake2b-compress-ref \
	crypto_generichash/blake2b/ref/blake2b-ref \
	crypto_generichash/blake2b/ref/generichash_blake2b \
	crypto_sign/ed25519/ref10/open crypto_sign/ed25519/ref10/sign \
	crypto_core/ed25519/ref10/ed25519_ref10 \
	crypto_hash/sha512/cp/hash_sha512_cp crypto_verify/sodium/verify
$(sodium)/small: boards/bare/libsodium $(fetched)/libsodium/fetched
	$(Q)boards/bare/libsodium $(fetched)/libsodium $(@D)
	@touch $@

# Who signs images, and whom loaders know: SIGN=FILE, a pair of `incode key
# --sign FILE`; else one that is made once for this build.
sign_key := $(or $(SIGN),$(BUILD)/firmware/development.sign)
$(BUILD)/firmware/development.sign: | $(BUILD)/incode
	@mkdir -p $(@D)
	$(say) KEY $@
	$(Q)$(BUILD)/incode key --sign $@
# Changes where the pair does.
$(BUILD)/firmware/sign: FORCE $(if $(SIGN),,$(BUILD)/firmware/development.sign)
	@mkdir -p $(@D)
	@test -r '$(sign_key)' && test -r '$(sign_key).pub' || { echo \
		"make: SIGN=$(sign_key): not there, or not with $(sign_key).pub;" \
		"make the pair with: incode key --sign $(sign_key)" >&2; exit 1; }
	@cmp -s '$(sign_key).pub' $@ || cp '$(sign_key).pub' $@
$(BUILD)/firmware/sign_key.c: $(BUILD)/firmware/sign
	@{ echo '#include "boards/bare/sign_key.h"'; \
		echo 'const uint8_t bare_sign_key[SIGN_PUBLIC_BYTES] = {'; \
		tr -d '[:space:]' < $< | sed 's/../0x&, /g'; echo '};'; } > $@

$(foreach b,$(bare_boards),$(eval $(call bare_board,$(b))))
$(foreach b,$(bare_boards),$(foreach m,$(bare_mains), \
	$(eval $(call bare_main,$(b),$(m)))))
$(BUILD)/firmware/flags: FORCE
	@mkdir -p $(@D)
	@echo '$(BARE)' | cmp -s - $@ || echo '$(BARE)' > $@
