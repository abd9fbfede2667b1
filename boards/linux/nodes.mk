# Node programs for boards with Linux, one a processor, as `uname -m` has it or
# Debian (deploy.c tells which): nodes_ARCH is the compiler's prefix, and what it
# is to compile for, so that any such board takes it.  Their C library is musl,
# as it takes no memory by itself, and needs no package on the board; it and
# libsodium are built from the distribution's sources, as there are no packages
# of them for all of these.
node_arches := x86_64 aarch64 armhf riscv64
nodes_x86_64  := x86_64-linux-gnu- -march=x86-64
nodes_aarch64 := aarch64-linux-gnu- -march=armv8-a
nodes_armhf   := arm-linux-gnueabihf- -march=armv7-a+fp -mfloat-abi=hard
nodes_riscv64 := riscv64-linux-gnu- -march=rv64gc
# That of this architecture has the code of all its levels, as others here do.
nodes_levels_x86_64 := $(core_levels)
node_programs := $(node_arches:%=$(BUILD)/nodes/incode-node-%)
node_sources  := $(freestanding) $(wildcard boards/*.c boards/linux/*.c) \
	boards/processor/processor.c $(node_drivers)
# FOR: some of them alone.
node_for     := $(or $(filter $(node_arches),$(FOR)),$(node_arches))
node_unknown := $(filter-out $(node_arches),$(FOR))
node_refusal := FOR=$(node_unknown): there is no node program of that; allowed: \
	$(node_arches)
nodes:
	$(if $(node_unknown),$(error $(node_refusal)))
	@$(MAKE) --no-print-directory deps-nodes
	@$(MAKE) --no-print-directory cross
cross: $(node_for:%=$(BUILD)/nodes/incode-node-%)

# What of them a node calls; of musl also all that is a processor's own.
musl_folders := $(addprefix src/,env errno exit internal ldso linux setjmp signal \
	string thread) crt
musl_names   := \
	_Exit __environ __errno_location __fpclassifyl __init_tls __lctrans \
	__libc_start_main __lock __lockfile __set_thread_area __signbitl \
	__stdio_close __stdio_exit __stdio_seek __stdio_write __syscall_cp \
	__timedwait __tls_get_addr __toread __towrite __uflow _exit abort \
	abort_lock accept accept4 access assert bind block cfmakeraw \
	cfsetospeed clock_gettime clock_nanosleep close connect default_attr \
	defsysinfo dl_iterate_phdr execve exit fcntl fprintf frexp frexpl \
	fstat fstatat fwrite getenv geteuid getrandom getsockname getsockopt \
	htonl htons inet_pton intscan ioctl isatty libc listen lseek lstat \
	memchr memcmp memcpy memmove memrchr memset mmap nanosleep ofl open \
	poll ppoll prctl procfdname pthread_cleanup_push \
	pthread_setcancelstate pthread_testcancel pty raise read recv \
	recvfrom sched_yield sem_destroy sem_init sem_post sem_timedwait \
	sem_trywait sem_wait send sendto setrlimit setsockopt shgetc \
	sigaction sigprocmask snprintf socket socketpair stderr strchr \
	strchrnul strcmp strerror strlen strncmp strnlen strrchr strtol \
	synccall syscall_ret tcflush tcgetattr tcsetattr umask unlink vdso \
	vfprintf vsnprintf wcrtomb wctomb write
node_crypto  := crypto_aead/chacha20poly1305/sodium/aead_chacha20poly1305 \
	crypto_core/ed25519/ref10/ed25519_ref10 \
	crypto_core/hchacha20/core_hchacha20 \
	crypto_generichash/blake2b/ref/blake2b-compress-ref \
	crypto_generichash/blake2b/ref/blake2b-ref \
	crypto_generichash/blake2b/ref/generichash_blake2b \
	crypto_onetimeauth/poly1305/donna/poly1305_donna \
	crypto_onetimeauth/poly1305/onetimeauth_poly1305 \
	crypto_scalarmult/curve25519/ref10/x25519_ref10 \
	crypto_scalarmult/curve25519/scalarmult_curve25519 \
	crypto_stream/chacha20/ref/chacha20_ref \
	crypto_stream/chacha20/stream_chacha20 \
	crypto_verify/sodium/verify
node_sodium  := $(fetched)/libsodium/src/libsodium

# node_arch ARCH
define node_arch
nodes_cc_$(1) := $$(firstword $$(nodes_$(1)))gcc
nodes_at_$(1) := $(BUILD)/nodes/$(1)
nodes_objects_$(1) := $$(patsubst %.c,$$(nodes_at_$(1))/%.o,$$(filter-out \
		$$(if $$(nodes_levels_$(1)),$$(core_levelled)),$$(node_sources))) \
	$$(node_crypto:%=$$(nodes_at_$(1))/sodium/%.o)
$$(nodes_objects_$(1)): private NODE_CC = $$(nodes_at_$(1))/musl/bin/musl-gcc
$$(nodes_objects_$(1)): private MACHINE = $$(wordlist 2,9,$$(nodes_$(1)))
$$(nodes_at_$(1))/musl/made: $(fetched)/musl/fetched
	$$(say) MUSL $(1)
	@rm -rf $$(nodes_at_$(1))/musl.build && mkdir -p $$(nodes_at_$(1))/musl.build
	$$(Q)cd $$(nodes_at_$(1))/musl.build && { $(abspath $(fetched))/musl/configure \
		--target=$$(patsubst %-gcc,%,$$(nodes_cc_$(1))) CC=$$(nodes_cc_$(1)) \
		--prefix=$$(abspath $$(@D)) --disable-shared --enable-wrapper=gcc && \
		MAKEFLAGS="$$$${MAKEFLAGS%% -- *}" $$(MAKE) install \
			SRC_DIRS='$$(musl_folders:%=$$$$(srcdir)/%)' BASE_GLOBS=' \
			$$(musl_names:%=$$$$(srcdir)/src/*/%.c) $$$$(srcdir)/crt/*.c'; \
		} > log 2>&1 || { tail -n 5 log >&2; exit 1; }
	@touch $$@
$$(nodes_objects_$(1)): $$(nodes_at_$(1))/musl/made $(fetched)/libsodium/fetched
$$(nodes_at_$(1))/sodium/%.o: $(BUILD)/flags
	@mkdir -p $$(@D)
	$$(say) CC $$@
	$$(Q)$$(NODE_CC) -w -O2 $$(MACHINE) -ffunction-sections -DCONFIGURED=1 -DNATIVE_LITTLE_ENDIAN=1 \
		-I $$(node_sodium)/include/sodium -c $$(node_sodium)/$$*.c -o $$@
$$(nodes_at_$(1))/%.o: %.c $(BUILD)/flags $(BUILD)/include/sodium.h
	@mkdir -p $$(@D)
	$$(say) CC $$@
	$$(Q)$$(NODE_CC) $$(BASE) $$(NODE_INCLUDE) -D_GNU_SOURCE= -MMD -MP -c $$< -o $$@
$(BUILD)/nodes/incode-node-$(1): $$(nodes_objects_$(1)) $$(nodes_levels_$(1))
	$$(say) LINK $$@
	$$(Q)$$(nodes_at_$(1))/musl/bin/musl-gcc -static -s -Wl,--gc-sections $$^ -o $$@
endef
$(foreach a,$(node_arches),$(eval $(call node_arch,$(a))))
