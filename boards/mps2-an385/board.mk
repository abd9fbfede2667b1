# Arm's MPS2 as AN385: Cortex-M3, double arithmetic in software.
prefix  = arm-none-eabi-
machine = -mcpu=cortex-m3 -mthumb -mfloat-abi=soft
sources = $(wildcard boards/cmsdk/*.[cS]) boards/bare/sqrt.c
# For tests/stack: who reports faults, and what the processor puts on the stack
# that an interrupt comes upon.
fault = cmsdk_fault
exception_bytes = 36
# Where its loader runs images, behind itself.
image_at = 0x10000
