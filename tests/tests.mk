# What tests are made of: programs of unit tests, fuzzers, tools, peers.

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
$(BUILD)/tests/test_yield $(BUILD)/tests/test_pace: $(counted)
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
$(filter-out %/test_mpi,$(unit_tests)): $(best_core) $(BUILD)/libhost.a \
		$(BUILD)/libcore.a
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

# The program with a fault in it, for the test that the simulation finds it.
planted_programs := $(addprefix $(BUILD)/tests/incode-,twice lost-batch answer \
	taken-by-two kept late untrimmed)
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
$(BUILD)/tests/incode-untrimmed: planted = \
	host/verify/sums.c -DINCODE_PLANT_UNTRIMMED
$(BUILD)/tests/incode-untrimmed: host/verify/sums.c
$(planted_programs): $(obj)/host/main.o $(BUILD)/libhost.a $(BUILD)/libcore.a
	@mkdir -p $(@D)
	$(say) LINK $@
	$(Q)$(CC) $(HOSTED) $(planted) $(filter %.o %.a,$^) $(HOST_LIBS) -o $@

# The tools that the system tests change point sets with, and bytes on a wire,
# and call listeners with.
tools := $(patsubst tests/system/%.c,$(BUILD)/tests/%,$(filter-out \
	%/testing.c,$(wildcard tests/system/*.c)))
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
# The program once more, with faults to choose: tests/system/testing.c.
testing := $(BUILD)/incode-testing
points: $(testing) $(testing)-mpi
$(BUILD)/renamed/%.o: $(obj)/host/%.o
	@mkdir -p $(@D)
	$(Q)objcopy --redefine-sym main=incode_main $< $@
$(testing): $(BUILD)/renamed/main.o
$(testing)-mpi: $(BUILD)/renamed/main_mpi.o $(filter-out %/main_mpi.o,$(mpi_host))
$(testing)-mpi: private HOST_LIBS += $(MPI_LIBS)
$(testing) $(testing)-mpi: $(obj)/tests/system/testing.o $(host_levels) \
		$(BUILD)/libhost.a $(BUILD)/libcore.a
	$(say) LINK $@
	$(Q)$(CC) $(HOSTED) $(filter %.o,$^) $(filter %.a,$^) $(HOST_LIBS) -o $@

# A node program of Linux that lies: tests/system/liar/liar.c.
liar := $(patsubst %.c,$(BUILD)/node/%.o,host/sim/liar.c \
	tests/system/liar/liar.c $(wildcard boards/linux/*.c))
points: $(BUILD)/tests/incode-node-liar
$(BUILD)/tests/incode-node-liar: $(liar) $(node_objects) $(core_levels) \
		$(BUILD)/libcore.a
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
# -DNDEBUG: its users build it without assertions.
peers = $(addprefix $(BUILD)/peers/,cgal cgal_file cgal_locate tetgen qhull hxt)
$(BUILD)/peers/cgal:   peer = -frounding-math $< -lgmp -lnettle
$(BUILD)/peers/cgal_file: peer = -frounding-math $< -lgmp
$(BUILD)/peers/cgal_locate: peer = -frounding-math $< -lgmp
$(BUILD)/peers/tetgen: peer = $< -ltet
$(BUILD)/peers/qhull:  peer = $< -lqhull_r
$(BUILD)/peers/hxt:    peer = -fopenmp $< -lgmsh
$(peers): $(BUILD)/peers/%: tests/bench/%.cpp tests/bench/peer.hpp
	@mkdir -p $(@D)
	$(say) CXX $<
	$(Q)$(CXX) -std=c++17 -O3 -DNDEBUG -march=$(ARCH:any=native) $(peer) -o $@
# The library beside them.
$(BUILD)/peers/locate: tests/bench/locate.c $(BUILD)/libincode.a
	@mkdir -p $(@D)
	$(say) CC $@
	$(Q)$(CC) $(HOSTED) -I. $^ -lm -o $@

# What counts an emulated board's instructions for `incode bench boards`.
$(BUILD)/peers/instructions.so: tests/bench/instructions.c
	@mkdir -p $(@D)
	$(say) CC $@
	$(Q)$(CC) $(HOSTED) -shared -fPIC $< -o $@

# What else users call for tests.
fuzz: deps-test
	@BUILD='$(BUILD)' FUZZ_SECONDS='$(FUZZ_SECONDS)' \
		bash tests/fuzz/run

# For an editor's language server: every source with the flags that a build of
# all gives it.
compdb:
	@$(MAKE) --no-print-directory --always-make --dry-run V=1 all unit | \
		awk -v here='$(CURDIR)' ' \
		/ -c [^ ]+\.c -o / && !/ -o [^ ]*\/levels\// { gsub(/\t/, " "); gsub(/["\\]/, "\\\\&"); source = $$0; \
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
