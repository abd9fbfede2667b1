#!/usr/bin/env bash
# More points than the nodes' memories hold, and a vertex of huge degree.
. tests/system/lib.sh

million=$scratch/million.npy
"$INCODE" gen uniform 1000000 --seed 1 -o "$million" 2> /dev/null
succeeds 'large/1,000,000 points on one node' "$INCODE" run "$million" -q \
    --strategy sequential --nodes 1 --memory 4M --stats "$scratch/one.json"
succeeds 'large/1,000,000 points on 8 nodes, verified' "$INCODE" run \
    "$million" -q --strategy spatial --nodes 8 --memory 4M --verify \
    --stats "$scratch/eight.json"
check 'large/the same digest' 'another digest' \
    test "$(stat_of "$scratch/one.json" digest)" = \
    "$(stat_of "$scratch/eight.json" digest)"
evictions=$(jq '[.per_node[].page_evictions] | add' "$scratch/eight.json")
check 'large/pages were evicted' "$evictions evictions" \
    test "$evictions" -gt 0
waits=$(jq '([.per_node[].vertices_waited] | add) /
    ([.per_node[].vertices] | add)' "$scratch/eight.json")
check 'large/fewer than 2 % of the vertices wait for a page' "$waits" \
    jq -en "$waits < 0.02"
traffic=$(jq '([.per_node[].page_bytes] | add) / (24 * .distinct_points)' \
    "$scratch/eight.json")
check "large/page traffic under 3 times the regions' points" "$traffic" \
    jq -en "$traffic < 3"
memory=$(jq '[.per_node[].memory_high_water_bytes] | max' \
    "$scratch/eight.json")
check 'large/no node over 4 MiB' "$memory bytes" test "$memory" -le 4194304
rm -f "$million"

hub=$scratch/hub.npy
"$INCODE" gen hub 200000 --seed 1 -o "$hub" 2> /dev/null
succeeds 'large/hub of 200,000 on one node' "$INCODE" run "$hub" -q \
    --strategy sequential --nodes 1 --memory 4M --stats "$scratch/one.json"
succeeds 'large/hub of 200,000 on 8 nodes, verified' "$INCODE" run "$hub" -q \
    --strategy spatial --nodes 8 --memory 4M --verify \
    --stats "$scratch/eight.json"
check 'large/the same digest of hub' 'another digest' \
    test "$(stat_of "$scratch/one.json" digest)" = \
    "$(stat_of "$scratch/eight.json" digest)"
spilled=$(jq '[.per_node[].afl_spilled] | add' "$scratch/one.json")
echo "hub: $spilled faces spilled on one node"
