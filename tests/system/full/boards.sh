#!/usr/bin/env bash
# Bare boards, emulated, with sets whose digests are known and with more points
# and nodes: each within its time, which is stated.
. tests/system/lib.sh
with_faults

if [ ! -r "$BUILD/firmware/mps2-an500.img" ]; then
    fail boards "there is no $BUILD/firmware: make firmware"
    exit 1
fi
stats=$scratch/stats.json
errors=$scratch/errors

# digest_of FILE: the native one.
digest_of() {
    incode run "$1" -q --nodes 1 --stats "$stats" && stat_of "$stats" digest
}

# computes NAME SECONDS FILE DIGEST OPTION...: with that digest in that time,
# without a warning.
computes() {
    local name=boards/$1 seconds=$2 file=$3 digest=$4 status took
    shift 4
    rm -f "$stats"
    incode run "$file" --no-progress -q --stats "$stats" "$@" 2> "$errors"
    status=$?
    if [ $status != 0 ]; then
        fail "$name" "exit $status: $(last "$errors")"
        return
    fi
    took=$(stat_of "$stats" time_total_s)
    check "$name" "digest $(stat_of "$stats" digest), not $digest" \
        [ "$(stat_of "$stats" digest)" = "$digest" ]
    check "$name: in $seconds s" "$took s" [ "${took%.*}" -lt "$seconds" ]
    check "$name: nobody is lost" "$(jq -c 'del(.per_node)' "$stats")" \
        [ "$(stat_of "$stats" nodes_lost+.node_restarts)" = 0 ]
    check "$name: nothing overran, no stack was used up" \
        "$(jq -c .per_node "$stats")" \
        [ "$(stat_of "$stats" 'per_node | all(.overruns == 0 and
            .stack_high_water_bytes < .stack_bytes)')" = true ]
}

for points in 500 5000 20000; do
    "$INCODE" gen uniform $points --seed 1 -o "$scratch/$points.npy" \
        2> /dev/null
done
small=$(digest_of "$scratch/500.npy")
for board in mps2-an500 mps2-an385 icicle; do
    for points in 500 5000; do
        computes "$board $points" 120 "$scratch/$points.npy" \
            "$(digest_of "$scratch/$points.npy")" --board $board --nodes 4
    done
    computes "$board 500 spatial" 120 "$scratch/500.npy" "$small" \
        --board $board --nodes 4 --strategy spatial
    while read -r set file points _ _ digest; do
        case $set in
        cactus | deg_cgal_lp500 | deg_octahedron) ;;
        *) continue ;;
        esac
        if [ -n "$(no_set "$file" "$points")" ]; then
            skip "boards/$board $set" "$(no_set "$file" "$points")"
            continue
        fi
        computes "$board $set" 120 "$INCODE_DATA/$file" "sha256:$digest" \
            --board $board --nodes 4
    done < <(list_sets 2> /dev/null)
    for strategy in exchange master-slaves hybrid linda; do
        computes "$board $strategy" 300 "$scratch/500.npy" "$small" \
            --board $board --nodes 4 --strategy $strategy
    done
    for index in naive grid; do
        computes "$board $index" 300 "$scratch/500.npy" "$small" \
            --board $board --nodes 2 --index $index
    done
done
computes '16 nodes' 120 "$scratch/500.npy" "$small" --board mps2-an385 \
    --nodes 16
computes '16 nodes, spatial' 120 "$scratch/500.npy" "$small" \
    --board mps2-an385 --nodes 16 --strategy spatial
big=$(digest_of "$scratch/20000.npy")
computes '20000' 600 "$scratch/20000.npy" "$big" --board mps2-an500 --nodes 4
computes '20000, spatial' 600 "$scratch/20000.npy" "$big" --board mps2-an500 \
    --nodes 4 --strategy spatial
for nodes in 1 2; do
    computes "raspi3b, $nodes" 120 "$scratch/500.npy" "$small" \
        --board raspi3b --nodes $nodes
done

# All kinds of trouble in one run.
incode run "$scratch/5000.npy" --no-progress -q --board mps2-an500 --nodes 4 \
    --strategy spatial --board-reset 7000 --board-stop 5000 \
    --board-kill 11000 --stats "$stats" 2> "$errors"
check 'boards/trouble' "$(last "$errors"): $(jq -c 'del(.per_node)' "$stats")" \
    [ "$(stat_of "$stats" digest)" = "$(digest_of "$scratch/5000.npy")" ]
