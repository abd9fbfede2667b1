# Builds, runs and tests incode.  `make help` lists what there is.
#
# Variables: BUILD (where everything made goes), CC, ARCH (-march=, or any: for
# each processor of this architecture), OPT, SAN (sanitizers, as in
# SAN=address,undefined; their own BUILD, please, and one processor).

# The usual value, also where a variable is given without one.
usual   = $(eval override $(1) := $(or $(strip $($(1))),$(2)))
$(call usual,BUILD,build)
SAN    ?=
$(call usual,ARCH,$(if $(SAN),native,any))
$(call usual,OUT,out)
OPT    ?= $(if $(SAN),-O1,-O3)
PREFIX ?= /usr/local
POINTS ?=
SETS   ?= $(wildcard ../shared/data ../shared/real)
FUZZ_SECONDS ?= 60
FOR    ?=
ifeq ($(origin CC),default)
CC := gcc
endif
MUSL_CC ?= musl-gcc
# Sanitizers need the C library that they were made for, and no limit of memory.
NODE_CC = $(if $(SAN),$(CC),$(MUSL_CC))

# Vectors wider than the machine's are passed between inlined functions only.
# Enumerations name numbers here, which clang 19 would not have multiplied.
WARNINGS = -Wall -Wextra -Wconversion -Wshadow -Wno-psabi \
	-Wno-enum-float-conversion
# One rounding an operation, whatever the compiler: the results depend on it.
FLOATING = -ffp-contract=off -fno-math-errno -fno-trapping-math
SANITIZE = $(if $(SAN),-fsanitize=$(SAN) -fno-sanitize-recover=all \
	-fno-omit-frame-pointer -DINCODE_SANITIZED)
CFLAGS  ?= -g
OBJCOPY ?= objcopy
MACHINE  = $(if $(filter any,$(ARCH)),$(baseline),-march=$(ARCH))
BASE     = -std=c11 -I. $(WARNINGS) $(OPT) $(MACHINE) $(FLOATING) $(SANITIZE) \
	$(CFLAGS)
HOSTED   = $(BASE) -pthread -D_GNU_SOURCE=
# V=1 shows every command.
Q = $(if $(V),,@)
say = @$(if $(V),:,printf '  %-4s %s\n')
MPI_CFLAGS = $(addprefix -isystem ,$(shell mpicc --showme:incdirs))
MPI_LIBS = $(addprefix -L,$(shell mpicc --showme:libdirs)) -lmpi
# libsodium's own code is the same under either C library; its headers are
# made visible to musl's compiler alone.
NODE_LIBS = $(shell $(CC) -print-file-name=libsodium.a)
NODE_INCLUDE = -I$(BUILD)/include

# The rooms.  What stands in incode/, transport/ and node/ is freestanding;
# drivers, boards and the host have a system beneath them.
files = $(shell find $(1) -name '*.c' | LC_ALL=C sort)
freestanding := $(call files,incode node transport/tuples) \
	$(wildcard transport/*.c)
drivers      := $(filter-out %/mpi.c,$(wildcard transport/drivers/*.c))
# Those that need what a static node has not.
host_drivers := transport/drivers/serial_port.c \
	transport/drivers/sign_sodium.c
node_drivers := $(filter-out $(host_drivers),$(drivers))
# A folder a board.  Its program is incode-node-NAME, that of linux incode-node;
# mpi's is no static one.
board        := $(wildcard boards/*.c)
boards       := $(filter-out mpi,$(patsubst boards/%/main.c,%,$(wildcard \
	boards/*/main.c)))
# Host and node as ranks of Open MPI: no other program is linked with it.
host_mpi     := host/main_mpi.c $(wildcard host/*/mpi/*.c)
obj          := $(BUILD)/obj
.DEFAULT_GOAL := all
include host/host.mk
unit         := $(call files,tests/unit)
fuzz         := $(wildcard tests/fuzz/fuzz_*.c)

core_objects := $(freestanding:%.c=$(obj)/%.o) $(obj)/boards/processor/processor.o
host_objects := $(host:%.c=$(obj)/%.o) $(drivers:%.c=$(obj)/%.o) \
	$(bare_rows:.c=.o)
node_objects := $(board:%.c=$(BUILD)/node/%.o) \
	$(node_drivers:%.c=$(BUILD)/node/%.o)
node          = $(BUILD)/incode-node$(if $(filter-out linux,$(1)),-$(1))
nodes        := $(foreach b,$(boards),$(call node,$(b)))
mpi_host     := $(host_mpi:%.c=$(obj)/%.o) $(obj)/transport/drivers/mpi.o
mpi_node     := $(obj)/boards/mpi/main.o $(obj)/boards/process.o \
	$(obj)/transport/drivers/mpi.o
unit_tests   := $(addprefix $(BUILD)/tests/,$(notdir $(unit:.c=)))
fuzzers      := $(fuzz:tests/fuzz/%.c=$(BUILD)/fuzzers/%)

.DELETE_ON_ERROR:
.SECONDARY:
.PHONY: all pages deb images unit points planted bare arithmetic fuzzers python \
	run check test \
	test-full bench firmware nodes cross fuzz lint abi install uninstall clean \
	compdb hooks help deps deps-run deps-python deps-nodes deps-deb deps-test \
	deps-bench deps-full FORCE

programs     := $(BUILD)/incode $(BUILD)/incode-mpi $(BUILD)/incode-node-mpi \
	$(nodes)
libraries    := $(BUILD)/libincode.a $(BUILD)/libincode.so.0
all: $(programs) $(libraries)

include boards/processor/levels.mk

$(BUILD)/incode: $(obj)/host/main.o $(host_levels) $(BUILD)/libhost.a \
		$(BUILD)/libcore.a
	$(say) LINK $@
	$(Q)$(CC) $(HOSTED) $^ $(HOST_LIBS) -o $@

# Static, so that a node's data memory is what the node itself declares.
$(foreach b,$(boards),$(eval $(call node,$(b)): \
	$(patsubst %.c,$(BUILD)/node/%.o,$(wildcard boards/$(b)/*.c))))
$(nodes): $(node_objects) $(core_levels) $(BUILD)/libcore.a
	$(say) LINK $@
	$(Q)$(NODE_CC) $(BASE) $(if $(SAN),,-static) $(filter %.o,$^) \
		$(BUILD)/libcore.a $(NODE_LIBS) -o $@

$(BUILD)/incode-mpi: $(mpi_host) $(host_levels) $(BUILD)/libhost.a \
		$(BUILD)/libcore.a
	$(say) LINK $@
	$(Q)$(CC) $(HOSTED) $^ $(HOST_LIBS) $(MPI_LIBS) -o $@
$(BUILD)/incode-node-mpi: $(mpi_node) $(core_levels) $(BUILD)/libcore.a
	$(say) LINK $@
	$(Q)$(CC) $(HOSTED) $^ $(MPI_LIBS) -o $@

include host/library/library.mk host/library/python/python.mk
$(BUILD)/libcore.a: $(core_objects)
$(BUILD)/libhost.a: $(host_objects)
$(BUILD)/%.a: $(BUILD)/lists
	@rm -f $@
	@$(AR) rcsD $@ $(filter %.o,$^)
# An archive keeps nothing of a file that is gone.
archived = $(core_objects) $(host_objects) $(bare_shared)
$(BUILD)/lists: FORCE
	@mkdir -p $(@D)
	@echo '$(archived)' | cmp -s - $@ || echo '$(archived)' > $@

# Objects depend on the flags that they were compiled with.
$(BUILD)/flags: FORCE
	@mkdir -p $(@D)
	@echo '$(CC) $(NODE_CC) $(HOSTED)' | cmp -s - $@ || \
		echo '$(CC) $(NODE_CC) $(HOSTED)' > $@

# Vectors are written out where they pay; those that the compiler makes of loops
# over three coordinates do not.
$(core_objects): private BASE += -fno-tree-vectorize
$(obj)/incode/%.o: incode/%.c $(BUILD)/flags
	@mkdir -p $(@D)
	$(say) CC $<
	$(Q)$(CC) $(BASE) -MMD -MP -c $< -o $@
$(obj)/node/%.o: node/%.c $(BUILD)/flags
	@mkdir -p $(@D)
	$(say) CC $<
	$(Q)$(CC) $(BASE) -MMD -MP -c $< -o $@
$(mpi_host) $(mpi_node) $(obj)/tests/bench/mpi_hops.o \
	$(obj)/host/run/launch.o $(obj)/host/bench/bench_links.o \
	$(obj)/tests/unit/transport/drivers/test_mpi.o: private HOSTED += $(MPI_CFLAGS)
$(obj)/transport/drivers/%.o: transport/drivers/%.c $(BUILD)/flags
	@mkdir -p $(@D)
	$(say) CC $<
	$(Q)$(CC) $(HOSTED) -MMD -MP -c $< -o $@
$(obj)/transport/%.o: transport/%.c $(BUILD)/flags
	@mkdir -p $(@D)
	$(say) CC $<
	$(Q)$(CC) $(BASE) -MMD -MP -c $< -o $@
$(obj)/%.o: %.c $(BUILD)/flags
	@mkdir -p $(@D)
	$(say) CC $<
	$(Q)$(CC) $(HOSTED) -MMD -MP -c $< -o $@
$(BUILD)/node/%.o: %.c $(BUILD)/flags $(BUILD)/include/sodium.h
	@mkdir -p $(@D)
	$(say) CC $<
	$(Q)$(NODE_CC) $(BASE) $(NODE_INCLUDE) -D_GNU_SOURCE= -MMD -MP -c $< -o $@
$(BUILD)/include/sodium.h:
	@mkdir -p $(@D)
	@ln -sfn /usr/include/sodium $(@D)/sodium
	@ln -sfn /usr/include/sodium.h $@

include tests/tests.mk

-include $(shell find $(BUILD) -name '*.d' -type f 2>/dev/null)

# The distribution's sources of libraries, for boards and processors of which it
# has no packages.
fetched := $(BUILD)/source
$(fetched)/%/fetched: boards/source
	$(say) GET $(@D)
	$(Q)boards/source $* $(fetched)
	@touch $@

include boards/bare/images.mk boards/linux/nodes.mk \
	tests/arithmetic/arithmetic.mk tests/deps.mk

# The paper's Uniform set, or the user's.
points = $(or $(POINTS),$(OUT)/uniform20k.xyz)
run: deps-run
	@$(MAKE) --no-print-directory all
	@mkdir -p '$(OUT)'
ifeq ($(POINTS),)
	$(BUILD)/incode gen uniform 20000 --seed 1 -o '$(points)'
endif
	@name=$$(basename '$(points)' .gz); result='$(OUT)'/$${name%.*}; \
	set -x; $(BUILD)/incode run '$(points)' --strategy spatial --nodes 8 \
		--verify --table --stats "$$result.json" -o "$$result.vtu" && \
		$(BUILD)/incode draw '$(points)' "$$result.vtu" -o "$$result.svg" \
		&& { set +x; } 2> /dev/null && printf '%s\n' '' \
		"The tetrahedra are in $$result.vtu, the statistics in $$result.json," \
		"and a section is drawn in $$result.svg.  To look at them:" \
		"  paraview $$result.vtu    then Apply, and Surface With Edges" \
		"  xdg-open $$result.svg    or any browser"

check: deps-test
	@exec env BUILD='$(BUILD)' bash tests/run --check

test: deps-test
	@exec env BUILD='$(BUILD)' bash tests/run

test-full: deps-full
	@exec env BUILD='$(BUILD)' bash tests/run --full

bench: deps-bench
	@$(MAKE) --no-print-directory all
	@$(BUILD)/incode bench peers $(SETS)
	@$(BUILD)/incode bench scale

# The images of bare boards, what of a node's memory they take, and their checks.
firmware: deps-test
	@$(MAKE) --no-print-directory bare
	@BUILD='$(BUILD)' bash tests/firmware

clean:
	rm -rf '$(BUILD)'

include host/install.mk host/package/package.mk

help:
	@cat tests/targets
