# What the library is made of: code for any address, of which no name but those
# of its header is seen from outside.
library      := $(call files,incode host/library) transport/text.c \
	boards/processor/processor.c $(patsubst %,host/%.c, \
	base/error base/memory base/parallel base/scratch base/text \
	mesh/adjacency mesh/duplicates mesh/kd_build mesh/lift mesh/order \
	mesh/points mesh/sort mesh/spill mesh/tetrahedra)

$(library:%.c=$(obj)/%.o): private BASE += -fPIC -fvisibility=hidden
# Its code of each level in place of that of one.
library_objects := $(library_levels) $(filter-out $(if $(library_levels), \
	$(library_levelled:%.c=$(obj)/%.o)),$(library:%.c=$(obj)/%.o))
$(BUILD)/libincode.so.0: $(library_objects)
	$(say) LINK $@
	$(Q)$(CC) $(HOSTED) -shared -Wl,-soname,$(@F) -Wl,--no-undefined $^ -lm -o $@
$(BUILD)/libincode.o: $(library_objects)
	@$(LD) -r $^ -o $@
	@$(OBJCOPY) --localize-hidden $@
$(BUILD)/libincode.a: $(BUILD)/libincode.o
	@rm -f $@
	@$(AR) rcsD $@ $^

# What programs that are linked with the library rely on: the symbols of the last
# release, and the types that these reach.  Made again at a release;
# tests/system/full/abi.sh compares it with what is built.
$(call usual,ABI,host/library/libincode.abi)
abi: $(BUILD)/libincode.so.0
	$(say) ABI '$(ABI)'
	$(Q)abidw --exported-interfaces-only --drop-undefined-syms --no-elf-needed \
		--no-comp-dir-path --no-corpus-path --no-architecture --no-show-locs \
		--type-id-style hash --out-file '$(ABI)' $<
