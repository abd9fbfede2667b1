# What the host program is made of, and the libraries that it needs.
HOST_LIBS = -ledit -lconfig -lsodium -lserialport -lgpiod -ljansson -lnettle -lexpat \
	-lpng -lz -lm

# The calls of that version of libgpiod which is installed.
GPIOD       := $(firstword $(subst ., ,$(shell pkg-config --modversion libgpiod \
	2>/dev/null)) 1)
host        := $(filter-out host/main.c $(host_mpi),$(call files,host))
host        := $(filter-out host/cube/lines_gpiod%,$(host)) \
	host/cube/lines_gpiod$(GPIOD).c
ifeq ($(wildcard host/cube/lines_gpiod$(GPIOD).c),)
host/cube/lines_gpiod$(GPIOD).c:
	@echo 'make: libgpiod $(GPIOD) is installed; its calls belong in $@,' \
		'as those of version 1 are in lines_gpiod1.c' >&2
	@false
endif

# The rows of bare boards, a folder each with its facts.h, and their list.
bare_facts  := $(patsubst boards/%/facts.h,%,$(wildcard boards/*/facts.h))
bare_rows   := $(patsubst %,$(obj)/rows/%.c,$(bare_facts) bare_boards)
bare_row     = host_board_$(subst -,_,$(1))
$(bare_facts:%=$(obj)/rows/%.c): $(obj)/rows/%.c: boards/%/facts.h
	@mkdir -p $(@D)
	@printf '#include "%s"\n#include "host/nodes/board_emulated.h"\n%s\n' \
		$< 'HOST_BOARD_ROW($(call bare_row,$*))' > $@
bare_list    = \#include "host/nodes/boards.h"\n\
	$(foreach b,$(bare_facts),extern const struct host_board \
	$(call bare_row,$(b));\n)\
	extern const struct host_board *const host_bare_boards[];\n\
	const struct host_board *const host_bare_boards[] = \
	{$(foreach b,$(bare_facts),&$(call bare_row,$(b)),)};\n\
	extern const unsigned host_bare_boards_count;\n\
	const unsigned host_bare_boards_count = $(words $(bare_facts));\n
$(obj)/rows/bare_boards.c: FORCE
	@mkdir -p $(@D)
	@printf '$(bare_list)' | cmp -s - $@ || printf '$(bare_list)' > $@
$(bare_rows:.c=.o): %.o: %.c $(BUILD)/flags
	$(say) CC $<
	$(Q)$(CC) $(HOSTED) -MMD -MP -c $< -o $@

# HDF5 is loaded when a file calls for it, by the name that it has here.
hdf5 = $(realpath $(shell $(CC) -print-file-name=libhdf5_serial.so))
$(obj)/host/formats/hdf5.o: private HOSTED += $(if $(hdf5),-DHDF5_LIBRARY='"$(shell \
	echo '$(notdir $(hdf5))' | cut -d . -f 1-3)"' -DHDF5_PACKAGE='"$(shell \
	dpkg-query -S '$(hdf5)' 2> /dev/null | cut -d : -f 1)"')

# A simulation's failure names the commit that replays it.
COMMIT := $(or $(shell git rev-parse --short=12 HEAD 2>/dev/null),unknown)
$(BUILD)/commit: FORCE
	@mkdir -p $(@D)
	@echo '$(COMMIT)' | cmp -s - $@ || echo '$(COMMIT)' > $@
$(obj)/host/sim/sim.o: host/sim/sim.c $(BUILD)/flags $(BUILD)/commit
	@mkdir -p $(@D)
	$(say) CC $<
	$(Q)$(CC) $(HOSTED) -DINCODE_COMMIT='"$(COMMIT)"' -MMD -MP -c $< -o $@

# The script for boards is taken in as it is.
$(obj)/host/deploy/script.o: host/deploy/board.sh
