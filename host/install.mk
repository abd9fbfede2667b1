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
# Likewise the Python package that make python has made.  PYTHONDIR is that folder
# under PREFIX which Python looks in where PREFIX is /usr/local.
PYTHONDIR ?= $(PREFIX)/$(shell $(PYTHON) -c 'import re, sysconfig; \
	print(re.search("lib[^/]*/python.*", sysconfig.get_path("platlib"))[0])' \
	2> /dev/null)
python_to  = $(DESTDIR)$(PYTHONDIR)/incode
made_python = $(wildcard $(package_all))
# The library, its header and what pkg-config tells of it.
header     = $(DESTDIR)$(PREFIX)/include
LIBDIR    ?= $(PREFIX)/lib
library_to = $(DESTDIR)$(LIBDIR)
VERSION   := $(shell sed -n 's/.*NODE_VERSION "\(.*\)"/\1/p' node/version.h)
# Documents, what they show, and examples, in folders as here.
doc       = $(DESTDIR)$(PREFIX)/share/doc/incode
documents := $(wildcard *.md LICENSE incode/*.md boards/*.md transport/*.md \
	tests/*.md host/*.md host/*/*.md host/*/*/*.md \
	boards/linux/examples/* host/draw/*.svg)
man_pages := $(BUILD)/pages/incode.1 $(BUILD)/pages/incode-node.1
# It is also that of the programs for ranks of MPI.
man_links := incode-mpi.1 incode-node-mpi.1
pages     := $(man_pages) $(BUILD)/pages/incode.bash
pages: $(pages)
$(pages): $(BUILD)/pages/%: host/pages $(BUILD)/incode $(BUILD)/incode-node
	@mkdir -p $(@D)
	$(say) PAGE $@
	@bash host/pages $* $(BUILD) > $@

# Folders that install has made, for uninstall.
folders   = $(doc)/.folders
install: all $(pages)
	@for folder in '$(bin)' '$(man)' '$(completion)' '$(lib)/loader' '$(header)' \
		'$(library_to)/pkgconfig' $(patsubst %/,'$(doc)/%',$(sort $(dir $(documents)))) \
		$(if $(made_python),'$(python_to)/__pycache__'); do \
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
		'Cflags: -I$(PREFIX)/include' 'Libs: -L$(LIBDIR) -lincode' \
		'Libs.private: -lm -pthread' > '$(BUILD)/incode.pc'
	install -m 644 '$(BUILD)/incode.pc' '$(library_to)/pkgconfig'
	install -m 644 $(man_pages) '$(man)'
	for page in $(man_links); do ln -sf incode.1 '$(man)'/$$page || exit 1; done
	install -m 644 $(BUILD)/pages/incode.bash '$(completion)/incode'
	$(if $(made_images),install -d '$(lib)' && \
		install -m 644 $(made_images) '$(lib)')
	$(if $(made_loaders),install -d '$(lib)/loader' && \
		install -m 644 $(made_loaders) '$(lib)/loader')
	$(if $(made_nodes),install -d '$(lib)' && install $(made_nodes) '$(lib)')
	$(if $(made_python),install -d '$(python_to)' && \
		install -m 644 $(made_python) '$(python_to)')
	install -m 644 $(BUILD)/pages/incode.bash '$(completion)/incode-node'

uninstall:
	rm -f $(patsubst %,'$(lib)/%.img',$(bare_boards)) \
		$(patsubst %,'$(lib)/loader/%.img',$(bare_boards)) \
		$(patsubst %,'$(lib)/%',$(notdir $(node_programs)))
	rm -f $(patsubst %,'$(bin)/%',$(notdir $(programs))) \
		$(patsubst %,'$(man)/%',$(notdir $(man_pages)) $(man_links)) \
		'$(completion)/incode' '$(completion)/incode-node' \
		'$(header)/incode.h' '$(library_to)/libincode.so' \
		$(patsubst %,'$(library_to)/%',$(notdir $(libraries))) \
		'$(library_to)/pkgconfig/incode.pc' \
		$(patsubst %,'$(doc)/%',$(documents)) \
		$(patsubst %,'$(python_to)/%',$(notdir $(package_all))) \
		'$(python_to)/__pycache__'/*.pyc
	@if [ -e '$(folders)' ]; then \
		made=$$(sort -ru '$(folders)'); rm '$(folders)'; \
		printf '%s\n' "$$made" | while read -r folder; do \
			rmdir "$$folder" 2> /dev/null; done; :; fi
