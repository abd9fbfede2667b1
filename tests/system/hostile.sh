#!/usr/bin/env bash
# A hostile process on this machine that calls whatever the program listens on,
# for a whole run and between runs, changes neither result nor status.
. tests/system/lib.sh
with_faults
umask 077 # for keys
chmod 711 "$scratch" # the unix sockets in it are for others to find

points=$scratch/points.npy
"$INCODE" gen uniform 5000 --seed 3 -o "$points" 2> /dev/null
"$INCODE" run "$points" -q --nodes 1 --stats "$scratch/stats.json"
digest=$(stat_of "$scratch/stats.json" digest)
take_ports

# One run after the other, each slow for a while, that it has to bear it.
same() { # NAME OPTION...
    local name=$1 status
    shift
    rm -f "$scratch/stats.json"
    # clock: no less than that
    incode run "$points" -q --stats "$scratch/stats.json" --host-rate 40000 \
        --host-rate-time 2 "$@" 2> "$scratch/errors"
    status=$?
    check "hostile/$name" "exit $status: $(last "$scratch/errors")" \
        test $status = 0 -a \
        "$(stat_of "$scratch/stats.json" digest 2> /dev/null)" = "$digest"
}

# start_nodes CUBE [SED]: as `incode cube` says, and as changed by that; $nodes.
start_nodes() {
    local line
    nodes=
    while read -r line; do
        # Quoted for a shell.
        eval "exec \"\$BUILD\"/$line" 2> /dev/null < /dev/null &
        nodes="$nodes $!"
    done < <("$INCODE" cube "$1" | grep '^incode-node ' | sed "${2:-}")
}
end_nodes() {
    # shellcheck disable=SC2086
    kill -KILL $nodes 2> /dev/null
    # shellcheck disable=SC2086
    [ -z "$nodes" ] || wait $nodes 2> /dev/null
}

# Where the file lets others in, it is the kernel's word that keeps them out.
let_in() { # SOCKET...
    local socket
    for socket in "$@"; do
        await test -S "$scratch/$socket"
        chmod 666 "$scratch/$socket"
    done
}

"$INCODE" key "$scratch/cube.key" > /dev/null 2> "$scratch/errors"
check hostile/key "$(last "$scratch/errors")" test -s "$scratch/cube.key"

# make_cube FILE WIRE-OF-THE-HOST: half its wires are unix sockets.
make_cube() {
    cat > "$1" <<-END
	dimension = 2;
	key = "cube.key";
	links = (
	    { node = 0; to = "host"; $2; },
	    { node = 0; to = 1; tcp = "127.0.0.1:$((base + 1))"; },
	    { node = 0; to = 2; unix = "$scratch/0-2"; },
	    { node = 1; to = 3; unix = "$scratch/1-3"; },
	    { node = 2; to = 3; tcp = "[::1]:$((base + 2))"; }
	);
END
}
make_cube "$scratch/tcp.cube" "tcp = \"127.0.0.1:$base\""
make_cube "$scratch/unix.cube" "unix = \"$scratch/0-host\""

"$BUILD/tests/stranger" 1 $$ > "$scratch/stranger" &
stranger=$!
same 'nodes of its own' --nodes 8
start_nodes "$scratch/tcp.cube"
same 'nodes that a user started' --cube "$scratch/tcp.cube"
let_in 0-2 1-3
same 'the same nodes again' --cube "$scratch/tcp.cube"
end_nodes
start_nodes "$scratch/unix.cube" 's/--node [0-9]* //; s/--dimension [0-9]* //'
let_in 0-2 1-3 0-host
same 'nodes that learn who they are' --cube "$scratch/unix.cube"
end_nodes
kill $stranger
wait $stranger
check 'hostile/it was' "$(head -n 1 "$scratch/stranger")" grep -qE \
    '^[0-9]{3,} tcp [0-9]{2,} unix calls taken' "$scratch/stranger"
# What there is to call: the wires of both files, and where a run lets others look
# on (host/watch/look.h), one place for each of the host's two wires.  A pair that
# connects nodes of its own has a port of the kernel's choice, for a moment in
# which the stranger may look.
{
    awk -v base="$base" '$1 == "tcp" && $2 >= base && $2 < base + 500' \
        "$scratch/stranger" | sort
    grep '^unix ' "$scratch/stranger" | sort |
        sed -E 's/@incode-look-[0-9a-f]{32}$/@look/'
} > "$scratch/found"
printf '%s\n' "tcp $base" "tcp $((base + 1))" "tcp $((base + 2))" \
    "unix $scratch/0-2" "unix $scratch/0-host" "unix $scratch/1-3" \
    'unix @look' 'unix @look' > "$scratch/all"
check 'hostile/on every socket that listens, and there is no other' \
    "$(tr '\n' ' ' < "$scratch/stranger")" \
    cmp -s "$scratch/found" "$scratch/all"
check 'hostile/and at most one port of a pair' \
    "$(tr '\n' ' ' < "$scratch/stranger")" \
    test "$(grep -c '^tcp ' "$scratch/stranger")" -le 4
