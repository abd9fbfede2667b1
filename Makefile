# Builds, runs and tests incode.  `make help` lists what there is.
#
# Variables: BUILD (where everything made goes), CC, ARCH (-march=), OPT,
# SAN (sanitizers, as in SAN=address,undefined; their own BUILD, please).

# The usual value, also where a variable is given without one.
usual   = $(eval override $(1) := $(or $(strip $($(1))),$(2)))
$(call usual,BUILD,build)
$(call usual,ARCH,native)
$(call usual,OUT,out)
SAN    ?=
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
WARNINGS = -Wall -Wextra -Wconversion -Wshadow -Wno-psabi
# One rounding an operation, whatever the compiler: the results depend on it.
FLOATING = -ffp-contract=off -fno-math-errno -fno-trapping-math
SANITIZE = $(if $(SAN),-fsanitize=$(SAN) -fno-sanitize-recover=all \
	-fno-omit-frame-pointer -DINCODE_SANITIZED)
CFLAGS  ?= -g
OBJCOPY ?= objcopy
MACHINE  = -march=$(ARCH)
BASE     = -std=c11 -I. $(WARNINGS) $(OPT) $(MACHINE) $(FLOATING) $(SANITIZE) \
	$(CFLAGS)
HOSTED   = $(BASE) -pthread -D_GNU_SOURCE=
# V=1 shows every command.
Q = $(if $(V),,@)
say = @$(if $(V),:,printf '  %-4s %s\n')
MPI_CFLAGS = $(addprefix -isystem ,$(shell mpicc --showme:incdirs))
MPI_LIBS = $(addprefix -L,$(shell mpicc --showme:libdirs)) -lmpi
HOST_LIBS = -ledit -lconfig -lsodium -lserialport -lgpiod -ljansson -lnettle -lexpat \
	-lpng -lz -lm

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
# The calls of that version of libgpiod which is installed.
GPIOD        := $(firstword $(subst ., ,$(shell pkg-config --modversion libgpiod \
	2>/dev/null)) 1)
host         := $(filter-out host/main.c $(host_mpi),$(call files,host))
host         := $(filter-out host/cube/lines_gpiod%,$(host)) \
	host/cube/lines_gpiod$(GPIOD).c
unit         := $(call files,tests/unit)
fuzz         := $(wildcard tests/fuzz/fuzz_*.c)

obj          := $(BUILD)/obj
# What the library is made of: code for any address, of which no name but those
# of its header is seen from outside.
library      := $(call files,incode host/library) transport/text.c $(patsubst %,host/%.c, \
	base/error base/memory base/parallel base/text mesh/adjacency \
	mesh/duplicates mesh/kd_build mesh/lift mesh/order mesh/spill \
	mesh/tetrahedra)
core_objects := $(freestanding:%.c=$(obj)/%.o)
host_objects := $(host:%.c=$(obj)/%.o) $(drivers:%.c=$(obj)/%.o)
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
.PHONY: all unit points planted bare arithmetic fuzzers run check test \
	test-full bench firmware nodes cross fuzz lint install uninstall clean \
	compdb hooks \
	help deps deps-run deps-nodes deps-test deps-bench deps-full FORCE

programs     := $(BUILD)/incode $(BUILD)/incode-mpi $(BUILD)/incode-node-mpi \
	$(nodes)
libraries    := $(BUILD)/libincode.a $(BUILD)/libincode.so.0
all: $(programs) $(libraries)

$(BUILD)/incode: $(obj)/host/main.o $(BUILD)/libhost.a $(BUILD)/libcore.a
	$(say) LINK $@
	$(Q)$(CC) $(HOSTED) $^ $(HOST_LIBS) -o $@

# Static, so that a node's data memory is what the node itself declares.
$(foreach b,$(boards),$(eval $(call node,$(b)): \
	$(patsubst %.c,$(BUILD)/node/%.o,$(wildcard boards/$(b)/*.c))))
$(nodes): $(node_objects) $(BUILD)/libcore.a
	$(say) LINK $@
	$(Q)$(NODE_CC) $(BASE) $(if $(SAN),,-static) $(filter %.o,$^) \
		$(BUILD)/libcore.a $(NODE_LIBS) -o $@

$(BUILD)/incode-mpi: $(mpi_host) $(BUILD)/libhost.a $(BUILD)/libcore.a
	$(say) LINK $@
	$(Q)$(CC) $(HOSTED) $^ $(HOST_LIBS) $(MPI_LIBS) -o $@
$(BUILD)/incode-node-mpi: $(mpi_node) $(BUILD)/libcore.a
	$(say) LINK $@
	$(Q)$(CC) $(HOSTED) $^ $(MPI_LIBS) -o $@

$(library:%.c=$(obj)/%.o): private BASE += -fPIC -fvisibility=hidden
$(BUILD)/libincode.so.0: $(library:%.c=$(obj)/%.o)
	$(say) LINK $@
	$(Q)$(CC) $(HOSTED) -shared -Wl,-soname,$(@F) -Wl,--no-undefined $^ -lm -o $@
$(BUILD)/libincode.o: $(library:%.c=$(obj)/%.o)
	@$(LD) -r $^ -o $@
	@$(OBJCOPY) --localize-hidden $@
$(BUILD)/libincode.a: $(BUILD)/libincode.o
	@rm -f $@
	@$(AR) rcs $@ $^
$(BUILD)/libcore.a: $(core_objects)
$(BUILD)/libhost.a: $(host_objects)
$(BUILD)/%.a: $(BUILD)/lists
	@rm -f $@
	@$(AR) rcs $@ $(filter %.o,$^)
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

ifeq ($(wildcard host/cube/lines_gpiod$(GPIOD).c),)
host/cube/lines_gpiod$(GPIOD).c:
	@echo 'make: libgpiod $(GPIOD) is installed; its calls belong in $@,' \
		'as those of version 1 are in lines_gpiod1.c' >&2
	@false
endif

# A simulation's failure names the commit that replays it.
COMMIT := $(or $(shell git rev-parse --short=12 HEAD 2>/dev/null),unknown)
$(BUILD)/commit: FORCE
	@mkdir -p $(@D)
	@echo '$(COMMIT)' | cmp -s - $@ || echo '$(COMMIT)' > $@

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
	$(obj)/tests/unit/transport/drivers/test_mpi.o: private HOSTED += $(MPI_CFLAGS)
$(obj)/transport/drivers/%.o: transport/drivers/%.c $(BUILD)/flags
	@mkdir -p $(@D)
	$(say) CC $<
	$(Q)$(CC) $(HOSTED) -MMD -MP -c $< -o $@
$(obj)/transport/%.o: transport/%.c $(BUILD)/flags
	@mkdir -p $(@D)
	$(say) CC $<
	$(Q)$(CC) $(BASE) -MMD -MP -c $< -o $@
$(obj)/host/sim/sim.o: host/sim/sim.c $(BUILD)/flags $(BUILD)/commit
	@mkdir -p $(@D)
	$(say) CC $<
	$(Q)$(CC) $(HOSTED) -DINCODE_COMMIT='"$(COMMIT)"' -MMD -MP -c $< -o $@
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

# The script for boards is taken in as it is.
$(obj)/host/deploy/script.o: host/deploy/board.sh

# What bare boards share, for tests on this machine; its own memory functions
# and root under other names.
bare_shared := $(filter-out %/program.c %/memory.c %/sqrt.c,$(wildcard \
	boards/bare/*.c))
own_libc    := $(obj)/boards/bare/memory.o $(obj)/boards/bare/sqrt.o
$(BUILD)/libbare.a: $(bare_shared:%.c=$(obj)/%.o)
$(addprefix $(BUILD)/tests/,$(patsubst %.c,%,$(notdir $(wildcard \
	tests/unit/boards/*.c)))): $(BUILD)/libbare.a
$(BUILD)/tests/test_own_libc: $(own_libc)
$(own_libc): private HOSTED += -fno-builtin -fno-tree-loop-distribute-patterns \
	$(foreach f,memcpy memmove memset memcmp sqrt,-D$(f)=own_$(f))

# incode/ once more, for tests that count the basic blocks it executes: the same
# code on every machine, whatever vectors and sanitizers the others are made for.
counted := $(patsubst %.c,$(BUILD)/counted/%.o,$(filter incode/%,$(freestanding)))
$(BUILD)/tests/test_pause $(BUILD)/tests/test_pace: $(counted)
$(BUILD)/counted/%.o: %.c $(BUILD)/flags
	@mkdir -p $(@D)
	$(say) CC $<
	$(Q)$(CC) -std=c11 -I. -O1 -g1 -Wno-psabi $(FLOATING) -fno-builtin -MMD -MP \
		-fsanitize-coverage=trace-pc $(foreach \
		f,memcpy memmove memset memcmp,-D$(f)=work_$(f)) -c $< -o $@

# A clock of the test's own, of drivers that have the system's.
$(foreach t,tcp tcp_wire unix_file,$(BUILD)/tests/test_$(t)): \
	private HOSTED += -Wl,--wrap=clock_gettime

# A test's folder is its room's; its program stands with the others.
unit: $(unit_tests)
$(foreach t,$(unit),$(eval $(BUILD)/tests/$(notdir $(t:.c=)): $(obj)/$(t:.c=.o)))
$(filter-out %/test_mpi,$(unit_tests)): $(BUILD)/libhost.a $(BUILD)/libcore.a
	@mkdir -p $(@D)
	$(say) LINK $@
	$(Q)$(CC) $(HOSTED) $(filter %.o,$^) -Wl,--start-group $(filter %.a,$^) \
		-Wl,--end-group $(HOST_LIBS) -lcmocka -lgmp -o $@

fuzzers: $(fuzzers)
$(BUILD)/fuzzers/%: $(obj)/tests/fuzz/%.o $(BUILD)/libhost.a \
		$(BUILD)/libcore.a
	@mkdir -p $(@D)
	$(say) LINK $@
	$(Q)$(CC) $(HOSTED) -fsanitize=fuzzer $^ $(HOST_LIBS) -o $@

-include $(shell find $(BUILD) -name '*.d' -type f 2>/dev/null)

# The program with a fault in it, for the test that the simulation finds it.
planted_programs := $(addprefix $(BUILD)/tests/incode-,twice lost-batch answer \
	taken-by-two kept late)
planted: $(planted_programs)
$(BUILD)/tests/incode-twice: planted = incode/triangulator.c -DINCODE_PLANT_TWICE
$(BUILD)/tests/incode-twice: incode/triangulator.c
$(BUILD)/tests/incode-kept: planted = incode/front/order.c -DINCODE_PLANT_KEPT
$(BUILD)/tests/incode-kept: incode/front/order.c
$(BUILD)/tests/incode-lost-batch: planted = \
	host/service/handlers.c -DINCODE_PLANT_LOST_BATCH
$(BUILD)/tests/incode-lost-batch: host/service/handlers.c
$(BUILD)/tests/incode-taken-by-two: planted = \
	transport/tuples/request.c -DINCODE_PLANT_TAKEN_BY_TWO
$(BUILD)/tests/incode-taken-by-two: transport/tuples/request.c
$(BUILD)/tests/incode-answer: planted = incode/paper/manager.c -DINCODE_PLANT_ANSWER
$(BUILD)/tests/incode-answer: incode/paper/manager.c
$(BUILD)/tests/incode-late: planted = incode/front/loan.c -DINCODE_PLANT_LATE
$(BUILD)/tests/incode-late: incode/front/loan.c
$(planted_programs): $(obj)/host/main.o $(BUILD)/libhost.a $(BUILD)/libcore.a
	@mkdir -p $(@D)
	$(say) LINK $@
	$(Q)$(CC) $(HOSTED) $(planted) $(filter %.o %.a,$^) $(HOST_LIBS) -o $@

# The tools that the system tests change point sets with, and bytes on a wire,
# and call listeners with.
tools := $(patsubst tests/system/%.c,$(BUILD)/tests/%,$(wildcard \
	tests/system/*.c))
points: $(tools)
relay := $(patsubst %.c,$(obj)/%.o,$(wildcard tests/system/relay/*.c))
$(BUILD)/tests/relay $(BUILD)/tests/test_relay: $(relay)
$(BUILD)/tests/pulse: $(BUILD)/libhost.a $(BUILD)/libcore.a
$(BUILD)/tests/pulse: tool_libs = $(HOST_LIBS)
$(BUILD)/tests/library: $(BUILD)/libincode.a
$(BUILD)/tests/library: tool_libs = $(foreach \
	f,mmap munmap mremap pthread_create,-Wl,--wrap=$(f))
$(tools): $(BUILD)/tests/%: $(obj)/tests/system/%.o
	@mkdir -p $(@D)
	$(say) LINK $@
	$(Q)$(CC) $(HOSTED) $(filter %.o,$^) $(filter %.a,$^) $(tool_libs) -lm -o $@
# A node program of Linux that lies: tests/system/liar/liar.c.
liar := $(patsubst %.c,$(BUILD)/node/%.o,host/sim/liar.c \
	tests/system/liar/liar.c $(wildcard boards/linux/*.c))
points: $(BUILD)/tests/incode-node-liar
$(BUILD)/tests/incode-node-liar: $(liar) $(node_objects) $(BUILD)/libcore.a
	@mkdir -p $(@D)
	$(say) LINK $@
	$(Q)$(NODE_CC) $(BASE) $(if $(SAN),,-static) $(filter %.o,$^) \
		-Wl,--wrap=node_start $(BUILD)/libcore.a $(NODE_LIBS) -o $@
# A board's flash chip, as its loader has it.
$(BUILD)/tests/chip: $(obj)/transport/drivers/sign_sodium.o $(BUILD)/libcore.a
$(BUILD)/tests/chip: tool_libs = -lsodium

$(BUILD)/tests/test_mpi: $(obj)/tests/unit/transport/drivers/test_mpi.o \
		$(obj)/transport/drivers/mpi.o $(BUILD)/libcore.a
	@mkdir -p $(@D)
	$(say) LINK $@
	$(Q)$(CC) $(HOSTED) $^ $(MPI_LIBS) -lcmocka -o $@
$(BUILD)/tests/mpi_hops: $(obj)/tests/bench/mpi_hops.o \
		$(obj)/transport/drivers/mpi.o $(BUILD)/libcore.a
	@mkdir -p $(@D)
	$(say) LINK $@
	$(Q)$(CC) $(HOSTED) $^ $(MPI_LIBS) -o $@

# The peers of `incode bench peers`, which makes those whose packages are there.
# -frounding-math: CGAL's filters are wrong without it.
peers = $(addprefix $(BUILD)/peers/,cgal cgal_file tetgen qhull)
$(BUILD)/peers/cgal:   peer = -frounding-math $< -lgmp -lnettle
$(BUILD)/peers/cgal_file: peer = -frounding-math $< -lgmp
$(BUILD)/peers/tetgen: peer = $< -ltet
$(BUILD)/peers/qhull:  peer = $< -lqhull_r
$(peers): $(BUILD)/peers/%: tests/bench/%.cpp tests/bench/peer.hpp
	@mkdir -p $(@D)
	$(say) CXX $<
	$(Q)$(CXX) -std=c++17 -O3 -march=$(ARCH) $(peer) -o $@

# What counts an emulated board's instructions for `incode bench boards`.
$(BUILD)/peers/instructions.so: tests/bench/instructions.c
	@mkdir -p $(@D)
	$(say) CC $@
	$(Q)$(CC) $(HOSTED) -shared -fPIC $< -o $@

# The distribution's sources of libraries, for boards and processors of which it
# has no packages.
fetched := $(BUILD)/source
$(fetched)/%/fetched: boards/source
	$(say) GET $(@D)
	$(Q)boards/source $* $(fetched)
	@touch $@

include boards/bare/images.mk
include boards/linux/nodes.mk

# The cases of arithmetic here, and where it is known to be wrong.
$(BUILD)/tests/arithmetic: $(arithmetic:%.c=$(obj)/%.o) \
		$(obj)/tests/arithmetic/native.o $(BUILD)/libcore.a
	$(say) LINK $@
	$(Q)$(CC) $(HOSTED) $^ -lm -o $@
$(BUILD)/tests/arithmetic-%: $(arithmetic) tests/arithmetic/native.c \
		$(wildcard tests/arithmetic/*.h incode/predicates/*)
	@mkdir -p $(@D)
	$(say) LINK $@
	$(Q)$(CC) $(HOSTED) $(planted) $(filter %.c,$^) -lm -o $@
$(BUILD)/tests/arithmetic-fused: planted = -ffp-contract=fast
$(BUILD)/tests/arithmetic-extended: planted = -mfpmath=387
arithmetic: $(BUILD)/tests/arithmetic $(BUILD)/tests/arithmetic-fused \
	$(BUILD)/tests/arithmetic-extended

# --- what users call -------------------------------------------------------

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

# The images of bare boards, what of a node's memory they take, and their checks.
firmware: deps-test
	@$(MAKE) --no-print-directory bare
	@BUILD='$(BUILD)' bash tests/firmware

fuzz: deps-test
	@BUILD='$(BUILD)' FUZZ_SECONDS='$(FUZZ_SECONDS)' \
		bash tests/fuzz/run

# For an editor's language server: every source with the flags that a build of
# all gives it.
compdb:
	@$(MAKE) --no-print-directory --always-make --dry-run V=1 all unit | \
		awk -v here='$(CURDIR)' ' \
		/ -c [^ ]+\.c -o / { gsub(/\t/, " "); gsub(/["\\]/, "\\\\&"); source = $$0; \
			sub(/.* -c /, "", source); sub(/ .*/, "", source); \
			printf "%s{\"directory\": \"%s\", \"file\": \"%s\", " \
				"\"command\": \"%s\"}", n++ ? ",\n" : "[\n", here, \
				source, $$0 } \
		END { print "\n]" }' > compile_commands.json
hooks:
	@printf '%s\n' '#!/bin/sh' 'exec tests/hook' > \
		"$$(git rev-parse --git-path hooks)/pre-commit"
	@chmod +x "$$(git rev-parse --git-path hooks)/pre-commit"

lint: deps-test
	@BUILD='$(BUILD)' bash tests/lint

# Where the programs, their pages and their completion go: what is put there,
# and what is taken away again.
bin        = $(DESTDIR)$(PREFIX)/bin
man        = $(DESTDIR)$(PREFIX)/share/man/man1
completion = $(DESTDIR)$(PREFIX)/share/bash-completion/completions
# Images of boards that make firmware has made.
lib        = $(DESTDIR)$(PREFIX)/lib/incode
made_images  = $(wildcard $(images))
made_loaders = $(wildcard $(images:$(BUILD)/firmware/%=$(BUILD)/firmware/loader/%))
# Likewise programs of nodes that make nodes has made.
made_nodes   = $(wildcard $(node_programs))
# The library, its header and what pkg-config tells of it.
header     = $(DESTDIR)$(PREFIX)/include
library_to = $(DESTDIR)$(PREFIX)/lib
VERSION   := $(shell sed -n 's/.*NODE_VERSION "\(.*\)"/\1/p' node/version.h)
# Documents, what they show, and examples, in folders as here.
doc       = $(DESTDIR)$(PREFIX)/share/doc/incode
documents := $(wildcard *.md LICENSE incode/*.md boards/*.md transport/*.md \
	tests/*.md host/*.md host/*/*.md host/service/strategies/*.md \
	boards/linux/examples/* host/draw/*.svg)
man_pages := $(BUILD)/pages/incode.1 $(BUILD)/pages/incode-node.1
pages     := $(man_pages) $(BUILD)/pages/incode.bash
$(pages): $(BUILD)/pages/%: host/pages $(BUILD)/incode $(BUILD)/incode-node
	@mkdir -p $(@D)
	$(say) PAGE $@
	@bash host/pages $* $(BUILD) > $@

# Folders that install has made, for uninstall.
folders   = $(doc)/.folders
install: all $(pages)
	@for file in bin/- share/man/man1/- share/bash-completion/completions/- \
		lib/incode/loader/- include/- lib/pkgconfig/- $(documents:%=share/doc/incode/%); do \
		folder='$(DESTDIR)$(PREFIX)/'$${file%/*}; \
		while [ ! -e "$$folder" ]; do \
			echo "$$folder"; above=$${folder%/*}; \
			[ "$$above" != "$$folder" ] || break; folder=$$above; done; \
	done > '$(BUILD)/folders'
	install -d '$(bin)' '$(man)' '$(completion)'
	for file in $(documents); do \
		install -D -m 644 $$file '$(doc)'/$$file || exit 1; done
	cat '$(BUILD)/folders' >> '$(folders)'
	install $(programs) '$(bin)'
	install -d '$(header)' '$(library_to)/pkgconfig'
	install -m 644 host/library/incode.h '$(header)'
	install -m 644 $(libraries) '$(library_to)'
	ln -sf libincode.so.0 '$(library_to)/libincode.so'
	printf '%s\n' 'Name: incode' 'Version: $(VERSION)' \
		'Description: exact 3D Delaunay triangulation' \
		'Cflags: -I$(PREFIX)/include' 'Libs: -L$(PREFIX)/lib -lincode' \
		'Libs.private: -lm -pthread' > '$(library_to)/pkgconfig/incode.pc'
	install -m 644 $(man_pages) '$(man)'
	install -m 644 $(BUILD)/pages/incode.bash '$(completion)/incode'
	$(if $(made_images),install -d '$(lib)' && \
		install -m 644 $(made_images) '$(lib)')
	$(if $(made_loaders),install -d '$(lib)/loader' && \
		install -m 644 $(made_loaders) '$(lib)/loader')
	$(if $(made_nodes),install -d '$(lib)' && install $(made_nodes) '$(lib)')
	ln -sf incode '$(completion)/incode-node'

uninstall:
	rm -f $(patsubst %,'$(lib)/%.img',$(bare_boards)) \
		$(patsubst %,'$(lib)/loader/%.img',$(bare_boards)) \
		$(patsubst %,'$(lib)/%',$(notdir $(node_programs)))
	rm -f $(patsubst %,'$(bin)/%',$(notdir $(programs))) \
		$(patsubst %,'$(man)/%',$(notdir $(man_pages))) \
		'$(completion)/incode' '$(completion)/incode-node' \
		'$(header)/incode.h' '$(library_to)/libincode.so' \
		$(patsubst %,'$(library_to)/%',$(notdir $(libraries))) \
		'$(library_to)/pkgconfig/incode.pc' \
		$(patsubst %,'$(doc)/%',$(documents))
	@if [ -e '$(folders)' ]; then \
		sort -ru '$(folders)' > '$(BUILD)/folders'; rm '$(folders)'; \
		while read -r folder; do \
			rmdir "$$folder" 2> /dev/null; done < '$(BUILD)/folders'; :; fi

clean:
	rm -rf '$(BUILD)'

help:
	@echo 'make run [POINTS=FILE]   the main job: set up, build, triangulate'
	@echo '                         on 8 nodes, verify, write out/, report'
	@echo 'make test                set up, build, pass all tests (15 minutes)'
	@echo 'make check               build, unit tests, quick lint, half a minute of'
	@echo '                         simulation (3 minutes)'
	@echo 'make                     build/incode, build/incode-node, both for ranks'
	@echo '                         of MPI, and the library: build/libincode.a, .so.0'
	@echo 'make deps                install missing Debian packages'
	@echo 'make test-full           every combination, large sets, a clean'
	@echo '                         chroot (hours)'
	@echo 'make bench [SETS=DIRS]   ratios against CGAL, TetGen and Qhull, and'
	@echo '                         what they are held to (half an hour)'
	@echo 'make firmware [SIGN=FILE]  build/firmware/BOARD.img for each bare board,'
	@echo '                         and its loader, signed with your own pair or one'
	@echo '                         made once; memory maps and checks'
	@echo 'make nodes [FOR=ARCH]    build/nodes/incode-node-ARCH, static, for boards'
	@echo '                         with Linux: x86_64, aarch64, armhf, riscv64, or'
	@echo '                         those of FOR alone'
	@echo 'make fuzz                fuzz every reader (FUZZ_SECONDS each)'
	@echo 'make lint                the order of rooms, format, examples, sizes,'
	@echo '                         warnings as errors, analysers'
	@echo 'make install PREFIX=DIR  copy the programs to DIR/bin, the library to DIR/lib,'
	@echo '                         its header to DIR/include, man pages, documents and'
	@echo '                         completion to DIR/share, firmware and node programs'
	@echo '                         of boards to DIR/lib/incode, if made'
	@echo 'make uninstall           remove them (with the same PREFIX)'
	@echo 'make compdb, make hooks  compile_commands.json; a hook that checks commits'
	@echo 'make clean               remove the build'
	@echo 'Variables: BUILD=build CC=gcc ARCH=native OPT=-O3 CFLAGS=-g SAN='

# --- packages --------------------------------------------------------------

run_packages   = gcc libc6-dev make musl-tools zlib1g-dev libexpat1-dev \
	libpng-dev nettle-dev libjansson-dev libserialport-dev libsodium-dev \
	libconfig-dev libgpiod-dev pkg-config libedit-dev \
	libopenmpi-dev openmpi-bin
# Of the processors that make nodes is called for.
node_packages  = $(run_packages) dpkg-dev \
	$(foreach a,$(node_for),$(node_packages_$(a)))
node_packages_aarch64 = gcc-aarch64-linux-gnu libc6-dev-arm64-cross
node_packages_armhf   = gcc-arm-linux-gnueabihf libc6-dev-armhf-cross
node_packages_riscv64 = gcc-riscv64-linux-gnu libc6-dev-riscv64-cross
test_packages  = $(run_packages) libcmocka-dev libgmp-dev clang clang-format \
	libclang-rt-dev clang-tidy cppcheck shellcheck valgrind jq man-db procps tmux \
	openssl gcc-arm-none-eabi libnewlib-arm-none-eabi \
	qemu-system-arm qemu-user-static openssh-server openssh-client $(node_packages)
bench_packages = $(run_packages) g++ gnuplot-nox libcgal-dev libtet1.5-dev \
	libqhull-dev
full_packages  = $(test_packages) $(bench_packages) debootstrap cpio

deps: deps-test
deps-run:
	@sh tests/deps $(run_packages)
deps-test:
	@sh tests/deps $(test_packages)
deps-nodes:
	@sh tests/deps $(node_packages)
deps-bench:
	@sh tests/deps $(bench_packages)
deps-full:
	@sh tests/deps $(full_packages)
