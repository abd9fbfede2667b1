#!/usr/bin/env bash
# Four nodes that a user starts: late, never, with another key, killed, stopped
# and cut off in mid-run.  Each is told in one line on standard error that says
# which and what next, before its consequence; how soon, the tests of
# host/service measure in virtual time.
. tests/system/lib.sh
with_faults
umask 077 # for keys
took=$SECONDS

points=$scratch/points.npy
"$INCODE" gen uniform 20000 --seed 3 -o "$points" 2> /dev/null
"$INCODE" run "$points" -q --nodes 1 -o "$scratch/first.npy"
take_ports
openssl rand -hex 32 > "$scratch/cube.key"
openssl rand -hex 32 > "$scratch/other.key"
# The wires of node 1 go through the relay.
cat > "$scratch/four.cube" <<END
dimension = 2;
key = "cube.key";
dead = 2;
links = (
    { node = 0; to = "host"; tcp = "127.0.0.1:$base"; },
    { node = 0; to = 1; tcp = "127.0.0.1:$((base + 1))";
      via = "127.0.0.1:$((base + 5))"; },
    { node = 0; to = 2; tcp = "127.0.0.1:$((base + 2))"; },
    { node = 1; to = 3; tcp = "127.0.0.1:$((base + 3))";
      via = "127.0.0.1:$((base + 6))"; },
    { node = 2; to = 3; tcp = "127.0.0.1:$((base + 4))"; }
);
END
"${RELAY:-$BUILD/tests/relay}" 1 0 0 0 $((base + 5)):$((base + 1)) \
    $((base + 6)):$((base + 3)) > /dev/null &
relay=$!

# start_line LINE [NAME=VALUE...]: a node, as the program says; $node.
start_line() {
    eval "exec \"\$BUILD\"/$1" 2> "$scratch/node" < /dev/null &
    node=$!
}
line_of() { "$INCODE" cube "$scratch/four.cube" | grep -e " --node $1 "; }
end_node() {
    kill -KILL "$1" 2> /dev/null
    wait "$1" 2> /dev/null
}

# begin [OPTION...]: a run in the background, $host, that is slow enough to be
# at work while something happens to it.
errors=$scratch/errors
begin() {
    rm -f "$scratch/out.npy" "$scratch/stats.json"
    : > "$errors" # at once: what the run before said is over
    "$INCODE" run "$points" --no-progress --cube "$scratch/four.cube" \
        --host-rate 50000 --host-rate-time 60 -o "$scratch/out.npy" \
        --stats "$scratch/stats.json" "$@" > "$scratch/output" 2>> "$errors" &
    host=$!
}

# told NAME PATTERN: while the run goes on, a line says so, and what next.
told() {
    await said "$2"
    check "hand_started/$1" "$(cat "$errors")" said_and_next "$2"
}
said() { grep -qE "^incode: $1" "$errors" || ! kill -0 $host 2> /dev/null; }
# A slow machine may look when the run is over: something else was said since.
said_and_next() {
    if ! kill -0 $host 2> /dev/null &&
        last "$errors" | grep -qE "^incode: $1"; then
        return 1
    fi
    grep -E "^incode: $1" "$errors" | grep -qE '; ..*'
}

# ends NAME STATUS: with the right output, or with none.
ends() {
    local status
    wait $host
    status=$?
    check "hand_started/$1: exit $2" "exit $status: $(last "$errors")" \
        test $status = "$2"
    if [ "$2" = 0 ]; then
        check "hand_started/$1: the same bytes" 'the output differs' \
            cmp -s "$scratch/first.npy" "$scratch/out.npy"
    else
        check "hand_started/$1: no output" 'it left one' \
            test ! -e "$scratch/out.npy"
    fi
}

# --- none ---------------------------------------------------------------------

begun=$(date +%s) # clock: no sooner
begin --patience 7
ends none 4
check 'hand_started/none: the last line says how to start it' \
    "$(last "$errors")" grep -qE "^incode: node 0 link 2: connection refused \
for ([7-9]|[1-9][0-9]+) s, 0 of 4 nodes are there; start it with: incode-node --node 0 " "$errors"
# clock: no sooner
check 'hand_started/none: no sooner than its patience' 'it gave up before' \
    [ $(($(date +%s) - begun)) -ge 7 ]

# --- late, then killed ---------------------------------------------------------

# clock: minutes, and below what a busy machine needs to start a node.
begin --patience 600
told 'started late: the first' \
    "node 0 at 127.0.0.1:$base: connection refused.* start it with: "
# The line itself is what starts it.
start_line "$(sed -n 's/^incode: node 0 .* start it with: //p' "$errors" |
    head -n 1)"
node0=$node
start_line "$(line_of 1)"; node1=$node
start_line "$(line_of 2)"; node2=$node
told 'started late: the last' \
    'node 3: no answer, 3 of 4 are there; start it with: '
start_line "$(sed -n 's/^incode: node 3: .* start it with: //p' "$errors" |
    tail -n 1)"
node3=$node
told 'all are there' 'host: all nodes are there'
end_node $node3
told 'killed: in doubt' 'node 3 link [01]: no answer'
kill -STOP $host
held=$host
begin --patience 600
told 'held by an earlier host' \
    "127.0.0.1:$base: in use by incode-testing run .*, process $held of .*; waits "
kill -KILL $held $host
wait $held $host 2> /dev/null

# once_more [OPTION...]: a run that is at work on all nodes.
once_more() {
    begin "$@"
    await said 'node 3: no answer, 3 of 4 are there'
    start_line "$(line_of 3)"
    node3=$node
    await said 'host: all nodes are there'
}
# clock: longer than a busy machine needs to start a node
once_more --patience 12
end_node $node3
told 'killed: given up' 'node 3 link [01]: given up'
ends killed 0
check 'hand_started/killed: the last line counts' \
    "$(last "$scratch/output")" grep -q ' on 3 of 4 nodes' "$scratch/output"
check 'hand_started/killed: the statistics count' 'they do not' \
    test "$(stat_of "$scratch/stats.json" nodes_lost)" = 1

# --- never, and with another key -------------------------------------------------

# clock: the three that are up are there by then
begin --patience 10
told 'never started' 'node 3: no answer, 3 of 4 are there; start it with: '
ends 'never started' 4

start_line "$(line_of 3 | sed 's/cube.key/other.key/')"
node3=$node
begin --patience 12 # clock: the others are up
told 'another key' 'node 3: node [12] meets another key there; '
await grep -q 'another key' "$scratch/node"
check 'hand_started/another key: the node says so' "$(last "$scratch/node")" \
    grep -qE '^incode-node: .*another key; ..*' "$scratch/node"
ends 'another key' 4
check 'hand_started/another key: the last line names it' "$(last "$errors")" \
    grep -qE '^incode: node 3 .* meets another key .*, 3 of 4 .*key file$' \
    <(last "$errors")
end_node $node3

# --- stopped, and cut off --------------------------------------------------------

once_more --patience 600
kill -STOP $node2
told 'stopped' 'node 2 link [01]: no answer'
kill -CONT $node2
told 'goes on' 'node 2 link [01]: answers again'
ends stopped 0

end_node $node3
# clock: longer than a busy machine needs to start a node
once_more --patience 12
kill $relay
wait $relay 2> /dev/null
told 'cut off' 'node 1 link [01]: no answer'
told 'cut off: given up' 'node 1 link [01]: given up'
ends 'cut off' 0
# A node that has begun anew is known by its program's name.
check 'hand_started/name of the process' "$(cat /proc/$node0/comm)" \
    [ "$(cat /proc/$node0/comm)" = incode-node ]
for node in $node0 $node1 $node2 $node3; do
    end_node "$node"
done
echo "$((SECONDS - took)) s"
