#!/usr/bin/env bash
# Boards beside a single-board computer: a virtual machine, whose GPIO chip and
# serial ports are as real ones to its kernel, to libgpiod and libserialport.
# Outside it, where a line falls back, an emulated board's reset button is
# pressed, and each serial port is joined to a board's UART 0.  The machine takes
# 20 s, or as long as others leave it.
. tests/system/vm/vm.bash
for program in qemu-system-arm qemu-system-aarch64; do
    if ! command -v $program > /dev/null; then
        skip lines "$program is not there: make deps-full"
        exit 0
    fi
done
"${MAKE:-make}" --no-print-directory -j "$(nproc)" BUILD="$BUILD" \
    "$BUILD/firmware/mps2-an500.img" "$BUILD/firmware/loader/mps2-an500.img" \
    "$BUILD/tests/reset" > "$scratch/said" 2>&1
status=$?
check 'lines: the firmware' "$(last "$scratch/said")" [ $status = 0 ]
need_vm lines incode tests/pulse

# --- what the machine does ----------------------------------------------------

"$INCODE" gen uniform 100 --seed 5 -o "$disk/points.npy" 2> /dev/null
# The label is the device tree's; line 1 pulls low, and nothing else.
make_cube() { # RESET-OF-0
    cat <<-END
		dimension = 1;
		board = "mps2-an500";
		nodes = (
		    { node = 0; reset = $1; },
		    { node = 1; reset = { chip = "gpiochip0"; line = 2; };
		                boot = { chip = "/dev/gpiochip0"; line = 5; }; }
		);
		links = (
		    { node = 0; to = "host"; serial = ["uart0", "/dev/ttyS0"]; },
		    { node = 1; to = "host"; serial = ["uart0", "/dev/ttyS1"]; }
		);
	END
}
pin='chip = "9030000.pl061"; active_low = true; open_drain = true;'
make_cube "{ $pin line = 1; }" > "$disk/lab.cube"
make_cube "{ $pin line = 8; }" > "$disk/beyond.cube"
make_cube "{ $pin line = \"RESET0\"; }" > "$disk/nameless.cube"
make_cube '{ chip = "9030000.pl061"; line = 2; }' > "$disk/twice.cube"
make_cube '{ chip = "gpiochip7"; line = 1; }' > "$disk/chipless.cube"
# DTR of a port that leads nowhere else.
cat > "$disk/dtr.cube" <<-END
	dimension = 0;
	links = ( { node = 0; to = "host"; serial = ["uart0", "/dev/ttyS2"];
	            dtr = "reset"; } );
END
cp "$BUILD/firmware/mps2-an500.img" "$disk/image"
make_init <<'END'
mount -t debugfs debug /sys/kernel/debug
for cube in beyond nameless twice chipless; do
    pulse /$cube.cube 0
    echo "$cube: exit $?"
done

# Both boards are heard, and each reset before the next.
cat /dev/ttyS0 > /said0 &
cat /dev/ttyS1 > /said1 &
starts() { tr -d '\0\377' < /said$1 | grep -ac 'after reset from outside'; }
heard() { # NODE COUNT WHAT
    for _ in $(seq 300); do
        [ $(starts $1) -gt $2 ] && echo "$3: node $1 starts" && return
        sleep 0.1 # clock: looks again
    done
}
sleep 0.2
pulse /lab.cube 0
echo "reset: exit $?"
heard 0 0 reset
pulse /lab.cube 1 stay
echo "stay: exit $?"
heard 1 0 stay
# In the midst of one; what the last leaves active, the next command releases.
for signal in TERM HUP KILL; do
    before=$(starts 1)
    pulse /lab.cube 1 stay &
    until grep -q 'incode.*out hi' /sys/kernel/debug/gpio; do :; done
    kill -$signal $!
    wait $!
    echo "$signal: exit $?"
    [ $signal != KILL ] || pulse /lab.cube 0
    heard 1 $before $signal
done
before=$(starts 1)
pulse /dtr.cube 0
echo "DTR: exit $?"
heard 1 $before DTR
kill %1 %2
wait

# One that answers is told by its wire.
echo 'reset 0' | incode console --cube /lab.cube
echo "console: exit $?"
incode flash -q --cube /lab.cube /image
echo "flash: exit $?"
incode flash -q --reset --nodes 1 --cube /lab.cube /image
echo "flash --reset: exit $?"
incode run /points.npy -q --cube /lab.cube --stats /stats.json
echo "run: exit $?"
grep '"digest"' /stats.json
incode nodes --cube /lab.cube
echo "nodes: exit $?"
END

# --- and what is outside it ---------------------------------------------------

"$INCODE" emulate --board mps2-an500 --nodes 2 --empty \
    -o "$scratch/lab.cube" \
    2> "$scratch/emulate" &
emulator=$!
await test -s "$scratch/lab.cube"
boards=$scratch/lab.cube.d
mkfifo "$scratch/lines"

# follow: "LINE up|down BOOT-LINE" for each change of lines 1, 2 and 5, by what
# the chip drives: line 1 is up while it pulls low.  "dtr up|down" for each
# change of a port's DTR while RTS is up, as it is while the port is open.
press() { "$BUILD/tests/reset" "$boards/qmp$1.socket"; }
follow() {
    local line part driven high low was=0 now dtr=0
    while read -r line; do
        if [[ $line =~ addr\ 0x04\ val\ (0x[0-9a-f]+) ]]; then
            now=$((BASH_REMATCH[1]))
            if ((now & 2 && (now & 1) != dtr)); then
                dtr=$((now & 1))
                if ((dtr)); then
                    echo 'dtr up'
                else
                    echo 'dtr down'
                    press 1
                fi
            fi
        elif [[ $line =~ GPIODIR\ (0x[0-9a-f]+)\ GPIODATA\ (0x[0-9a-f]+) ]]
        then
            driven=$((BASH_REMATCH[1])) high=$((driven & BASH_REMATCH[2]))
            low=$((driven & ~high))
            now=$(((low & 2) | (high & 0x24)))
            for part in 1 2 5; do
                if ! (((now ^ was) & 1 << part)); then
                    continue
                elif ((now & 1 << part)); then
                    echo "$part up $((now >> 5 & 1))"
                else
                    echo "$part down $((now >> 5 & 1))"
                    [ $part = 5 ] || press $((part - 1))
                fi
            done
            was=$now
        fi
    done
}
grep --line-buffered -E 'pl061_update|serial_write.* addr 0x04 ' \
    < "$scratch/lines" | follow > "$scratch/followed" &
follower=$!
start_vm -trace enable=pl061_update \
    -trace "enable=serial_write,file=$scratch/lines" \
    -chardev "socket,path=$boards/host.socket,id=uart0" \
    -device pci-serial,chardev=uart0 \
    -chardev "socket,path=$boards/console1.socket,id=uart1" \
    -device pci-serial,chardev=uart1 \
    -chardev null,id=nobody -device pci-serial,chardev=nobody
end_vm lines
wait $follower
sed 's/^/# /' "$scratch/followed"

# --- what came of it ----------------------------------------------------------

said 'lines/a line that the chip has not: exit 3' '^beyond: exit 3'
said 'lines/a line that the chip has not: which there are' \
    '^incode: /beyond.cube:4: .*: gpiochip0 has no line 8; give one of 0 to 7'
said 'lines/a name that the chip has not' \
    '^incode: /nameless.cube:4: .*: gpiochip0 has no line "RESET0"; '
said 'lines/a line by two names: exit 4' '^twice: exit 4'
said 'lines/a line by two names: by whom it is used' \
    '^incode: /twice.cube:5: .*: line 2 of gpiochip0: in use by incode; '
said 'lines/no such chip: which there are' \
    '^incode: /chipless.cube:4: .*; give one of gpiochip0 \(9030000.pl061\)$'
said 'lines/a reset' '^reset: exit 0'
said 'lines/a reset: the board starts' '^reset: node 0 starts'
said 'lines/a reset with a boot line' '^stay: exit 0'
said 'lines/a reset with a boot line: the board starts' '^stay: node 1 starts'
for signal in TERM=143 HUP=129 KILL=137; do
    said "lines/SIG${signal%=*} amid a reset" "^${signal%=*}: exit ${signal#*=}"
    said "lines/SIG${signal%=*} amid a reset: the board starts" \
        "^${signal%=*}: node 1 starts"
done
said 'lines/DTR' '^DTR: exit 0'
said 'lines/DTR: the board starts' '^DTR: node 1 starts'
check 'lines/DTR: lowered, raised for the reset, lowered' \
    "$(grep dtr "$scratch/followed" | tr '\n' ' ')" grep -q \
    'dtr down dtr up dtr down ' <(grep dtr "$scratch/followed" | tr '\n' ' ')
said 'lines/reset in the console: exit 0' '^console: exit 0'
said 'lines/reset in the console' '^0 +begun anew'
said 'lines/empty boards are flashed' '^flash: exit 0'
said 'lines/a reset to be flashed' '^flash --reset: exit 0'
# In their order: both of node 1 each time.
{
    printf '%s 0\n' '1 up' '1 down'
    for _ in 1 2 3 4; do
        printf '%s\n' '5 up 1' '2 up 1' '2 down 1' '5 down 0'
    done
    printf '%s 0\n' '1 up' '1 down'
    printf '%s\n' '5 up 1' '2 up 1' '2 down 1' '5 down 0'
} > "$scratch/expected"
check 'lines/active in turn, and never at the end' \
    "$(diff <(grep -v dtr "$scratch/followed") "$scratch/expected" | head -n 1)" \
    cmp -s <(grep -v dtr "$scratch/followed") "$scratch/expected"
"$INCODE" run "$disk/points.npy" -q --nodes 1 --stats "$scratch/stats.json"
said 'lines/a run over both ports: exit 0' '^run: exit 0'
said 'lines/a run over both ports: the digest' \
    "\"digest\": \"$(stat_of "$scratch/stats.json" digest)\""
said 'lines/incode nodes' '^nodes: exit 0'
kill -INT "$emulator"
wait "$emulator"
