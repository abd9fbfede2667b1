#!/usr/bin/env bash
# The host program on a single-board computer with real serial ports: an arm64
# virtual machine with the distribution's kernel and unmodified libserialport,
# the nodes outside it, a line between them.  Loads 65 MB of packages for arm64
# the first time; then 40 seconds to build and 20 to run.
. tests/system/lib.sh
vm=$(realpath -m "${VM:-$BUILD/vm}")
mkdir -p "$vm/apt/lists/partial" "$vm/apt/archives/partial" "$vm/debs"

# Packages of another architecture, without a change to this machine's own.
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
get() { (cd "$vm/debs" && APT_CONFIG=$vm/apt/conf "$@") > "$scratch/said" 2>&1; }
if ! ls "$vm"/debs/linux-image-*.deb > /dev/null 2>&1; then
    get apt-get -qq update
    kernel=$(APT_CONFIG=$vm/apt/conf apt-cache depends linux-image-arm64 |
        sed -n 's/ *Depends: //p')
    if ! get apt-get -qq download "${kernel:-linux-image-arm64}" \
        busybox-static libserialport-dev libjansson-dev nettle-dev \
        libexpat1-dev libpng-dev zlib1g-dev libsodium-dev libconfig-dev; then
        skip 'vm/the host on real serial ports' \
            "no arm64 packages: $(last "$scratch/said")"
        exit 0
    fi
fi

rm -rf "$vm/root"
mkdir -p "$vm/root"
for package in "$vm"/debs/*.deb; do
    case $package in
        */linux-image-*) dpkg-deb --fsys-tarfile "$package" |
            tar -x -C "$vm" --wildcards './boot/vmlinuz*' ;;
        *) dpkg -x "$package" "$vm/root" ;;
    esac
done
include=$vm/root/usr/include
"${MAKE:-make}" --no-print-directory -j "$(nproc)" BUILD="$vm/build" \
    ARCH=armv8-a CC="aarch64-linux-gnu-gcc -static -isystem $include \
-isystem $include/aarch64-linux-gnu -L$vm/root/usr/lib/aarch64-linux-gnu" \
    "$vm/build/incode" > "$scratch/said" 2>&1
check 'vm/the host program for arm64' "$(last "$scratch/said")" \
    test -x "$vm/build/incode"

# --- the machine --------------------------------------------------------------

disk=$scratch/disk
mkdir -p "$disk/bin" "$disk/proc" "$disk/sys" "$disk/dev"
cp "$vm/root/bin/busybox" "$vm/build/incode" "$disk/bin/"
"$INCODE" gen uniform 400 --seed 5 -o "$disk/points.npy" 2> /dev/null
# The lines are /dev/ttyS0 and /dev/ttyS1 inside.
make_cube() { # HOST'S-DEVICE NODE'S-DEVICE
    cat <<-END
		dimension = 1;
		links = (
		    { node = 0; to = "host"; serial = ["$2", "$1"]; rtscts = false; },
		    { node = 0; to = 1; unix = "$scratch/01.socket"; }
		);
	END
}
make_cube /dev/ttyS0 /dev/none > "$disk/line.cube"
make_cube /dev/ttyS1 /dev/none > "$disk/used.cube"
cat > "$disk/init" <<'END'
#!/bin/busybox sh
/bin/busybox mount -t proc proc /proc
/bin/busybox mount -t sysfs sys /sys
/bin/busybox mount -t devtmpfs dev /dev
echo "ports: $(/bin/busybox ls /dev | /bin/busybox grep ttyS | /bin/busybox tr '\n' ' ')"
/bin/busybox sleep 1000 < /dev/ttyS1 &
/bin/incode run /points.npy -q --cube /used.cube
echo "used: exit $?"
/bin/incode run /points.npy -q --cube /line.cube --stats /stats.json
echo "line: exit $?"
/bin/busybox grep '"digest"' /stats.json
/bin/busybox poweroff -f
END
chmod +x "$disk/init"
(cd "$disk" && find . | cpio -o -H newc --quiet | gzip -1) > "$scratch/initrd"

timeout 120 qemu-system-aarch64 -M virt -cpu cortex-a53 -m 256 -nodefaults \
    -nographic -serial "file:$scratch/console" -kernel "$vm"/boot/vmlinuz-* \
    -initrd "$scratch/initrd" -append 'console=ttyAMA0 quiet panic=-1' \
    -no-reboot -chardev pty,id=line -device pci-serial,chardev=line \
    -chardev null,id=other -device pci-serial,chardev=other \
    > "$scratch/qemu" 2>&1 &
machine=$!
for _ in $(seq 50); do
    line=$(grep -o '/dev/pts/[0-9]*' "$scratch/qemu")
    [ -n "$line" ] && break
    sleep 0.1
done
make_cube /dev/none "$line" > "$scratch/out.cube"
"$INCODE" cube "$scratch/out.cube" > "$scratch/options"
nodes=
while read -r options; do
    # shellcheck disable=SC2086
    "$BUILD/"$options 2>> "$scratch/nodes" &
    nodes="$nodes $!"
done < "$scratch/options"
wait $machine
status=$?
# shellcheck disable=SC2086
kill $nodes 2> /dev/null
wait
check 'vm/it runs and powers off' "exit $status: $(last "$scratch/qemu")" \
    test $status = 0
tr -d '\r' < "$scratch/console" > "$scratch/said"
sed 's/^/# /' "$scratch/said"
"$INCODE" run "$disk/points.npy" -q --nodes 1 --stats "$scratch/stats.json"
check 'vm/over a real serial port: exit 0' "$(last "$scratch/said")" \
    grep -q '^line: exit 0' "$scratch/said"
check 'vm/over a real serial port: the digest' "$(last "$scratch/said")" \
    grep -qF "$(stat_of "$scratch/stats.json" digest)" "$scratch/said"
check 'vm/a port in use: exit 4' "$(last "$scratch/said")" \
    grep -q '^used: exit 4' "$scratch/said"
check 'vm/a port in use: by whom' "$(last "$scratch/said")" grep -qE \
    '^incode: /dev/ttyS1: in use by process [0-9]+ \((busybox|sleep)\); ' \
    "$scratch/said"
