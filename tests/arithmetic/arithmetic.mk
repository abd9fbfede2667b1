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
$(BUILD)/tests/arithmetic-fused: planted = -ffp-contract=fast \
	$(if $(filter x86_64-%,$(machine_of)),-march=x86-64-v3)
$(BUILD)/tests/arithmetic-extended: planted = -mfpmath=387
arithmetic: $(BUILD)/tests/arithmetic $(BUILD)/tests/arithmetic-fused \
	$(BUILD)/tests/arithmetic-extended
