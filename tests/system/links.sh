#!/usr/bin/env bash
# The same bytes over every kind of wire, also where the wire suffers.
# 10 seconds.
. tests/system/lib.sh

points=$scratch/points.npy
"$INCODE" gen uniform "${CLUSTER_POINTS:-100000}" --seed 2 -o "$points" 2> /dev/null
"$INCODE" run "$points" -q --strategy sequential --nodes 1 \
    -o "$scratch/first.npy" 2> "$scratch/errors"
check 'links/one node' "$(last "$scratch/errors")" \
    test -f "$scratch/first.npy"

# same NAME OPTION...: these options change no byte of the output.
same() {
    local name=$1
    shift
    rm -f "$scratch/out.npy"
    timeout 60 "$INCODE" run "$points" -q --strategy spatial \
        -o "$scratch/out.npy" "$@" 2> "$scratch/errors"
    check "links/$name" "exit $?: $(last "$scratch/errors")" \
        cmp -s "$scratch/first.npy" "$scratch/out.npy"
}
same '8 nodes on sockets' --nodes 8 --link tcp
same '8 nodes on pseudo-terminals' --nodes 8 --link serial
same '8 small nodes on pseudo-terminals' --nodes 8 --link serial \
    --memory 512K
same "the host's end closed and reopened" --nodes 8 --link serial \
    --host-unplug 150
