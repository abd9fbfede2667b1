# Microchip's PolarFire SoC Icicle Kit: RV64GC, the first of its four U54.
prefix  = riscv64-linux-gnu-
machine = -march=rv64gc -mabi=lp64d -mcmodel=medany -msmall-data-limit=0 \
	-fno-pie -no-pie -fno-stack-protector -fno-asynchronous-unwind-tables
sources = $(wildcard boards/sdhci/*.c)
# The eNVM, from which the processors start, and the memory of images.
code_at   = 0x20220000
code_end  = 0x20240000
image_at  = 0x80000000
image_end = 0x80200000
# For tests/stack: the function that reports faults, and what start.S takes first
# of the handlers' stack.
fault = icicle_fault
exception_bytes = 128
# A loader is small rather than fast, but for its handlers.
$(BUILD)/firmware/loader/icicle/boards/icicle/uart.o: private BARE_OPT = -O2
