#!/usr/bin/env bash
# The host program on a single-board computer with real serial ports: an arm64
# virtual machine with the distribution's kernel and unmodified libserialport,
# the nodes outside it, a line between them.  Loads 65 MB of packages for arm64
# the first time; then 40 seconds to build and 20 to run.
. tests/system/vm/vm.bash
need_vm vm incode

# --- the machine --------------------------------------------------------------

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
make_init <<'END'
echo "ports: $(ls /dev | grep ttyS | tr '\n' ' ')"
sleep 1000 < /dev/ttyS1 & # clock: it has the port for longer than the test
incode run /points.npy -q --cube /used.cube
echo "used: exit $?"
incode run /points.npy -q --cube /line.cube --stats /stats.json
echo "line: exit $?"
grep '"digest"' /stats.json
END
start_vm -chardev pty,id=line -device pci-serial,chardev=line \
    -chardev null,id=other -device pci-serial,chardev=other
for _ in $(seq 50); do
    line=$(grep -o '/dev/pts/[0-9]*' "$scratch/qemu")
    [ -n "$line" ] && break
    sleep 0.1 # clock: looks again
done
make_cube /dev/none "$line" > "$scratch/out.cube"
"$INCODE" cube "$scratch/out.cube" > "$scratch/options"
nodes=
while read -r options; do
    # shellcheck disable=SC2086
    "$BUILD/"$options 2>> "$scratch/nodes" &
    nodes="$nodes $!"
done < "$scratch/options"
end_vm vm
# shellcheck disable=SC2086
kill $nodes 2> /dev/null
wait
"$INCODE" run "$disk/points.npy" -q --nodes 1 --stats "$scratch/stats.json"
said 'vm/over a real serial port: exit 0' '^line: exit 0'
said 'vm/over a real serial port: the digest' \
    "\"digest\": \"$(stat_of "$scratch/stats.json" digest)\""
said 'vm/a port in use: exit 4' '^used: exit 4'
said 'vm/a port in use: by whom' \
    '^incode: /dev/ttyS1: in use by process [0-9]+ \((busybox|sleep)\); '
