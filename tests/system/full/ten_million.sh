#!/usr/bin/env bash
# 10,000,000 points on nodes of 4 MiB: the digest of one node's run, verified,
# in bounded time a point and bounded memory of the host.
. tests/system/lib.sh

run() { # N NAME [OPTION...]
    local points=$scratch/$1.npy name=$2
    shift 2
    succeeds "ten million/$name" "$INCODE" run "$points" -q --memory 4M \
        --stats "$scratch/$name.json" "$@"
}
stat() { stat_of "$scratch/$1.json" "$2"; }

for n in 1000000 10000000; do
    "$INCODE" gen uniform $n --seed 1 -o "$scratch/$n.npy" 2> /dev/null
done
run 1000000 '1M on 8 nodes' --strategy spatial --nodes 8
run 10000000 '10M on 8 nodes' --strategy spatial --nodes 8
run 10000000 '10M on one node' --strategy sequential --nodes 1
check 'ten million/digest of one node' 'another digest' \
    test "$(stat '10M on 8 nodes' digest)" = "$(stat '10M on one node' digest)"

ratio=$(jq -n "$(stat '10M on 8 nodes' time_triangulation_s) / 10 /
    $(stat '1M on 8 nodes' time_triangulation_s)")
check 'ten million/time a point at most 1.5 times that of 1M' "$ratio times" \
    jq -en "$ratio <= 1.5"
echo "time a point, 10M against 1M: $ratio"

peak=$(stat '10M on 8 nodes' host_peak_bytes)
tetrahedra=$(stat '10M on 8 nodes' tetrahedra)
check "ten million/host's peak memory" "$peak bytes" \
    test "$peak" -le $((100 * 10000000 + 16 * tetrahedra))
echo "host: $peak bytes; bound $((100 * 10000000 + 16 * tetrahedra))"

run 10000000 '10M on 8 nodes, verified' --strategy spatial --nodes 8 --verify
