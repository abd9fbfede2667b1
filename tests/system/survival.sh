#!/usr/bin/env bash
# Nodes that are killed and stopped in mid-run, and nodes that cannot live: the
# digest is that of the undisturbed run, or the run ends with status 4 and
# leaves nothing.
. tests/system/lib.sh
with_faults

points=$scratch/points.npy
"$INCODE" gen uniform "${CLUSTER_POINTS:-100000}" --seed 2 -o "$points" 2> /dev/null
"$INCODE" run "$points" -q --strategy sequential --nodes 1 \
    --stats "$scratch/first.json" 2> "$scratch/errors"
digest=$(stat_of "$scratch/first.json" digest)
tetrahedra=$(stat_of "$scratch/first.json" tetrahedra)

# start [OPTION...]: a run on 8 nodes in the background, $host its process.
# slowed SECONDS [OPTION...]: one whose host reads slowly for so long.
start() {
    rm -f "$scratch/out.npy" "$scratch/stats.json"
    "$INCODE" run "$points" --progress --nodes 8 -o "$scratch/out.npy" \
        --stats "$scratch/stats.json" "$@" > /dev/null 2> "$scratch/errors" &
    host=$!
}

slowed() {
    if [ "$1" = 0 ]; then
        start "${@:2}"
    else
        start --host-rate 100000 --host-rate-time "$@"
    fi
}

# The process of node I, once it is there.
node_of() {
    local found=
    await look_for "$1"
    echo "$found"
}
look_for() {
    local pid words
    for pid in $(pgrep -P $host -x incode-node); do
        { words=$(tr '\0' ' ' < "/proc/$pid/cmdline"); } 2> /dev/null
        case $words in *"--node $1 "*) found=$pid; return ;; esac
    done
    ! kill -0 $host 2> /dev/null
}

# Until progress shows tetrahedra: all nodes are up and at work.
at_work() {
    await shows_work && kill -0 $host 2> /dev/null
}

# strike SIGNAL NODE: false where the run is over already.
strike() {
    local pid
    pid=$(node_of "$2")
    [ -n "$pid" ] && kill "-$1" "$pid" 2> /dev/null
}

plausible() {
    jq -e ".tetrahedra == $tetrahedra and .duplication_factor >= 1 and
        .make_tetra_calls >= .tetrahedra" "$scratch/stats.json" > "$scratch/said"
}

# survives NAME: the run in the background ends well, its digest is right, and
# its statistics know of what was done twice.
restarts=0
survives() {
    local status found
    wait $host
    status=$?
    if [ $status != 0 ]; then
        fail "survival/$1" "exit $status: $(last "$scratch/errors")"
        return
    fi
    found=$(stat_of "$scratch/stats.json" digest)
    if [ "$found" != "$digest" ]; then
        fail "survival/$1" "digest $found, not $digest"
    else
        restarts=$((restarts + $(stat_of "$scratch/stats.json" node_restarts)))
        check "survival/$1" 'the statistics cannot be' plausible
    fi
}

# --- kill -9 -----------------------------------------------------------------

# clock: where in the run a signal strikes is left to chance, in what follows.
for strategy in spatial sequential; do
    for node in 0 1 2 3 4 5 6 7; do
        at_first=0 amid "node_of 7 > '$scratch/said'; sleep 0.0$((node + 2))
            strike KILL $node" --strategy $strategy
        survives "kill -9 of node $node, $strategy"
    done
    for node in 0 5; do
        amid "sleep 0.3; strike KILL $node" --strategy $strategy --index grid
        survives "kill -9 of node $node, $strategy, grid"
    done
done
check 'survival/they were killed in mid-run' "$restarts starts in 20 runs" \
    test $restarts -ge 15

# clock: somewhere in the run
for strategy in master-slaves hybrid; do
    for node in 0 1 6; do
        amid "sleep 0.1; strike KILL $node" --strategy $strategy
        survives "kill -9 of node $node, $strategy"
    done
done

start --strategy spatial
for node in 0 3 3 6 0; do strike KILL $node; done
survives 'five kills during bring-up'
start --strategy spatial
for node in 1 0 4 1; do
    sleep 0.1 # clock: as all that follow, somewhere in the run
    strike KILL $node
done
survives 'four kills, one after the other'
start --strategy spatial --face-rule paper
sleep 0.1
for node in 2 7; do strike KILL $node; done
survives 'two nodes at once, face rule paper'
for delay in 0.25 0.3 0.35 0.4; do
    start --strategy spatial
    sleep $delay
    strike KILL $((RANDOM % 8))
    survives "a kill after $delay s, towards the end"
done

# --- kill -STOP --------------------------------------------------------------

# clock: each is stopped for half a second at least.
for strategy in spatial sequential; do
    amid 'strike STOP 0; sleep 0.5; strike STOP 6' --strategy $strategy
    strike CONT 0
    sleep 0.5
    strike CONT 6
    survives "kill -STOP and -CONT, $strategy"
    check "survival/nobody was started again, $strategy" \
        'a stopped node was given up' test \
        "$(stat_of "$scratch/stats.json" node_restarts)" = 0
done
# clock: until they are given up.  Nodes that are stopped before they answer for
# the first time end the run: those here have begun to work.
amid 'at_work && strike STOP 0 && strike STOP 5' --strategy spatial \
    --patience 3
survives 'two nodes stopped for longer than --patience'
check 'survival/they were started again' 'not both' test \
    "$(stat_of "$scratch/stats.json" node_restarts)" -ge 2

# --- it cannot go on ---------------------------------------------------------

# hopeless NAME PROGRAM: exit 4 soon, node and link named, no output left.
hopeless() {
    local began=$SECONDS # clock: minutes
    # shellcheck disable=SC2086
    refuses "survival/$1" 4 '^incode: node [0-7] link [0-3]: ' \
        incode run "$points" -q --nodes 8 $patient --node-program "$2" \
        -o "$scratch/left/out.npy"
    check "survival/$1: soon" "$((SECONDS - began)) s" \
        test $((SECONDS - began)) -le $soon
}
hopeless 'a node program that ends at once' /bin/false
printf '#!/bin/sh\nkill -SEGV $$\n' > "$scratch/dies"
printf '#!/bin/sh\nexec sleep 600\n' > "$scratch/mute"
chmod +x "$scratch/dies" "$scratch/mute"
hopeless 'a node program that a signal ends' "$scratch/dies"
hopeless 'a node program that says nothing' "$scratch/mute"
cat > "$scratch/one.cube" <<-END
	dimension = 0;
	start = [0];
	links = ( { node = 0; to = "host"; unix = "one.socket"; } );
END
refuses 'survival/a node of a cube file that a signal ends' 4 \
    '^incode: node 0 link 0: ended 3 times, the last by signal 11 ' \
    incode run "$points" -q --cube "$scratch/one.cube" \
    --node-program "$scratch/dies" -o "$scratch/left/out.npy"

# A node that is killed whenever it comes up, which clock: takes its time; the host reads slowly, so that the
# run does not end before.
start --strategy spatial --host-rate 100000
while kill -0 $host 2> /dev/null; do strike KILL 3; done
wait $host
status=$?
check 'survival/a node killed for ever: exit 4, named' \
    "exit $status: $(last "$scratch/errors")" \
    test $status = 4 -a -n "$(grep '^incode: node 3 link 1: ' "$scratch/errors")"
check 'survival/a node killed for ever: no output' 'it left one' \
    test ! -e "$scratch/out.npy"
