# Arm's MPS2 as AN500: Cortex-M7 with a double-precision unit.
prefix  = arm-none-eabi-
machine = -mcpu=cortex-m7 -mthumb -mfloat-abi=hard -mfpu=fpv5-d16
sources = $(wildcard boards/cmsdk/*.[cS])
# For tests/stack: who reports faults, and what the processor puts on the stack
# that an interrupt comes upon.
fault = cmsdk_fault
exception_bytes = 108
# Where its loader runs images, behind itself.
image_at = 0x10000
