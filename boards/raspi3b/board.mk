# Raspberry Pi 3: a Cortex-A53, 64 bits; the first of its four processors.
# Interrupts' handlers, which are this folder's, save no vectors.
prefix  = aarch64-linux-gnu-
machine = -mcpu=cortex-a53 -mno-outline-atomics -fno-pie -no-pie \
	-fno-stack-protector -fno-asynchronous-unwind-tables
sources = $(wildcard boards/sdhci/*.c)
$(BUILD)/firmware/raspi3b/boards/raspi3b/%.o \
$(BUILD)/firmware/loader/raspi3b/boards/raspi3b/%.o: private BARE += \
	-mgeneral-regs-only
# For tests/stack: who reports faults, and what start.S takes first of the
# handlers' stack.
fault = raspi3b_fault
exception_bytes = 192
# Where the firmware loads what it starts, and where that runs images.
code_at = 0x80000
image_at = 0x200000
