#!/usr/bin/env bash
# Bare boards, emulated: cubes of them triangulate as processes do, whatever
# happens to a board in mid-run; they stay for run after run, and share a cube
# with processes.
. tests/system/lib.sh
with_faults

need_boards boards mps2-an500
need_boards boards icicle

points=$scratch/points.npy
"$INCODE" gen uniform 500 --seed 1 -o "$points" 2> /dev/null
"$INCODE" run "$points" -q --nodes 1 -o "$scratch/first.npy" \
    --stats "$scratch/native.json"
expected=$(stat_of "$scratch/native.json" digest)
errors=$scratch/errors
stats=$scratch/stats.json

# computes NAME OPTION...: a run on these nodes, with the right digest.
computes() {
    local name=$1 status
    shift
    rm -f "$stats"
    # shellcheck disable=SC2086
    incode run "$points" --no-progress --strategy spatial --stats "$stats" \
        $patient "$@" > "$scratch/said" 2> "$errors"
    status=$?
    if [ $status != 0 ]; then
        fail "$name" "exit $status: $(last "$errors")"
    else
        check "$name" "digest $(stat_of "$stats" digest), not $expected" \
            [ "$(stat_of "$stats" digest)" = "$expected" ]
    fi
}

# tells NAME FILTER: the statistics of the last run are so.
tells() {
    check "$1" "not so: $2: $(jq -c . "$stats" 2>&1)" holds "$2"
}
holds() { jq -e "$1" "$stats" > "$scratch/told" 2>&1; }

# --- each board ---------------------------------------------------------------

# deepest BOARD: bytes of stack that its calls take at the most.
deepest() {
    tests/stack "$1" | sed -n 's/.*: bare_main takes \([0-9]*\) of .*/\1/p'
}

for board in mps2-an500 mps2-an385 icicle; do
    most=$(deepest $board)
    computes "boards/$board" --board $board --nodes 4 --verify \
        -o "$scratch/out.npy"
    check "boards/$board: the same bytes" 'the output differs' \
        cmp -s "$scratch/first.npy" "$scratch/out.npy"
    check "boards/$board: nothing to warn of" "$(last "$errors")" \
        [ ! -s "$errors" ]
    tells "boards/$board: statistics" ".board == \"$board\" and \
.link == \"uart\" and .nodes == 4 and .memory_bytes == 4194304 and .verified"
    tells "boards/$board: memory of each node" '[.per_node[] | select(
        .stack_bytes == 49152 and .stack_high_water_bytes > 1000 and
        .stack_high_water_bytes <= '"${most:-0}"' and .overruns == 0 and
        .look_us_max > 0 and ([.memory_map[]] | add) == 4194304)] |
        length == 4'
done
# A cube of two, and the least.
computes 'boards/one' --board mps2-an500 --nodes 1

# A board of two UARTs, whose flash is a part of its card.
computes 'boards/raspi3b' --board raspi3b --nodes 2 --verify
computes 'boards/raspi3b: reset' --board raspi3b --nodes 2 --board-reset 200
# RISC-V: the most nodes, and a reset.
computes 'boards/icicle: 16 nodes' --board icicle --nodes 16
computes 'boards/icicle: reset' --board icicle --nodes 2 --board-reset 400

# --- what happens in mid-run ----------------------------------------------------

computes 'boards/stopped' --board mps2-an500 --nodes 2 --board-stop 400
tells 'boards/stopped: costs time alone' '.generations == 1 and
    .node_restarts == 0 and .nodes_lost == 0'
# The others once the nodes are at work, however long that takes here.
begun=$(jq '.time_start_up_s * 1000 | floor' "$stats")
computes 'boards/reset' --board mps2-an500 --nodes 2 \
    --board-reset $((begun + 300))
tells 'boards/reset: is noticed' '.generations > 1 and .node_restarts == 0'
computes 'boards/killed' --board mps2-an500 --nodes 2 \
    --board-kill $((begun + 500))
tells 'boards/killed: is started again' '.generations > 1 and
    .node_restarts > 0 and .nodes_lost == 0'

# --- what is refused ------------------------------------------------------------

# refuses_run NAME STATUS PATTERN OPTION...
refuses_run() {
    refuses "boards/$1" "$2" "$3" incode run "$points" \
        -o "$scratch/left/out.npy" "${@:4}"
}
refuses_run 'too many nodes' 2 '^incode: --nodes 32: .*; give 16 or fewer' \
    --board mps2-an500 --nodes 32
refuses_run 'more memory' 2 '^incode: --memory: mps2-an385 has 4M' \
    --board mps2-an385 --memory 8M
refuses_run 'another link' 2 '^incode: --link: ' \
    --board mps2-an500 --link serial
refuses 'boards/no emulator' 4 "^incode: qemu-system-arm: not found .*; \
install it with: apt-get install qemu-system-arm$" within env PATH="$scratch" \
    "$(realpath "$INCODE")" run "$points" -q --board mps2-an500 --nodes 2
refuses 'boards/emulate: no emulator' 4 '^incode: qemu-system-arm: not found' \
    within env PATH="$scratch" "$(realpath "$INCODE")" emulate \
    --board mps2-an500 --nodes 2 -o "$scratch/none.cube"
check 'boards/emulate: no emulator, and nothing left' \
    "$scratch/none.cube.d" [ ! -e "$scratch/none.cube.d" ]
echo 'dimension = 1;' > "$scratch/own.cube"
refuses 'boards/emulate: a file of the user' 3 'own.cube: not a file that' \
    incode emulate --board mps2-an500 --nodes 2 -o "$scratch/own.cube"
mkdir "$scratch/bin"
cp "$INCODE" "$scratch/bin/incode"
refuses 'boards/no firmware' 4 "mps2-an500.img: .*; make the board's firmware \
with: make firmware$" within "$scratch/bin/incode" run "$points" \
    -q --board mps2-an500 --nodes 2
# An emulator that cannot: what it says is told, and the run ends.
printf '#!/bin/sh\necho "qemu: no such board" >&2\nexit 1\n' \
    > "$scratch/bin/qemu-system-arm"
chmod +x "$scratch/bin/qemu-system-arm"
PATH=$scratch/bin:$PATH incode run "$points" --no-progress --board mps2-an500 \
    --nodes 2 > /dev/null 2> "$errors"
status=$?
check 'boards/an emulator that ends: exit 4' "exit $status" [ $status = 4 ]
check 'boards/an emulator that ends: says why' "$(last "$errors")" \
    grep -q '^incode: qemu: no such board' "$errors"
# Half an image: the emulator's registers do not hide what it says, and the image
# is named.
mkdir -p "$scratch/bin/firmware/loader"
half() { # FILE: but for the other, which is whole
    cp "$BUILD/firmware/mps2-an500.img" "$scratch/bin/firmware/"
    cp "$BUILD/firmware/loader/mps2-an500.img" "$scratch/bin/firmware/loader/"
    head -c 20000 "$BUILD/firmware/$1" > "$scratch/bin/firmware/$1"
}
half mps2-an500.img
refuses 'boards/half an image' 4 "mps2-an500.img: not a board's image, or not \
all of it; make it with: make firmware$" within "$scratch/bin/incode" run \
    "$points" -q --board mps2-an500 --nodes 2
half loader/mps2-an500.img
within "$scratch/bin/incode" run "$points" --no-progress --board mps2-an500 \
    --nodes 2 > /dev/null 2> "$errors"
status=$?
check 'boards/half a loader: exit 4' "exit $status" [ $status = 4 ]
check 'boards/half a loader: is named' "$(last "$errors")" \
    grep -q '^incode: qemu: fatal: .*loader/mps2-an500.img whole?' "$errors"

# What a board says of a fault is told while the run goes on.
cat > "$scratch/bin/qemu-system-arm" << 'END'
#!/bin/bash
for word; do
    case $word in
    *,id=uart0,*logfile=*)
        log=${word#*logfile=}
        printf '\0\377incode: mps2-an500: a test; restarting\r\n pc 0x1\r\n\0' \
            >> "${log%%,*}"
        ;;
    esac
done
PATH=${PATH#*:} exec qemu-system-arm "$@"
END
PATH=$scratch/bin:$PATH computes 'boards/a fault' --board mps2-an500 --nodes 2
check 'boards/a fault: is told' "$(last "$errors")" grep -q "^incode: node 1 \
(mps2-an500): its report of a fault: a test, pc 0x1; it starts again$" "$errors"

# --- boards that stay -----------------------------------------------------------

cube=$scratch/lab.cube
# emulate OPTION...: in the background, $emulator, until its file is there.
emulate() {
    "$INCODE" emulate --board mps2-an500 --nodes 4 -o "$cube" "$@" \
        > "$scratch/emulate" 2> "$scratch/emulate.errors" &
    emulator=$!
    await test -s "$cube"
}
end_emulator() { # NAME
    kill -INT $emulator
    wait $emulator
    status=$?
    check "boards/$1: ends" "exit $status: $(last "$scratch/emulate.errors")" \
        [ $status = 0 ]
    check "boards/$1: removes its file and sockets" "$(find "$cube"*)" \
        [ ! -e "$cube" -a -z "$(find "$cube.d" -type s)" ]
}
boots() { # NODE: how often it was started, as its console says
    tr '\0' '\n' < "$cube.d/console$1.log" | grep -a -o 'boot [0-9]*' |
        tail -n 1 | cut -c 6-
}

has_booted() { [ -n "$(boots "$1")" ]; }

emulate
computes 'boards/emulate: a run' --cube "$cube"
tells 'boards/emulate: statistics' '.board == "mps2-an500" and .link == "uart"'
refuses 'boards/emulate: twice' 3 'another incode emulate has its boards' \
    incode emulate --board mps2-an500 --nodes 4 -o "$cube"
refuses 'boards/emulate: no name' 2 'emulate: --board, --nodes or -o FILE is' \
    incode emulate --board mps2-an500 --nodes 4 -o ''
full_disk() { ( # whose files end at 1 MB
    trap '' XFSZ
    ulimit -f 1024
    "$INCODE" emulate --board mps2-an500 --nodes 2 -o "$scratch/full.cube"
); }
refuses 'boards/emulate: a full disk' 3 'flash0: cannot be written' full_disk
check 'boards/emulate: a full disk is left' "$(ls "$scratch/full.cube.d")" \
    [ -z "$(ls "$scratch/full.cube.d")" ]
# A person at the console of a node that computes over other wires.
ask() { "$BUILD/tests/ask" "$cube.d/console3.socket" "$1"; } # WORD
asks() { # NAME WORD PATTERN
    ask "$2" > "$scratch/said"
    check "boards/console: $1" "$(tr '\n' '|' < "$scratch/said")" \
        grep -qE "$3" "$scratch/said"
}
asks 'who' who '^incode: mps2-an500: program, version .*, image [0-9a-f]{16},'
asks 'memory' memory '^of the stack at most [0-9]+ in use so far'
asks 'fault' fault '^started after '
asks 'Enter alone' '' '^node 3 of 4, |^no neighbour has said yet'
is_up() {
    ask links > "$scratch/links"
    grep -q '^UART 1, node 2: up, frames in' "$scratch/links" ||
        ! kill -0 $host 2> /dev/null
}
# shellcheck disable=SC2086
incode run "$points" -q --cube "$cube" --strategy spatial $patient \
    --stats "$stats" 2> "$errors" &
host=$!
await is_up
wait $host
status=$?
check 'boards/console: in mid-run' "exit $status: $(last "$errors")" \
    [ "$(stat_of "$stats" digest)" = "$expected" ]
check 'boards/console: links' "$(tr '\n' '|' < "$scratch/links")" \
    grep -q '^UART 1, node 2: up, frames in' "$scratch/links"
# A board loses its power.
pkill -KILL -o -P $emulator
await grep -q 'started again' "$scratch/emulate.errors"
check 'boards/emulate: starts a board again' \
    "$(last "$scratch/emulate.errors")" \
    grep -q 'started again' "$scratch/emulate.errors"
computes 'boards/emulate: another' --cube "$cube"
before=$(boots 3)
end_emulator emulate
emulate --linux 2
await has_booted 3
check 'boards/emulate: off and on' "boot $(boots 3) after $before" \
    [ "$(boots 3)" -gt "$before" ]
computes 'boards/emulate: with a process' --cube "$cube"
tells 'boards/emulate: with a process, statistics' \
    '.board == "mixed" and .link == "uart"'
end_emulator 'emulate with a process'

# A cube file by hand, and what it says of a board.
emulate --linux 1,3
sed 's/^start = .*/start = [1, 3];/' "$cube" > "$scratch/mine.cube"
sed -i "s,lab.cube.d,$cube.d," "$scratch/mine.cube"
"$INCODE" cube "$scratch/mine.cube" > "$scratch/said" 2> "$errors"
check 'boards/cube: what is to be done' "$(cat "$scratch/said" "$errors")" \
    grep -q '^# node 2 (mps2-an500): put its firmware on it' "$scratch/said"
check 'boards/cube: what is to be started' "$(cat "$scratch/said" "$errors")" \
    grep -q '^incode-node --node 3 .*--serial-baud 115200 ' "$scratch/said"
computes 'boards/mixed' --cube "$scratch/mine.cube"
tells 'boards/mixed: statistics' '.board == "mixed" and .link == "mixed"'
end_emulator mixed
