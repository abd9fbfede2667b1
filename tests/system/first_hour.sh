#!/usr/bin/env bash
# What boards/FIRST-HOUR.md describes, as somebody does it who has four boards
# with nothing but their loaders, an adapter and a laptop: emulated boards, a
# port of the host's whose adapter can be pulled out, wires that can be pulled.
# first_hour.sh all: also what takes longer.
. tests/system/wires/boards.bash
with_faults
umask 077 # for keys
board=mps2-an500
need_boards first_hour $board
if [ ! -r "$BUILD/firmware/loader/$board.img" ]; then
    skip first_hour "there is no $BUILD/firmware/loader: make firmware"
    exit 0
fi
has_terminals first_hour || exit 0
took=$SECONDS
said=$scratch/said
image=$BUILD/firmware/$board.img
port=$scratch/ttyUSB0
points=$scratch/points.npy
make_points "$points" 2000
all=${1:-}
full() { [ "$all" = all ]; }
step() { echo "first_hour: $1 after $((SECONDS - took)) s"; }

# --- four boards, on, wired, and at the adapter --------------------------------

"$INCODE" emulate --empty --board $board --nodes 4 --open -o "$cube" \
    > "$scratch/emulate" 2> "$scratch/emulate.errors" &
emulator=$!
await test -s "$cube"
# wire FROM-TO: a relay that is a wire; its process in $wire.
wire() {
    await test -S "$cube.d/$1.socket"
    await test -S "$cube.d/${1#*-}-${1%-*}.socket"
    "$RELAY" uart baud=2000000 "$cube.d/$1.socket,$cube.d/${1#*-}-${1%-*}.socket" \
        > /dev/null &
    wire=$!
    wires+=("$wire")
}
wires=()
for pair in 0-1 0-2 2-3 1-3; do
    wire $pair
done
await test -S "$cube.d/host.socket"
"$BUILD/tests/adapter" "$port" "$cube.d/host.socket" &
adapter=$!
await test -e "$port"
lab=$scratch/own.cube
succeeds 'first_hour/a cube file' incode cube --new 4 --board $board \
    "--serial=$port" -o "$lab" > "$said"
succeeds 'first_hour/how it is wired' incode cube "$lab" > "$said"

# off NODE, on NODE: an emulated board stands still as one that is off; what it
# does first when it is on is to begin anew.
off() { kill -STOP "$(emulator_of "$1")"; }
on() {
    kill -CONT "$(emulator_of "$1")"
    reset_board "$1"
}

# has NAME PATTERN...: each is in what was said.
has() {
    local name=$1 pattern
    shift
    for pattern in "$@"; do
        check "first_hour/$name" "no '$pattern' in: $(tr '\n' '|' < "$said")" \
            grep -qE -e "$pattern" "$said"
    done
}
# nodes NAME RUNS COUNT [OPTION...]: so many of the nodes say that they run it,
# those that have just started again as soon as a busy machine lets them.
nodes() {
    local name=$1 runs=$2 count=$3 found
    shift 3
    [ $# -gt 0 ] || set -- --cube "$lab"
    await counted "$@"
    check "first_hour/$name" "$found: $(tr '\n' '|' < "$said")" \
        [ "$found" = "$count" ]
}
counted() { # OPTION...
    incode nodes "$@" > "$said" 2> "$errors"
    found=$(grep -E "^[0-9,-]+ +$board +$runs " "$said" |
        awk '{ n = split($1, part, ","); for (i = 1; i <= n; i++) {
            m = split(part[i], end, "-"); sum += end[m] - end[1] + 1 } }
            END { print sum + 0 }')
    [ "$found" = "$count" ]
}

nodes 'who is there' loader 4
has 'who is there: what next' \
    "bring one with: incode flash --cube $lab [^ ]*$board.img"
full && nodes 'who is there, without a cube file' loader 4 --port "$port"
step 'boards are there'

# --- what is not to be brought to them -------------------------------------------

succeeds 'first_hour/a key of its own' incode key --sign "$scratch/own.sign"
succeeds 'first_hour/signed with it' incode sign "$image" \
    --key "$scratch/own.sign" -o "$scratch/own.img"
refuses 'first_hour/a wrong key' 3 'signed with another key.*; ' \
    incode flash -q --cube "$lab" "$scratch/own.img"
refuses 'first_hour/an image of another board' 3 "mps2-an385.*; " \
    incode flash -q --cube "$lab" "$BUILD/firmware/mps2-an385.img"
if full; then
    head -c 100000 "$image" > "$scratch/part.img"
    refuses 'first_hour/half an image' 3 'part.img: .*; ' \
        incode flash -q --cube "$lab" "$scratch/part.img"
    refuses 'first_hour/no image' 3 'points.npy: .*; ' \
        incode flash -q --cube "$lab" "$points"
    # clock: they answer at once, and are waited for no longer than that.
    refuses 'first_hour/no program on them yet' 4 \
        'node 0.*loader.*; .*incode flash' incode run "$points" -q --cube "$lab" \
        --patience 3
fi
step 'refused'

# --- flash ------------------------------------------------------------------------

succeeds 'first_hour/flash' incode flash --cube "$lab" "$image" > "$said"
has 'flash' '0-3: run '
step 'flashed'
off 3
# clock: the others are there already.
refuses 'first_hour/flash again, a node is off' 4 '^incode: node 3: .*; ' \
    incode flash -q --cube "$lab" --patience 3 "$image"
nodes 'a node is off' program 3
has 'a node is off: which, and what next' '^3 .*no answer; '
on 3
succeeds 'first_hour/flash once more' incode flash --cube "$lab" "$image" \
    > "$said"
has 'flash once more' '0-3: had .* already'

# The console has the cube meanwhile: others look on, and touch nothing.
mkfifo "$scratch/lines"
"$INCODE" console --cube "$lab" < "$scratch/lines" > "$said" 2> "$errors" &
console=$!
exec 3> "$scratch/lines"
printf '%s\n' nodes links wires 'ping 0-3' >&3
await grep -q 'ANSWERED' "$said"
refuses 'first_hour/in use' 4 "in use by .*console.*, process $console of .*; " \
    incode flash -q --cube "$lab" "$image"
check 'first_hour/looked on' "$(last "$scratch/look.errors")" \
    incode console --cube "$lab" -c stat > "$scratch/look" \
    2> "$scratch/look.errors"
exec 3>&-
wait $console
status=$?
check 'first_hour/console' "$(last "$errors")" test $status = 0
has 'console' '2-----*3' '^ *host'
step 'all run it'

# --- runs -----------------------------------------------------------------------

# begin, ends NAME: a run that the host slows down, so that it is at work still
# when something befalls it, and what it must come to.
begin() {
    rm -f "$stats" "$scratch/out.npy"
    : > "$errors"
    # shellcheck disable=SC2086
    "$INCODE" run "$points" --verify --no-progress --cube "$lab" $patient \
        --strategy exchange --host-rate 8000 --host-rate-time 5 \
        --stats "$stats" -o "$scratch/out.npy" \
        > "$said" 2> "$errors" &
    host=$!
    await at_work
}
# It is at work, as somebody sees who looks on; or it has ended.
at_work() {
    if ! kill -0 "$host" 2> /dev/null; then
        return 0
    fi
    has_port && incode console --json --cube "$lab" -c stat > "$scratch/look" \
        2> "$scratch/look.errors" && [ "$(built)" -gt 100 ]
}
has_port() {
    local file
    for file in /proc/"$host"/fd/*; do
        [ "$file" -ef "$port" ] && return
    done
    return 1
}
built() { jq -s '[.[].nodes[]?.tetrahedra_built // 0] | add' "$scratch/look"; }
ends() {
    local status
    wait "$host"
    status=$?
    step "$1"
    sed 's/^/    /' "$errors"
    jq -c '{generations, nodes_lost, missing_wires, wall_s}' "$stats"
    check "first_hour/$1" "exit $status: $(tr '\n' '|' < "$errors")" \
        test $status = 0
    check "first_hour/$1: verified" "$(last "$said"); $(last "$errors")" \
        grep -q '; verified$' "$said"
    check "first_hour/$1: nobody is lost" "$(tail -n 3 "$errors")" \
        test "$(stat_of "$stats" nodes_lost)" = 0
    check "first_hour/$1: the same" 'not the digest of one node' \
        test "$(stat_of "$stats" digest)" = "$expected"
}

begin
kill "$wire" # between node 1 and node 3
ends 'a wire is pulled'
nodes 'a wire is pulled: all are there' program 4
has 'a wire is pulled: which' 'node [13].*node [13]|1-3|link 1'
wire 1-3

full || make_points "$points" 500 # enough for what befalls the others
begin
off 3
sleep 1 # clock: for so long at least
on 3
ends 'a node is turned off and on'

full && begin
kill -USR1 "$adapter"
await test ! -e "$port"
refuses 'first_hour/the adapter is out' 4 "ttyUSB0: .*; " \
    incode nodes --port "$port"
kill -USR1 "$adapter"
await test -e "$port"
full && ends 'the adapter was out'

# A full disk takes nothing: the run says so, and leaves nothing.
make_points "$points" 50
incode run "$points" --cube "$lab" --no-progress -q --stats /dev/full \
    2> "$errors"
status=$?
check 'first_hour/a full disk: the status' "$(last "$errors")" test $status = 3
check 'first_hour/a full disk' "$(tr '\n' '|' < "$errors")" \
    grep -qE '^incode: /dev/full: .*; ' "$errors" # beside who is late
nodes 'all is well' program 4

kill "$adapter" "${wires[@]}" 2> /dev/null # one was pulled
end_boards first_hour
step 'done'

