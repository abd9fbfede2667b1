#!/usr/bin/env bash
# The cube as processes: what memory they hold, what happens when one is
# stopped or slow to read, and that none outlives the host.  survival.sh kills
# them.
. tests/system/lib.sh
with_faults

points=$scratch/points.npy
"$INCODE" gen uniform "${CLUSTER_POINTS:-100000}" --seed 2 -o "$points" 2> /dev/null
"$INCODE" run "$points" -q --strategy sequential --nodes 1 \
    -o "$scratch/first.npy" 2> "$scratch/errors"
check 'cluster/one node' "$(last "$scratch/errors")" \
    test -f "$scratch/first.npy"

# slowed SECONDS [OPTION...]: a run in the background; $host its process, $nodes
# those of its nodes.
slowed() {
    rm -f "$scratch/out.npy"
    "$INCODE" run "$points" --progress --strategy spatial --nodes 8 \
        --patience 600 --host-rate 100000 --host-rate-time "$1" \
        -o "$scratch/out.npy" "${@:2}" > /dev/null 2> "$scratch/errors" &
    host=$!
    await shows_work
    await all_there
    read -r node _ <<< "$nodes"
}
all_there() {
    nodes=$(pgrep -P $host -x incode-node | tr '\n' ' ')
    [ "$(echo "$nodes" | wc -w)" = 8 ] || ! kill -0 $host 2> /dev/null
}

# Two that are slow to read, beside the rest: a host that reads 1 KB/s for 30 s,
# and a reader of standard output behind a pipe.
"$INCODE" run "$points" -q --strategy spatial --nodes 8 --patience 600 \
    --host-rate 1024 --host-rate-time 30 -o "$scratch/host.npy" \
    2> "$scratch/host.errors" &
slow_host=$!
"$INCODE" run "$points" -q --nodes 8 --patience 600 -o - \
    2> "$scratch/reader.errors" | {
    for _ in $(seq 30); do
        head -c 1024
        sleep 1 # clock: a reader of 1 KB/s, or less
    done
    cat
} > "$scratch/slow.ele" &
slow_reader=$!

at_first=5
# clock: it was stopped for ten seconds at least.
stopped() { kill -STOP "$node" && sleep 10; }
amid stopped
check 'cluster/a node stopped for 10 s: the run was at work' \
    "it had ended: $(last "$scratch/errors")" kill -0 $host
kill -CONT "$node"
wait $host
status=$?
check 'cluster/a node stopped for 10 s' "exit $status: \
$(last "$scratch/errors")" test $status = 0
check 'cluster/a stopped node: what would become of it' \
    "$(cat "$scratch/errors")" grep -qE '^incode: node [0-7] link [0-3]: no answer .*'\
'; it is ended and started again after 600 s' "$scratch/errors"
check 'cluster/the same bytes after it' 'the output differs' \
    cmp -s "$scratch/first.npy" "$scratch/out.npy"

amid true
check 'cluster/no node outlives the host: the run was at work' \
    "it had ended: $(last "$scratch/errors")" kill -KILL $host
wait $host 2> /dev/null
alive=$nodes
all_gone() {
    alive=
    for node in $nodes; do
        kill -0 "$node" 2> /dev/null && alive="$alive $node"
    done
    [ -z "$alive" ]
}
await all_gone
check 'cluster/no node outlives the host' "alive:$alive" test -z "$alive"

amid true
check 'cluster/a terminated run: it was at work' \
    "it had ended: $(last "$scratch/errors")" kill -TERM $host
wait $host
status=$?
check 'cluster/a terminated run leaves no output' "exit $status" \
    test ! -e "$scratch/out.npy" -a $status != 0

# The writable memory of each node, as the kernel has it.
limit=$((4096 * 1024))
worst=0
"$INCODE" run "$points" -q --nodes 2 --stats "$scratch/stats.json"
if [ "$(stat_of "$scratch/stats.json" memory_limited)" != true ]; then
    skip 'cluster/writable memory of a node' \
        'sanitizers need more memory than a node has'
else
    slowed 5 --memory 4M
    shared=
    while kill -0 $host 2> /dev/null; do
        for node in $nodes; do
            bytes=$(awk '/^[0-9a-f]+-[0-9a-f]+ / { writes = $2 ~ /w/ }
                /^Size:/ && writes { n += $2 * 1024 } END { print n + 0 }' \
                "/proc/$node/smaps" 2> /dev/null)
            [ "${bytes:-0}" -gt $worst ] && worst=$bytes
        done
        shared=$shared$(awk '/^[0-9a-f]+-/ && $2 ~ /w.s/' \
            "/proc/$node/smaps" 2> /dev/null)
    done
    wait $host
    check 'cluster/writable memory of a node' "$worst bytes, not $limit" \
        test "$worst" -gt $((limit / 2)) -a "$worst" -le $limit
    check 'cluster/no shared writable mapping' "$shared" test -z "$shared"
    check 'cluster/the same bytes' 'the output differs' \
        cmp -s "$scratch/first.npy" "$scratch/out.npy"

    found=$(nm "$BUILD/incode-node" | awk '{ print $NF }' |
        grep -xE '(__libc_)?(m|c|re)alloc|free|sbrk|memalign' | tr '\n' ' ')
    check 'cluster/no allocator in the node' "$found" test -z "$found"

    # Much memory costs what is used of it: not 1,048,576 KB.
    # clock: looked at a second after they came up, while they work.
    used() {
        sleep 1
        worst=0
        for node in $nodes; do
            used=$(awk '/^VmHWM/ { print $2 }' "/proc/$node/status")
            [ "${used:-0}" -le $worst ] || worst=$used
        done
    }
    amid used --memory 1G
    wait $host
    status=$?
    check 'cluster/nodes of 1 GB' \
        "exit $status, $worst KB used: $(last "$scratch/errors")" \
        test $status = 0 -a $worst -gt 1000 -a $worst -lt 262144
fi

# same NAME OPTION...: these options change no byte of the output.
same() {
    local name=$1
    shift
    rm -f "$scratch/out.npy"
    succeeds "cluster/$name: exit 0" "$INCODE" run "$points" -q \
        --strategy spatial --patience 600 -o "$scratch/out.npy" "$@"
    check "cluster/$name" "the output differs: $(last "$scratch/errors")" \
        cmp -s "$scratch/first.npy" "$scratch/out.npy"
}
same '32 nodes, one frame a link, a host that stalls' --nodes 32 --window 1 \
    --host-stall 20
same '64 nodes' --nodes 64

wait $slow_host
status=$?
check 'cluster/a host that reads 1 KB/s for 30 s' \
    "exit $status: $(last "$scratch/host.errors")" \
    cmp -s "$scratch/first.npy" "$scratch/host.npy"
wait $slow_reader
"$INCODE" convert "$scratch/slow.ele" "$scratch/slow.npy"
check 'cluster/a slow reader of standard output' \
    "the output differs: $(last "$scratch/reader.errors")" \
    cmp -s "$scratch/first.npy" "$scratch/slow.npy"
