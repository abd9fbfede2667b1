# The packages that each target asks for.

run_packages   = gcc libc6-dev make musl-tools zlib1g-dev libexpat1-dev \
	libpng-dev nettle-dev libjansson-dev libserialport-dev libsodium-dev \
	libconfig-dev libgpiod-dev pkg-config libedit-dev libhdf5-dev \
	libopenmpi-dev openmpi-bin
python_packages = gcc libc6-dev make python3-dev python3-cffi python3-numpy
# Of the processors that make nodes is called for.
node_packages  = $(run_packages) dpkg-dev \
	$(foreach a,$(node_for),$(node_packages_$(a)))
node_packages_aarch64 = gcc-aarch64-linux-gnu libc6-dev-arm64-cross
node_packages_armhf   = gcc-arm-linux-gnueabihf libc6-dev-armhf-cross
node_packages_riscv64 = gcc-riscv64-linux-gnu libc6-dev-riscv64-cross
# Of the packages: Build-Depends of host/package/control.
deb_packages   = $(run_packages) $(python_packages) dpkg-dev fakeroot debhelper \
	dh-python gcc-aarch64-linux-gnu libc6-dev-arm64-cross gcc-arm-none-eabi \
	libnewlib-arm-none-eabi $(node_packages_riscv64)
test_packages  = $(run_packages) libcmocka-dev libgmp-dev clang clang-format \
	libclang-rt-dev clang-tidy cppcheck shellcheck valgrind jq man-db procps tmux \
	openssl python3-h5py gcc-arm-none-eabi libnewlib-arm-none-eabi \
	$(node_packages_riscv64) qemu-system-arm qemu-system-misc qemu-user-static \
	openssh-server openssh-client $(node_packages) $(python_packages) python3-scipy python3-pytest
bench_packages = $(run_packages) g++ gnuplot-nox libcgal-dev libtet1.5-dev \
	libqhull-dev libgmsh-dev python3-scipy
full_packages  = $(test_packages) $(bench_packages) $(deb_packages) lintian debootstrap \
	cpio abigail-tools

deps: deps-test
deps-run:
	@sh tests/deps $(run_packages)
deps-python:
	@sh tests/deps $(python_packages)
deps-test:
	@sh tests/deps $(test_packages)
deps-nodes:
	@sh tests/deps $(node_packages)
deps-deb:
	@sh tests/deps $(deb_packages)
deps-bench:
	@sh tests/deps $(bench_packages)
deps-full:
	@sh tests/deps $(full_packages)
