#!/usr/bin/env bash
# The same bytes over every kind of wire, also where the wire suffers.  What
# waits more than it works goes on beside the rest.
. tests/system/lib.sh
with_faults

points=$scratch/points.npy
"$INCODE" gen uniform "${CLUSTER_POINTS:-100000}" --seed 2 -o "$points" 2> /dev/null
"$INCODE" run "$points" -q --strategy sequential --nodes 1 \
    -o "$scratch/first.npy" 2> "$scratch/errors"
first=$scratch/first.npy
check 'links/one node' "$(last "$scratch/errors")" test -f "$first"

# same NAME OPTION...: these options change no byte of the output.
same() {
    local name=$1
    shift
    rm -f "$scratch/out.npy"
    incode run "$points" -q --strategy spatial \
        -o "$scratch/out.npy" "$@" 2> "$scratch/errors"
    status=$?
    check "links/$name" "exit $status: $(last "$scratch/errors")" \
        cmp -s "$first" "$scratch/out.npy"
}
same '8 nodes on sockets' --nodes 8 --link tcp
if has_terminals links/terminals; then
    same '8 nodes on pseudo-terminals' --nodes 8 --link serial
    same '8 small nodes on pseudo-terminals' --nodes 8 --link serial \
        --memory 512K
    same "the host's end closed and reopened" --nodes 8 --link serial \
        --host-unplug 150
fi

# --- beside the rest ----------------------------------------------------------

take_ports

# listened PORT: whether somebody listens there.
listened() {
    grep -qi ":$(printf '%04X' "$1") 00000000:0000 0A " /proc/net/tcp
}
# connected PORT: whether someone has called it, and was answered.
connected() {
    grep -qi ":$(printf '%04X' "$1") [0-9A-F:]* 01 " /proc/net/tcp
}

# beside NAME: the function of that name, in a scratch of its own; `gather` says
# what it has said, and whether it came to its end.
sides=
beside() {
    mkdir "$scratch/$1"
    "$INCODE" key "$scratch/$1/cube.key"
    (scratch=$scratch/$1; "$1"; echo 'done') \
        > "$scratch/$1.said" 2> "$scratch/$1.errors" &
    sides="$sides $1:$!"
}
gather() {
    local side
    for side in $sides; do
        wait "${side#*:}"
        grep -vx 'done' "$scratch/${side%:*}.said"
        check "links/all of ${side%:*} was run" \
            "it ended before: $(last "$scratch/${side%:*}.errors")" \
            test "$(tail -n 1 "$scratch/${side%:*}.said")" = 'done'
    done
}
# start_nodes CUBE [PATTERN]: those that the user starts; $nodes.
start_nodes() {
    local options
    nodes=
    while read -r options; do
        eval "$BUILD/$options 2> /dev/null < /dev/null &"
        nodes="$nodes $!"
    done < <("$INCODE" cube "$1" | grep -e "${2:-^incode-node }")
}
end_nodes() {
    # shellcheck disable=SC2086
    kill -KILL $nodes 2> /dev/null
    # shellcheck disable=SC2086
    wait $nodes 2> /dev/null
}

# make_cube FILE [KEY]: 8 nodes on TCP, started by the host, each wire through
# the relay, insecure without a key; $through its ports.
make_cube() {
    local node to wire=0 insecure='insecure = true;'
    [ -z "${2:-}" ] || insecure=
    through=
    {
        printf 'dimension = 3;\nstart = [0, 1, 2, 3, 4, 5, 6, 7];\n'
        [ -z "${2:-}" ] || printf 'key = "%s";\n' "$2"
        printf 'links = (\n'
        for node in 0 1 2 3 4 5 6 7; do
            for to in $((node | 1)) $((node | 2)) $((node | 4)) '"host"'; do
                [ "$to" = "$node" ] && continue
                [ "$to" = '"host"' ] && [ $node != 0 ] && continue
                [ $wire = 0 ] || printf ',\n'
                printf '{ node = %d; to = %s; tcp = "127.0.0.1:%d"; ' $node \
                    "$to" $((base + wire))
                printf 'via = "127.0.0.1:%d"; %s }' $((base + 100 + wire)) \
                    "$insecure"
                through="$through $((base + 100 + wire)):$((base + wire))"
                wire=$((wire + 1))
            done
        done
        printf '\n);\n'
    } > "$1"
}

# A node that knows another key, and one without any.
wrong_keys() {
    cat > "$scratch/one.cube" <<-END
	dimension = 0;
	key = "cube.key";
	links = ( { node = 0; to = "host"; tcp = "127.0.0.1:$((base + 50))"; } );
END
    "$INCODE" cube "$scratch/one.cube" > "$scratch/options"
    "$INCODE" key "$scratch/other.key"
    refused() { # NAME SED
        local began=$SECONDS # clock: minutes
        # shellcheck disable=SC2046
        "$BUILD/"$(sed "$2" "$scratch/options") 2> "$scratch/said" &
        node=$!
        await listened $((base + 50))
        incode run "$points" -q -o "$scratch/out.npy" \
            --patience 8 --cube "$scratch/one.cube" 2> "$scratch/errors"
        status=$?
        kill $node
        wait $node 2> /dev/null
        # clock: minutes
        check "links/$1" "exit $status: $(last "$scratch/errors")" \
            test $status = 4 -a $((SECONDS - began)) -lt $soon
        check "links/$1: it is named" "$(last "$scratch/errors")" \
            grep -q '^incode: node 0 link 0: ' "$scratch/errors"
    }
    rm -f "$scratch/out.npy"
    refused 'another key: exit 4' 's/cube.key/other.key/'
    check 'links/another key: it says so' "$(last "$scratch/errors")" \
        grep -q 'link 0: answers, but with another key for .*; give both ends the' "$scratch/errors"
    refused 'no key: exit 4' 's/--key [^ ]*/--insecure/'
    check 'links/no key: the host says so' "$(last "$scratch/errors")" \
        grep -q 'link 0: answers, but has no key for .*; give both ends the' "$scratch/errors"
    check 'links/no key: the node says what that means' \
        "$(last "$scratch/said")" grep -q \
        "^incode-node: --wire 0=listen:.*$((base + 50)): insecure: .*; make a key" \
        "$scratch/said"
    check 'links/no key: the node says that it lacks it' \
        "$(last "$scratch/said")" grep -q \
        '^incode-node: --wire .*: is called by one who has a key, .*; ' \
        "$scratch/said"
    sed -i 's/^key = .*//; s/; } );/; insecure = true; } );/' \
        "$scratch/one.cube"
    refused 'a key at the node alone: exit 4' ''
    check 'links/a key at the node alone: the host says so' \
        "$(last "$scratch/errors")" \
        grep -q 'link 0: answers, but wants a key for .*; give both ends the' "$scratch/errors"
    check 'links/no output without a key' 'it left one' \
        test ! -e "$scratch/out.npy"
    rm "$scratch/said"
    # Between nodes it is the one that calls who hears of it.
    printf 'dimension = 1; key = "cube.key"; links = (
        { node = 0; to = "host"; tcp = "127.0.0.1:%d"; },
        { node = 0; to = 1; tcp = "127.0.0.1:%d"; } );\n' \
        $((base + 51)) $((base + 52)) > "$scratch/pair.cube"
    start_nodes "$scratch/pair.cube" '--node 0 '
    # shellcheck disable=SC2046
    "$BUILD/"$("$INCODE" cube "$scratch/pair.cube" | grep -e '--node 1 ' |
        sed 's/cube.key/other.key/') 2> "$scratch/said" &
    nodes="$nodes $!"
    await test -s "$scratch/said"
    end_nodes
    check 'links/another key between nodes' "$(cat "$scratch/said")" \
        grep -q "^incode-node: --wire .*$((base + 52)): answers, but with" \
        "$scratch/said"
    rm "$scratch/said"
    sed -i 's/--key [^ ]*//' "$scratch/options"
    # shellcheck disable=SC2046
    within "$BUILD/"$(cat "$scratch/options") 2> "$scratch/said"
    status=$?
    check 'links/without a key it does not listen' \
        "exit $status: $(cat "$scratch/said")" test $status = 2 -a -n "$(
            grep ': a wire over TCP wants a key; make one with: incode key FILE' \
                "$scratch/said")"
}

# A wire that was never put in: where its end calls, nobody listens.
missing_wire() {
    cat > "$scratch/missing.cube" <<-END
	dimension = 2;
	key = "cube.key";
	start = [0, 1, 2];
	links = (
	    { node = 0; to = "host"; tcp = "127.0.0.1:$((base + 60))"; },
	    { node = 0; to = 1; tcp = "127.0.0.1:$((base + 61))";
	      via = "127.0.0.1:$((base + 70))"; },
	    { node = 0; to = 2; tcp = "127.0.0.1:$((base + 62))"; },
	    { node = 1; to = 3; tcp = "127.0.0.1:$((base + 63))"; },
	    { node = 2; to = 3; tcp = "127.0.0.1:$((base + 64))"; }
	);
END
    start_nodes "$scratch/missing.cube" '--node 3 '
    # clock: the nodes are up by then
    same 'a wire that is missing' --cube "$scratch/missing.cube" --patience 15
    check 'links/a wire that is missing is named' "$(last "$scratch/errors")" \
        grep -q '^incode: node 0 link 0: the wire to node 1 .*; ' \
        "$scratch/errors"
    end_nodes
    unneeded_wire
}

# One that no node needs to reach node 0 or to be reached by it.
unneeded_wire() {
    base=$((base + 200))
    make_cube "$scratch/unneeded.cube" cube.key
    sed -i 's/ via = "[^"]*";//' "$scratch/unneeded.cube"
    same 'no wire is missing' --cube "$scratch/unneeded.cube"
    check 'links/no false alarm' "$(last "$scratch/errors")" \
        test ! -s "$scratch/errors"
    sed -i '/node = 5; to = 7;/s/;  }/; via = "127.0.0.1:1"; }/' \
        "$scratch/unneeded.cube"
    same 'a wire that nothing needs' --cube "$scratch/unneeded.cube" \
        --stats "$scratch/stats.json"
    check 'links/a wire that nothing needs is named' \
        "$(last "$scratch/errors")" \
        grep -q '^incode: node 5 link 1: the wire to node 7 .*; ' \
        "$scratch/errors"
    check 'links/a wire that nothing needs is counted' 'it is not' \
        test "$(stat_of "$scratch/stats.json" missing_wires)" = 1 -a \
        "$(stat_of "$scratch/stats.json" generations)" = 1
}

# On one machine a path does, without a key: nodes that a user started, and over
# what they leave when they are killed those that the host starts.
at_paths() {
    local points=$scratch/points.npy first=$scratch/first.npy
    cat > "$scratch/paths.cube" <<-END
	dimension = 1;
	links = ( { node = 0; to = "host"; unix = "h"; },
	          { node = 1; to = 0; unix = "10"; } );
END
    "$INCODE" gen uniform 2000 -o "$points" 2> /dev/null
    "$INCODE" run "$points" -q --nodes 1 -o "$first" 2> "$scratch/errors"
    start_nodes "$scratch/paths.cube"
    same 'nodes at paths' --cube "$scratch/paths.cube" \
        --stats "$scratch/stats.json"
    same 'the same nodes at paths again' --cube "$scratch/paths.cube"
    check 'links/nodes at paths: said so' "$(last "$scratch/errors")" \
        test "$(stat_of "$scratch/stats.json" link)" = unix -a \
        ! -s "$scratch/errors"
    end_nodes
    check 'links/nodes that are killed leave their sockets' 'they do not' \
        test -S "$scratch/h" -a -S "$scratch/10"
    sed -i '1s/$/ start = [0, 1];/' "$scratch/paths.cube"
    same 'nodes that the host starts, at paths' --cube "$scratch/paths.cube"
    check 'links/the host leaves no sockets' "$(ls "$scratch")" \
        test ! -e "$scratch/h" -a ! -e "$scratch/10"
    sed -i '1s/start.*//' "$scratch/paths.cube"
    start_nodes "$scratch/paths.cube"
    await test -S "$scratch/h" -a -S "$scratch/10"
    # shellcheck disable=SC2086
    kill $nodes
    # shellcheck disable=SC2086
    wait $nodes 2> /dev/null
    check 'links/nodes that are ended leave no sockets' "$(ls "$scratch")" \
        test ! -e "$scratch/h" -a ! -e "$scratch/10"
    sed -i '1s/$/ start = [0, 1];/; s/unix = "h";/tcp = "127.0.0.1:'$((base + 55
        ))'"; insecure = true;/' "$scratch/paths.cube"
    same 'a wire that is insecure' --cube "$scratch/paths.cube" \
        --stats "$scratch/stats.json"
    check 'links/a wire that is insecure: the host says so' \
        "$(cat "$scratch/errors")" grep -q \
        '^incode: .*:2: the wire between node 0 and the host is insecure: .*; ' \
        "$scratch/errors"
    check 'links/a wire that is insecure: and the node' \
        "$(cat "$scratch/errors")" test "$(grep -c \
            '^incode-node: --wire 1=listen:.*: insecure: ' \
            "$scratch/errors")" = 1
    check 'links/wires of two kinds' 'not so' \
        test "$(stat_of "$scratch/stats.json" link)" = mixed
    cp boards/linux/examples/*.cube "$scratch"
    for file in local mixed network serial; do
        "$INCODE" cube "$scratch/$file.cube" \
            > "$scratch/output" 2> "$scratch/errors"
        status=$?
        check "links/the example $file.cube" "$(last "$scratch/errors")" \
            test $status = 0 -a -s "$scratch/output"
    done
}

# A second host is sent away and does no harm; one that comes after a host was
# killed gets its nodes.
two_hosts() {
    cat > "$scratch/two.cube" <<-END
	dimension = 1;
	key = "cube.key";
	links = ( { node = 0; to = "host"; tcp = "127.0.0.1:$((base + 80))"; },
	          { node = 1; to = 0; tcp = "127.0.0.1:$((base + 81))"; } );
END
    start_nodes "$scratch/two.cube"
    local points=$scratch/points.npy first=$scratch/first.npy
    "$INCODE" gen uniform 2000 -o "$points" 2> /dev/null
    "$INCODE" run "$points" -q --nodes 1 -o "$first" 2> "$scratch/errors"
    local began status
    slowed() { # SECONDS: the first host
        "$INCODE" run "$points" -q --cube "$scratch/two.cube" \
            --host-rate 10000 --host-rate-time "$1" -o "$scratch/one.npy" \
            2> "$scratch/one.errors" &
        host=$!
        await connected $((base + 80))
        sleep 1 # clock: it has the nodes by then, or later
    }
    second() {
        began=$SECONDS # clock: minutes
        # shellcheck disable=SC2086
        incode run "$points" -q --cube "$scratch/two.cube" $patient \
            -o "$scratch/other.npy" 2> "$scratch/errors"
        status=$?
    }
    at_first=20
    amid second
    check 'links/a second host: exit 4' "exit $status" \
        test $status = 4 -a $((SECONDS - began)) -lt $soon
    check 'links/a second host: it is told' "$(last "$scratch/errors")" \
        grep -q "^incode: 127.0.0.1:$((base + 80)): in use by incode-testing run .*, \
process $host of .*; " \
        "$scratch/errors"
    check 'links/a second host comes while the first is at work' 'it is not' \
        kill -0 $host
    wait $host
    status=$?
    check 'links/the first host goes on' \
        "exit $status: $(last "$scratch/one.errors")" \
        cmp -s "$first" "$scratch/one.npy"
    at_first=3
    amid true
    same 'a second host that sees the first end' --cube "$scratch/two.cube"
    wait $host
    at_first=20
    amid true
    kill -KILL $host
    wait $host 2> /dev/null
    began=$SECONDS
    # shellcheck disable=SC2086
    same 'a host after one that was killed' --cube "$scratch/two.cube" $patient
    # clock: minutes
    check 'links/a host after one that was killed: soon' \
        "$((SECONDS - began)) s" test $((SECONDS - began)) -lt $soon
    end_nodes
}

for part in wrong_keys missing_wire at_paths two_hosts; do
    beside $part
done

# --- a cube file, and a bad network -----------------------------------------

RELAY=${RELAY:-$BUILD/tests/relay}
"$INCODE" key "$scratch/cube.key"

# relayed NAME SEED BYTES_A_FAULT MS_A_CLOSE DELAY_MS CUBE [WAS]: the same bytes,
# and what the relay must have done.
relayed() {
    # shellcheck disable=SC2086
    "$RELAY" "$2" "$3" "$4" "$5" $through > "$scratch/relay" &
    relay=$!
    sleep 0.2 # clock: it listens by then, or is called again
    same "$1" --cube "$6"
    kill $relay
    wait $relay
    check "links/$1: it was bad" "$(cat "$scratch/relay")" grep -qE \
        "^[1-9][0-9]* flips, [1-9][0-9]* deletions, ${7:-[1-9][0-9]* closes}" \
        "$scratch/relay"
}
make_cube "$scratch/open.cube"
relayed 'a bad network, without a key' 1 300000 150 4 "$scratch/open.cube"
make_cube "$scratch/closed.cube" cube.key
relayed 'a bad network, with a key' 2 300000 150 4 "$scratch/closed.cube"
# One chunk in twenty is damaged, and a damaged record costs no connection.
relayed 'a very bad network, with a key' 4 20000 0 0 "$scratch/closed.cube" \
    '0 closes, [1-9][0-9]{0,2} connections'

# Strangers who call, say nothing or noise, and call again, on every wire.
strangers() {
    local port
    while :; do
        for port in $(seq "$base" $((base + 12))); do
            (exec 9<> "/dev/tcp/127.0.0.1/$port" &&
                head -c $((RANDOM % 3000)) /dev/urandom >&9 &&
                sleep 0.$((RANDOM % 9))) 2> /dev/null & # clock: chance
        done
        sleep 0.02
    done
}
# shellcheck disable=SC2086
"$RELAY" 3 0 0 0 $through > /dev/null &
relay=$!
strangers &
strangers=$!
same 'strangers on every wire' --cube "$scratch/closed.cube"
kill $relay $strangers
wait $relay $strangers 2> /dev/null

# Nodes that a user starts; node 0 is lost for good, and the host has a second
# wire.
cat > "$scratch/second.cube" <<-END
	dimension = 2;
	key = "cube.key";
	dead = 1;
	links = (
	    { node = 0; to = "host"; tcp = "127.0.0.1:$base"; },
	    { node = 3; to = "host"; tcp = "127.0.0.1:$((base + 1))"; },
	    { node = 0; to = 1; tcp = "127.0.0.1:$((base + 2))"; },
	    { node = 0; to = 2; tcp = "127.0.0.1:$((base + 3))"; },
	    { node = 1; to = 3; tcp = "127.0.0.1:$((base + 4))"; },
	    { node = 2; to = 3; tcp = "[::1]:$((base + 5))"; }
	);
END
start_nodes "$scratch/second.cube"
same 'nodes that a user started' --cube "$scratch/second.cube"
same 'the same nodes again' --cube "$scratch/second.cube"
read -r node _ <<< "$nodes"
slowed() {
    rm -f "$scratch/out.npy"
    # clock: longer than a busy machine holds a node up
    incode run "$points" -q --cube "$scratch/second.cube" \
        --patience 10 --host-rate 200000 --host-rate-time "$1" \
        -o "$scratch/out.npy" --stats "$scratch/stats.json" \
        2> "$scratch/errors" &
    host=$!
    await connected "$base" # from the host to node 0
}
# clock: somewhere in the run
at_first=5 amid 'sleep 0.4; kill -0 $host && kill -KILL "$node"'
wait $host
status=$?
check 'links/node 0 lost, by the second wire' \
    "exit $status: $(last "$scratch/errors")" \
    cmp -s "$first" "$scratch/out.npy"
check 'links/node 0 lost in mid-run' 'no generation was begun for it' \
    test "$(stat_of "$scratch/stats.json" generations)" -gt 1
end_nodes

# Nodes that nobody has told who they are, the host's neighbour last.  The first
# hears a node of another cube before: it says so, and goes on listening.
cat > "$scratch/nameless.cube" <<-END
	dimension = 1;
	key = "cube.key";
	links = ( { node = 0; to = "host"; tcp = "127.0.0.1:$((base + 90))"; },
	          { node = 1; to = 0; tcp = "127.0.0.1:$((base + 91))"; } );
END
nameless=
start_nameless() { # NODE
    # shellcheck disable=SC2046
    "$BUILD/"$("$INCODE" cube "$scratch/nameless.cube" | grep -e "--node $1 " |
        sed 's/--node [0-9]* //; s/--dimension [0-9]* //') \
        2> "$scratch/said.$1" &
    nameless="$nameless $!"
}
start_nameless 1
"$BUILD/incode-node" --node 0 --dimension 2 --key "$scratch/cube.key" \
    --wire "0=call:127.0.0.1:$((base + 91))" \
    --wire "1=listen:127.0.0.1:$((base + 92))" \
    --wire "2=listen:127.0.0.1:$((base + 93))" 2> /dev/null &
wrong=$!
await test -s "$scratch/said.1"
kill $wrong
wait $wrong 2> /dev/null
start_nameless 0
same 'nodes that learn who they are' --cube "$scratch/nameless.cube"
check 'links/a wrong greeting is told, once' "$(last "$scratch/said.1")" \
    test "$(grep -c 'a neighbour takes this node for' "$scratch/said.1")" = 1
same 'nodes that learn who they are' --cube "$scratch/nameless.cube"
# shellcheck disable=SC2086
kill $nameless
# shellcheck disable=SC2086
wait $nameless 2> /dev/null

printf 'dimension = 1;\nlinks = (\n{ node = 0; to = 3; };\n' \
    > "$scratch/bad.cube"
"$INCODE" run "$points" --cube "$scratch/bad.cube" 2> "$scratch/errors"
status=$?
check 'links/a bad cube file' "exit $status: $(last "$scratch/errors")" \
    test $status = 3
check 'links/a bad cube file: its line' "$(last "$scratch/errors")" \
    grep -qE "^incode: $scratch/bad.cube:[0-9]+: .*; " "$scratch/errors"
gather
