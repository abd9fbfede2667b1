# What the library is made of: code for any address, of which no name but those
# of its header is seen from outside.
library      := $(call files,incode host/library) transport/text.c $(patsubst %,host/%.c, \
	base/error base/memory base/parallel base/scratch base/text \
	mesh/adjacency mesh/duplicates mesh/kd_build mesh/lift mesh/order \
	mesh/spill mesh/tetrahedra)

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
