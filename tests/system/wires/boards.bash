# shellcheck shell=bash
# Emulated boards whose wires lead through the relay.  Sourced in the place of
# lib.sh, which it sources.
. tests/system/lib.sh

RELAY=${RELAY:-$BUILD/tests/relay}
cube=$scratch/lab.cube
errors=$scratch/errors
stats=$scratch/stats.json

# make_points FILE N: and $expected, the digest of their triangulation.
make_points() {
    "$INCODE" gen uniform "$2" --seed 1 -o "$1" 2> /dev/null
    "$INCODE" run "$1" -q --nodes 1 --stats "$scratch/native.json"
    expected=$(stat_of "$scratch/native.json" digest)
}

# --- the boards -----------------------------------------------------------------

# emulate BOARD NODES OPTION...: boards that are not joined; $emulator.
emulate() {
    nodes=$2
    "$INCODE" emulate --board "$1" --nodes "$2" --open "${@:3}" -o "$cube" \
        > "$scratch/emulate" 2> "$scratch/emulate.errors" &
    emulator=$!
    await test -s "$cube"
    sed -i 's,/host.socket,/relay.socket,' "$cube"
}
end_boards() { # NAME
    local status
    kill -INT "$emulator"
    wait "$emulator"
    status=$?
    check "$1/the boards end" "exit $status: $(last "$scratch/emulate.errors")" \
        [ $status = 0 ]
}

# join BAUD SETTING...: the relay between them, and before the host.
join() {
    local node other bit wires="@$cube.d/relay.socket,$cube.d/host.socket"
    for ((node = 0; node < nodes; node++)); do
        for ((bit = 1; bit < nodes; bit *= 2)); do
            other=$((node | bit))
            [ $other = $node ] ||
                wires="$wires $cube.d/$node-$other.socket,$cube.d/$other-$node.socket"
        done
    done
    # shellcheck disable=SC2086
    "$RELAY" uart "baud=$1" "${@:2}" $wires > "$scratch/relay" &
    relay=$!
    await test -S "$cube.d/relay.socket"
}
part() {
    kill "$relay"
    wait "$relay"
}
# suffered NAME PATTERN: what the relay that has ended did to the wires.
suffered() {
    check "$1: it was bad" "$(cat "$scratch/relay")" grep -qE \
        "$2" "$scratch/relay"
}

# The emulator of a board: it has opened the board's console.
emulator_of() {
    local pid
    for pid in $(pgrep -P "$emulator"); do
        { tr '\0' '\n' < "/proc/$pid/cmdline"; } 2> /dev/null |
            grep -q "/qmp$1.socket" &&
            echo "$pid"
    done
}
reset_board() { "$BUILD/tests/reset" "$cube.d/qmp$1.socket"; }
kill_board() { kill -KILL "$(emulator_of "$1")"; }
stop_board() { # NODE SECONDS; clock: for so long at least
    local pid
    pid=$(emulator_of "$1")
    kill -STOP "$pid"
    sleep "$2"
    kill -CONT "$pid"
}

# --- runs -----------------------------------------------------------------------

# How far a run is, whatever the machine's speed: what the wires have carried.
carried() { sed -n 's/^rchar: //p' "/proc/$relay/io"; }
has_carried() { # BYTES
    [ "$(carried)" -ge "$1" ] || ! kill -0 "$host" 2> /dev/null
}

# computes NAME OPTIONS [TROUBLE...]: a run with these options, and what is done
# once the wires have carried $later bytes for it, of some 80,000 for 500 points
# on two nodes.
later=30000
computes() {
    local name=$1 options=$2 status took=$SECONDS before
    shift 2
    rm -f "$stats"
    before=$(carried)
    # shellcheck disable=SC2086
    within "$INCODE" run "$points" -q --cube "$cube" --stats "$stats" \
        $options > "$scratch/said" 2> "$errors" &
    host=$!
    if [ $# -gt 0 ]; then
        await has_carried $((before + later))
        "$@"
    fi
    wait $host
    status=$?
    echo "$name: $((SECONDS - took)) s; $(tr '\n' ' ' < "$errors")"
    if [ $status != 0 ]; then
        fail "$name" "exit $status: $(last "$errors")"
        return
    fi
    check "$name" "digest $(stat_of "$stats" digest), not $expected" \
        test "$(stat_of "$stats" digest)" = "$expected"
    check "$name: no node is lost" "$(stat_of "$stats" nodes_lost) are" \
        test "$(stat_of "$stats" nodes_lost)" = 0
}

# tells NAME FILTER: the statistics of the last run are so.
tells() {
    check "$1" "not so: $2: $(jq -c . "$stats" 2>&1)" holds "$2"
}
holds() { jq -e "$1" "$stats" > "$scratch/told" 2>&1; }
