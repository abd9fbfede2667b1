#!/usr/bin/env bash
# Nodes as ranks of Open MPI: started by incode, by mpirun, with a hostfile, with
# a wrong number of ranks, and with a rank that is lost.
. tests/system/lib.sh
with_faults

need() { command -v "$1" > /dev/null || { skip mpi "there is no $1"; exit 0; }; }
need mpirun
if nm "$BUILD/incode-mpi" 2> /dev/null | grep -q __asan_init; then
    export ASAN_OPTIONS=detect_leaks=0
    skip mpi/leaks 'Open MPI leaks by itself'
fi
# Ranks that start here have a directory of their own to clean up.
export TMPDIR=$scratch/tmp
mkdir "$TMPDIR"
root=
[ "$(id -u)" = 0 ] && root=--allow-run-as-root
# mpirun as a user calls it
by_hand() { within mpirun $root "$@"; }

points=$scratch/points.npy
"$INCODE" gen uniform 20000 --seed 2 -o "$points" 2> /dev/null
"$INCODE" run "$points" -q --nodes 1 -o "$scratch/first.npy"

# --- the same result ----------------------------------------------------------

for nodes in 1 2 8; do
    for strategy in sequential spatial; do
        name="mpi/$strategy on $nodes"
        rm -f "$scratch/out.npy"
        incode run "$points" -q --link mpi --nodes $nodes \
            --strategy $strategy --stats "$scratch/stats.json" \
            -o "$scratch/out.npy" 2> "$scratch/errors"
        status=$?
        check "$name" "exit $status: $(last "$scratch/errors")" \
            cmp -s "$scratch/first.npy" "$scratch/out.npy"
    done
done
check 'mpi/statistics name the link' "$(stat_of "$scratch/stats.json" link)" \
    test "$(stat_of "$scratch/stats.json" link)" = mpi
check "mpi/a node's map is reported" 'no memory high water' test \
    "$(stat_of "$scratch/stats.json" 'per_node[7].memory_high_water_bytes')" \
    -gt 100000
"$INCODE" convert "$points" "$scratch/points.xyz"
"$INCODE" run - -q --nodes 1 -o - < "$scratch/points.xyz" > "$scratch/first.ele"
incode run - -q --link mpi --nodes 2 -o - < "$scratch/points.xyz" \
    > "$scratch/out.ele" 2> "$scratch/errors"
status=$?
check 'mpi/standard input and output' "exit $status: $(last "$scratch/errors")" \
    cmp -s "$scratch/first.ele" "$scratch/out.ele"

if has_data mpi/digests; then
    # Ties, duplicates, curves: the rest is link by link the same.
    while read -r name file count _ _ digest; do
        case $name in
            bluntfin | bunny | deg_octahedron | deg_spirula* | pdb_3GQP) ;;
            *) continue ;;
        esac
        why=$(no_set "$file" "$count")
        if [ -n "$why" ]; then
            skip "mpi/digest of $name" "$why"
            continue
        fi
        triangulates "mpi/digest of $name" "$name" "$INCODE_DATA/$file" \
            "$digest" --link mpi --nodes 8
    done < <(list_sets)
fi

# --- under mpirun -------------------------------------------------------------

echo 'localhost slots=9' > "$scratch/hosts"
rm -f "$scratch/out.npy"
by_hand --hostfile "$scratch/hosts" --bind-to none -np 9 "$INCODE" run "$points" -q \
    --link mpi -o "$scratch/out.npy" 2> "$scratch/errors"
status=$?
check 'mpi/mpirun with a hostfile' "exit $status: $(last "$scratch/errors")" \
    cmp -s "$scratch/first.npy" "$scratch/out.npy"

# As on machines that share no memory: ranks look for messages themselves.
rm -f "$scratch/out.npy"
INCODE_MPI_APART=1 by_hand -x INCODE_MPI_APART --oversubscribe --mca pml ob1 \
    --mca btl self,tcp --mca btl_tcp_if_include lo -np 9 "$INCODE" run "$points" -q --link mpi \
    -o "$scratch/out.npy" 2> "$scratch/errors"
status=$?
check 'mpi/ranks that share no memory' "exit $status: $(last "$scratch/errors")" \
    cmp -s "$scratch/first.npy" "$scratch/out.npy"

# rejects NAME STATUS PATTERN OPTION...: said once, by rank 0 alone
rejects() {
    local name=$1 expected=$2 pattern=$3 status
    shift 3
    rm -f "$scratch/out.npy"
    by_hand --oversubscribe "$@" -q -o "$scratch/out.npy" \
        2> "$scratch/errors" > /dev/null
    status=$?
    if [ $status != "$expected" ]; then
        fail "$name" "exit $status: $(grep incode "$scratch/errors")"
    elif [ "$(grep -cE "^incode.*$pattern" "$scratch/errors")" != 1 ]; then
        fail "$name" "not once: $(last "$scratch/errors")"
    else
        check "$name" 'it left an output' test ! -e "$scratch/out.npy"
    fi
}
rejects 'mpi/a wrong number of ranks' 2 'allowed: 2, 3, 5, 9' \
    -np 4 "$INCODE" run "$points" --link mpi
rejects 'mpi/nodes and ranks disagree' 2 '--nodes 4: .* 2 nodes' \
    -np 3 "$INCODE" run "$points" --link mpi --nodes 4
rejects 'mpi/wrong usage' 2 'nonesuch' \
    -np 3 "$INCODE" run "$points" --link mpi --strategy nonesuch
rejects 'mpi/wrong input' 3 'absent' \
    -np 3 "$INCODE" run "$scratch/absent.npy" --link mpi

# --- what does not start ------------------------------------------------------

left=$scratch/left
refuses 'mpi/points in a plane' 3 'plane' bash -c "printf '%s\n' '0 0 1' \
    '1 0 1' '0 1 1' '3 5 1' | '$INCODE' run - -q --link mpi --nodes 2 \
    -o '$left/o.npy'"
refuses 'mpi/the report fills the disk' 3 '^incode: standard output: .*space' \
    bash -c '"$@" > /dev/full' - "$INCODE" run "$points" --link mpi --nodes 2 \
    -o "$left/o.ele"
refuses 'mpi/no mpirun' 4 'openmpi-bin' env PATH=/nowhere "$INCODE" run \
    "$points" --link mpi --nodes 2 -o "$left/o.npy"
mkdir "$scratch/bin"
printf '#!/bin/sh\necho "There are not enough slots available in the system"
exit 1\n' > "$scratch/bin/mpirun"
chmod +x "$scratch/bin/mpirun"
refuses 'mpi/not enough slots' 4 'slots=N' env PATH="$scratch/bin:$PATH" \
    "$INCODE" run "$points" --link mpi --nodes 2 -o "$left/o.npy"

# --- what ends before its time ------------------------------------------------

# children PID: all below it, a line each: pid name
children() {
    local pid
    for pid in $(pgrep -P "$1"); do
        [ "$(ps -o stat= -p "$pid" | cut -c 1)" = Z ] ||
            echo "$pid $(ps -o comm= -p "$pid")"
        children "$pid"
    done
}
# start NODES COMMAND...: in the background, as $run, until they are at work.
# $all are its processes.
start() {
    local nodes=$1
    shift
    rm -f "$scratch"/out.*
    # A host that reads slowly: the run takes a minute, and no processor.
    # shellcheck disable=SC2086
    "$@" run "$points" -q $patient --link mpi --nodes "$nodes" \
        --strategy spatial --host-rate 6000 -o "$scratch/out.npy" > "$scratch/said" 2> "$scratch/errors" &
    run=$!
    await all_there
    sleep 0.5 # clock: at work by then, or still beginning
}
all_there() {
    all=$(children $run)
    [ "$(echo "$all" | grep -c incode-node-mpi)" = "$nodes" ]
}
# ends NAME STATUS PATTERN: soon, with no output and nothing running
ends() {
    local name=$1 expected=$2 pattern=$3 status alive pid
    wait $run 2> /dev/null
    status=$?
    check "$name: exit" "exit $status" test $status = "$expected"
    [ -z "$pattern" ] ||
        check "$name: is named" "$(last "$scratch/errors")" \
            grep -qE "$pattern" "$scratch/errors"
    # clock: minutes
    check "$name: soon" "$((SECONDS - began)) s" \
        test $((SECONDS - began)) -le $soon
    check "$name: no output" "$(ls "$scratch"/out.* 2> /dev/null)" \
        test -z "$(ls "$scratch"/out.* 2> /dev/null)"
    await all_gone
    check "$name: nothing runs on" "$alive" test -z "$alive"
}
all_gone() {
    alive=
    for pid in $(echo "$all" | cut -d ' ' -f 1); do
        [ "$(ps -o stat= -p "$pid" | cut -c 1)" != Z ] &&
            kill -0 "$pid" 2> /dev/null && alive="$alive $pid"
    done
    [ -z "$alive" ]
}
# pid_of NAME N: the N-th process of that name
pid_of() { echo "$all" | grep " $1" | sed -n "$2p" | cut -d ' ' -f 1; }

start 8 "$INCODE"
began=$SECONDS # clock: minutes, as of all that follow
kill -KILL "$(pid_of incode-node-mpi 4)"
ends 'mpi/a node killed' 4 '^incode: node [0-7] \(rank [1-8]\): '

start 2 "$INCODE"
began=$SECONDS
# Its name is cut to 15 letters at first, and then the one that it takes.
kill -KILL "$(pid_of 'incode-\(testing-\|mpi\)' 1)"
ends 'mpi/the host killed' 4 '^incode: host \(rank 0\): '

start 2 "$INCODE"
began=$SECONDS
kill -TERM $run
ends 'mpi/the run terminated' 143 ''

start 2 timeout "$hang" mpirun $root --oversubscribe -np 3 "$INCODE"
began=$SECONDS
kill -KILL "$(pid_of incode-node-mpi 2)"
ends 'mpi/a node killed under mpirun' 137 '^incode: node [01] \(rank [12]\): '

found=$(ls -A "$TMPDIR")
check 'mpi/no session left' "$found" test -z "$found"

# It has no time to clean up after itself.
start 2 "$INCODE"
began=$SECONDS
# In Open MPI 5 it becomes prterun.
kill -KILL "$(pid_of '\(mpirun\|prterun\)' 1)"
ends 'mpi/mpirun killed' 4 '^incode: (mpirun|node [01] \(rank [12]\)): '
