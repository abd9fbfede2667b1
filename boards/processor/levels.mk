# ARCH=any: programs and library for every processor of the architecture.  All
# is compiled for its baseline, and what takes the time once more for each level
# of x86-64; one level runs (processor.h).  Of others the baseline is all: that
# of arm64 has its vectors.
#
# NAME_levels is that code and its stubs in one object: core for nodes, library,
# and host for the programs of hosts.  It comes before archives, which then give
# nothing of it.  Bare boards have their processor's code alone.
levels      := x86-64 x86-64-v2 x86-64-v3 x86-64-v4
core_levelled := $(filter incode/%,$(freestanding)) transport/frame.c
library_levelled := $(core_levelled) host/mesh/kd_build.c
host_levelled := $(library_levelled) host/verify/check.c host/verify/sums.c
machine_of  := $(shell $(CC) -dumpmachine)
has_levels  := $(and $(filter any,$(ARCH)),$(filter x86_64-%,$(machine_of)))
baseline    := $(if $(filter x86_64-%,$(machine_of)),-march=x86-64, \
	$(if $(filter aarch64-%,$(machine_of)),-march=armv8-a))
$(foreach g,core library host,$(eval $(g)_levels := \
	$(if $(has_levels),$(BUILD)/levels/$(g).o)))

# The baseline's objects are those of any build.
level_objects = $(addprefix $(if $(filter x86-64,$(2)),$(obj),$(BUILD)/levels/$(2))/, \
	$($(1)_levelled:%.c=%.o))
# level LEVEL
define level
$(BUILD)/levels/$(1)/%.o: private MACHINE = -march=$(1)
$(BUILD)/levels/$(1)/host/%.o $(BUILD)/levels/$(1)/tests/%.o: \
	private BASE += -pthread -D_GNU_SOURCE=
$$(core_levelled:%.c=$(BUILD)/levels/$(1)/%.o): private BASE += \
	-fno-tree-vectorize
$(BUILD)/levels/$(1)/%.o: %.c $(BUILD)/flags
	@mkdir -p $$(@D)
	$$(say) CC '$$< $(1)'
	$$(Q)$$(CC) $$(BASE) -fPIC -fvisibility=hidden -MMD -MP -c $$< -o $$@
endef
$(foreach l,$(levels),$(eval $(call level,$(l))))
# levels_object GROUP: of each level one object, whose functions bear its name.
define levels_object
$(foreach l,$(levels),$(BUILD)/levels/$(1)-$(l).o: $(call level_objects,$(1),$(l))
)
$(BUILD)/levels/$(1).o: $(levels:%=$(BUILD)/levels/$(1)-%.o) boards/processor/stubs
	$$(say) LINK $$@
	@boards/processor/stubs $(BUILD)/levels/$(1)-x86-64.names $(levels) > $$(@:.o=.s)
	@$$(CC) -c $$(@:.o=.s) -o $$(@:.o=-stubs.o)
	@$$(LD) -r $$(@:.o=-stubs.o) $$(filter %.o,$$^) -o $$@
	@$$(OBJCOPY) --wildcard --localize-symbol='x86_64_*' $$@
$(BUILD)/levels/$(1)-%.o: boards/processor/levels.mk
	@mkdir -p $$(@D)
	@$$(LD) -r $$(filter %.o,$$^) -o $$@
	@nm -g --defined-only $$@ | awk '{ print $$$$3 } $$$$2 != "T" { \
		print "$$@: " $$$$3 " is no function" > "/dev/stderr"; exit 1 }' \
		> $$(@:.o=.names)
	@sed 's/.*/& $$(subst -,_,$$*)_&/' $$(@:.o=.names) > $$(@:.o=.renamed)
	@$$(OBJCOPY) --redefine-syms=$$(@:.o=.renamed) $$@
endef
$(foreach g,core library host,$(eval $(call levels_object,$(g))))

# Unit tests have the code of the highest level here, of whose vectors they know;
# levels/LEVEL/test_NAME is one of another.
best_level := $(if $(has_levels),$(or $(firstword $(filter $(levels),$(shell \
	/lib64/ld-linux-x86-64.so.2 --help | sed -n 's/.supported,.*//p'))),x86-64))
best_core  := $(best_level:%=$(BUILD)/levels/%.a)
define level_tests
$(BUILD)/levels/$(1).a: $(call level_objects,core,$(1))
$(BUILD)/levels/$(1)/test_%: $(BUILD)/levels/$(1)/tests/unit/incode/predicates/test_%.o \
		$(BUILD)/levels/$(1).a $(BUILD)/libhost.a $(BUILD)/libcore.a
	$$(say) LINK $$@
	$$(Q)$$(CC) $$(HOSTED) $$^ $$(HOST_LIBS) -lcmocka -lgmp -o $$@
endef
$(foreach l,$(levels),$(eval $(call level_tests,$(l))))
$(if $(best_level),$(eval $(obj)/tests/unit/%.o: private MACHINE = \
	-march=$(best_level)))
