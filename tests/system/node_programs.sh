#!/usr/bin/env bash
# The node programs of make nodes, for boards with Linux: that they hold what a
# node may hold and no allocator, and that some of each processor, run by QEMU,
# are one cube whose result is right.  PROCESSORS: which, 2 or all 4 of them.
. tests/system/lib.sh
took=$SECONDS

read -r -a processors <<< "${PROCESSORS:-aarch64 armhf}"
kinds=${#processors[@]}
"${MAKE:-make}" --no-print-directory BUILD="$BUILD" -j "$(nproc)" \
    "${processors[@]/#/$BUILD/nodes/incode-node-}" > "$scratch/said" 2>&1
status=$?
if [ $status != 0 ] && grep -q 'look at the network' "$scratch/said"; then
    skip node_programs/build "$(grep 'look at the network' "$scratch/said" | tail -n 1)"
    exit 0
fi
cat "$scratch/said"
check node_programs/build "exit $status: $(last "$scratch/said")" [ $status = 0 ]
[ $status = 0 ] || exit 0

# Nodes take turns in the processors; this machine's own needs no emulator.
emulator() {
    [ "$1" = "$(uname -m)" ] && echo exec && return
    echo "qemu-${1/armhf/arm}-static"
}
for processor in "${processors[@]}"; do
    command -v "$(emulator "$processor")" > /dev/null && continue
    skip node_programs/run "$(emulator "$processor") is missing; make deps installs it"
    exit 0
done
{
    echo 'dimension = 3; links = ( { node = 0; to = "host"; unix = "host"; }'
    for node in {0..7}; do
        for to in $((node ^ 1)) $((node ^ 2)) $((node ^ 4)); do
            [ "$node" -gt $to ] ||
                echo ", { node = $node; to = $to; unix = \"$node-$to\"; }"
        done
    done
    echo ');'
} > "$scratch/eight.cube"
all=()
for node in {0..7}; do
    processor=${processors[node % kinds]}
    # shellcheck disable=SC2016
    emulator=$(emulator "$processor")
    [ "$emulator" = exec ] || emulator="exec $emulator -d page -D \$scratch/$node.map"
    eval "$emulator \
        \"\$BUILD/nodes/\"$("$INCODE" cube "$scratch/eight.cube" |
        grep -e " --node $node " |
        sed "s/^incode-node/incode-node-$processor/")" \
        2> "$scratch/$node.errors" < /dev/null &
    all+=($!)
done
"$INCODE" gen uniform 2000 --seed 5 -o "$scratch/points.npy"
"$INCODE" run -q "$scratch/points.npy" --nodes 1 -o "$scratch/one.npy"
succeeds node_programs/run incode run -q "$scratch/points.npy" --strategy spatial \
    --cube "$scratch/eight.cube" --verify -o "$scratch/out.npy" \
    --stats "$scratch/stats.json"
check 'node_programs/the same bytes' 'the output differs' \
    cmp -s "$scratch/one.npy" "$scratch/out.npy"
check 'node_programs/each took part' "$(cat "$scratch"/?.errors)" test \
    "$(jq '[.per_node[] | select(.tetrahedra_built > 0)] | length' \
        "$scratch/stats.json")" = 8
for ((node = 0; node < kinds; node++)); do
    [ -e "$scratch/$node.map" ] || cp "/proc/${all[node]}/smaps" "$scratch/"
done
kill "${all[@]}" 2> /dev/null
wait "${all[@]}" 2> /dev/null

# What the program may write to, as the kernel has it; as the emulator has it,
# but for its stack, for which there are 64 KiB.
writable() {
    awk '/^page layout/ { n = 0 }
        $1 == "start_stack" { stack = substr($2, 3) }
        $1 ~ /^[0-9a-f]+-/ && $3 ~ /w/ {
            split($1, at, "-"); from[n] = at[1]; to[n] = at[2]; size[n++] = $2 }
        END {
            print "0x10000"
            for (i = 0; i < n; i++)
                if (!(from[i] "" <= stack && stack < to[i] ""))
                    print "0x" size[i]
        }' "$1" | { sum=0; while read -r size; do sum=$((sum + size)); done
        echo $((sum)); }
}
for ((node = 0; node < kinds; node++)); do
    if [ -e "$scratch/$node.map" ]; then
        bytes=$(writable "$scratch/$node.map")
    else
        bytes=$(awk '/^[0-9a-f]+-[0-9a-f]+ / { writes = $2 ~ /w/ }
            /^Size:/ && writes { n += $2 * 1024 } END { print n + 0 }' \
            "$scratch/smaps")
    fi
    check "node_programs/memory on ${processors[node]}" "$bytes bytes, not 4194304" \
        test "$bytes" -gt 4000000 -a "$bytes" -le 4194304
done
echo "$((SECONDS - took)) s"
