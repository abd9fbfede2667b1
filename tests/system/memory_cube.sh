#!/usr/bin/env bash
# The host of a cube in less memory than its points and tetrahedra take: the same
# bytes as in memory, and no more resident than the limit, with two strategies,
# checked exactly, with a node that is lost in mid-run, and under Open MPI.  Then
# what was put aside is cut.
. tests/system/lib.sh
with_faults

points=$scratch/points.npy stats=$scratch/stats.json aside=$scratch/aside
mkdir "$aside"
incode gen uniform 100000 --seed 5 -o "$points"
succeeds 'memory_cube/in memory' incode run "$points" -q -o "$scratch/whole.npy"

# start SIZE [OPTION...]: a run within so many MiB in the background.
start() {
    local size=$1
    shift
    rm -f "$scratch/out.npy" "$stats"
    "$INCODE" run "$points" --progress --host-memory "${size}M" \
        --scratch "$aside" --stats "$stats" -o "$scratch/out.npy" "$@" \
        > /dev/null 2> "$scratch/errors" &
    host=$!
}

# ended NAME SIZE: its result and its peak are right, and so much was put aside.
ended() {
    local status
    wait $host
    status=$?
    check "memory_cube/$1" "exit $status: $(last "$scratch/errors")" \
        [ $status = 0 ]
    check "memory_cube/$1: bytes" 'they differ' \
        cmp -s "$scratch/whole.npy" "$scratch/out.npy"
    check "memory_cube/$1: peak" "$(jq -c '[.host_peak_bytes, .scratch_bytes]' \
        "$stats") bytes of $2 MiB" jq -e ".host_peak_bytes < $2 * 1048576 and
            .host_memory_bytes == $2 * 1048576 and .scratch_bytes > 2e7" "$stats" > /dev/null
}

start 16 --nodes 4 --strategy exchange
ended exchange 16
start 16 --nodes 4 --strategy spatial --verify
ended 'spatial, checked exactly' 16

slowed() {
    start 16 --nodes 4 --strategy exchange --patience 900 \
        --host-rate 100000 --host-rate-time "$@"
}
at_work() { await shows_work && kill -0 $host 2> /dev/null; }
at_first=1

kill_node() {
    kill -KILL "$(pgrep -P $host -x incode-node | tail -n 1)" 2> /dev/null
}
amid 'at_work && kill_node'
check 'memory_cube/a node is killed' 'the run had ended' kill -0 $host
ended 'a node killed' 16
check 'memory_cube/a node killed: it was lost' "$(jq -c .node_restarts "$stats")" \
    jq -e '.node_restarts + .nodes_lost > 0' "$stats" > /dev/null

# Again and again, as a file that grows is whole; true where the run has ended.
cut_files() {
    local file
    for file in /proc/"$host"/fd/*; do
        [[ $(readlink "$file") != *incode-scratch* ]] || truncate -s 0 "$file"
    done
    ! kill -0 $host
} 2> /dev/null
slowed 100
at_work && await cut_files
wait $host
status=$?
check 'memory_cube/a file cut' "exit $status: $(last "$scratch/errors")" \
    [ $status = 143 ]
check 'memory_cube/a file cut: message' "$(last "$scratch/errors")" \
    grep -q "^incode: $aside: what was put aside .* --scratch DIR" \
    <(tr '\r' '\n' < "$scratch/errors")
left=$(find "$scratch" -name 'out.npy*' -o -path "$aside/*")
check 'memory_cube/a file cut: nothing is left' "$left" [ -z "$left" ]

command -v mpirun > /dev/null ||
    { skip memory_cube/mpi 'there is no mpirun'; exit 0; }
export TMPDIR=$scratch/tmp
mkdir "$TMPDIR"
start 36 --link mpi --nodes 2 --strategy exchange
ended mpi 36
exits 'memory_cube/mpi in 16M' 2 incode run "$points" -q --link mpi --nodes 2 \
    --host-memory 16M
check 'memory_cube/mpi in 16M: message' "$(last "$scratch/errors")" \
    grep -q 'host-memory 16M: this process takes .*; give .*M or more' \
    "$scratch/errors"
