# The Python package: its module in C, which holds the library, and its files.
# PYTHON is the one whose numpy and cffi are the distribution's.
PYTHON      ?= /usr/bin/python3
package     := $(BUILD)/python/incode
package_py  := $(patsubst host/library/python/incode/%.py,$(package)/%.py,$(wildcard \
	host/library/python/incode/*.py))
package_all := $(package_py) $(package)/_incode.abi3.so

$(package)/%.py: host/library/python/incode/%.py
	@mkdir -p $(@D)
	@cp $< $@
$(BUILD)/python/_incode.c: host/library/python/binding.py host/library/incode.h \
		| deps-python
	@mkdir -p $(@D)
	@$(PYTHON) $< $@ > $@.said || { cat $@.said; false; }
# cffi's text is not held to the warnings of ours.
$(package)/_incode.abi3.so: $(BUILD)/python/_incode.c $(BUILD)/libincode.a
	@mkdir -p $(@D)
	$(say) LINK $@
	$(Q)$(CC) -std=gnu11 -w $(OPT) $(MACHINE) $(SANITIZE) $(CFLAGS) -fPIC -shared \
		-fvisibility=hidden -Wl,--exclude-libs,ALL -DPy_LIMITED_API=0x03080000 \
		-I$$($(PYTHON) -c 'import sysconfig; print(sysconfig.get_path("include"))') \
		-Ihost/library $^ -lm -pthread -o $@

python: $(package_all)
	@:
