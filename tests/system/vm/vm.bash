# shellcheck shell=bash
# A single-board computer: an arm64 virtual machine with the distribution's
# kernel, unmodified, and the host's programs in it, cross-built against the
# distribution's own libraries.  Loads 65 MB of packages the first time, into
# $VM, and builds for half a minute.  Sourced in the place of lib.sh, which it
# sources.
. tests/system/lib.sh
vm=$(realpath -m "${VM:-$BUILD/vm}")
vm_packages='busybox-static libserialport-dev libjansson-dev nettle-dev
    libexpat1-dev libpng-dev zlib1g-dev libsodium-dev libconfig-dev
    libgpiod-dev libedit-dev libhdf5-dev libbsd-dev libmd-dev libncurses-dev'

# Packages of another architecture, without a change to this machine's own.
vm_apt() { # COMMAND...
    (cd "$vm/debs" && APT_CONFIG=$vm/apt/conf "$@") > "$scratch/said" 2>&1
}
vm_has() { ls "$vm/debs/$1"_*.deb > /dev/null 2>&1; }
vm_load() {
    local package missing=() kernel
    mkdir -p "$vm/apt/lists/partial" "$vm/apt/archives/partial" "$vm/debs"
    : > "$vm/apt/status"
    cat > "$vm/apt/conf" <<-END
		APT::Architecture "arm64";
		APT::Architectures { "arm64"; };
		Dir::State "$vm/apt";
		Dir::State::status "$vm/apt/status";
		Dir::Cache "$vm/apt";
		APT::Sandbox::User "root";
		Acquire::Languages "none";
	END
    for package in $vm_packages; do
        vm_has "$package" || missing+=("$package")
    done
    if ! vm_has 'linux-image-[1-9]*'; then
        vm_apt apt-get -qq update
        kernel=$(APT_CONFIG=$vm/apt/conf apt-cache depends linux-image-arm64 |
            sed -n 's/ *Depends: //p')
        missing+=("${kernel:-linux-image-arm64}")
    fi
    [ ${#missing[@]} = 0 ] || vm_apt apt-get -qq download "${missing[@]}"
}

# need_vm NAME PROGRAM...: ends the script where there are no packages; else
# these programs of the build are in $vm/build.
need_vm() {
    local name=$1 package include=$vm/root/usr/include
    local lib=$vm/root/usr/lib/aarch64-linux-gnu
    shift
    if ! vm_load; then
        skip "$name" "no arm64 packages: $(last "$scratch/said")"
        exit 0
    fi
    for package in "$vm"/debs/*.deb; do
        [ "$vm/unpacked" -nt "$package" ] && continue
        case $package in
            */linux-image-*) dpkg-deb --fsys-tarfile "$package" |
                tar -x -C "$vm" --wildcards './boot/vmlinuz*' ;;
            *) mkdir -p "$vm/root" && dpkg -x "$package" "$vm/root" ;;
        esac
    done
    touch "$vm/unpacked"
    # Linked as it is here, but for what it needs itself.
    mkdir -p "$vm/lib"
    echo "INPUT($lib/libedit.a -ltinfo -lbsd -lmd)" > "$vm/lib/libedit.a"
    "${MAKE:-make}" --no-print-directory -j "$(nproc)" BUILD="$vm/build" \
        ARCH=armv8-a CC="aarch64-linux-gnu-gcc -static -isystem $include \
-isystem $include/aarch64-linux-gnu -L$vm/lib -L$lib" \
        "${@/#/$vm/build/}" > "$scratch/said" 2>&1
    status=$?
    check "$name: programs for arm64" "$(last "$scratch/said")" [ $status = 0 ]
    # What else is put into $disk, the machine has as /.
    disk=$scratch/disk
    mkdir -p "$disk/bin" "$disk/proc" "$disk/sys" "$disk/dev"
    # In /bin, or in /usr/bin since Debian 13.
    find "$vm/root" -path '*/bin/busybox' -type f -exec cp {} "$disk/bin/" \;
    cp "${@/#/$vm/build/}" "$disk/bin/"
}

# What the machine does, from standard input, with busybox's commands.
make_init() {
    {
        echo '#!/bin/busybox sh'
        echo '/bin/busybox --install -s /bin'
        echo 'mount -t proc proc /proc'
        echo 'mount -t sysfs sys /sys'
        echo 'mount -t devtmpfs dev /dev'
        cat
        echo 'poweroff -f'
    } > "$disk/init"
    chmod +x "$disk/init"
    (cd "$disk" && find . | cpio -o -H newc --quiet | gzip -1) \
        > "$scratch/initrd"
}

# start_vm ARGUMENT...: of the emulator; $machine.
start_vm() {
    # clock: half an hour
    timeout 1800 qemu-system-aarch64 -M virt -cpu cortex-a53 -m 256 -nodefaults \
        -nographic -serial "file:$scratch/console" \
        -kernel "$vm"/boot/vmlinuz-* -initrd "$scratch/initrd" \
        -append 'console=ttyAMA0 quiet panic=-1' -no-reboot "$@" \
        > "$scratch/qemu" 2>&1 &
    machine=$!
}

# end_vm NAME: waits for it; what its console has said is in $scratch/said.
end_vm() {
    local status
    wait "$machine"
    status=$?
    check "$1: it runs and powers off" "exit $status: $(last "$scratch/qemu")" \
        [ $status = 0 ]
    tr -d '\r' < "$scratch/console" > "$scratch/said"
    sed 's/^/# /' "$scratch/said"
}

# said NAME PATTERN: a line of it.
said() {
    check "$1" "$(last "$scratch/said")" grep -qE "$2" "$scratch/said"
}
