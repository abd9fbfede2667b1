#!/usr/bin/env bash
# 5,000 seeds, over the first 1,000 of which every kind of fault strikes at
# least 100 times while work is open, the largest cube, and the small run with
# each single frame and each restart.  An hour and a half of one processor.
SECONDS_MAX=20000
. tests/system/lib.sh
said=$scratch/said

# seeds FIRST LAST
seeds() {
    incode sim --seeds "$1..$2" > "$said" 2>&1
    local status=$?
    grep -A 2 'FAILED$' "$said"
    check "simulation/seeds $1 to $2" "exit $status: $(last "$said")" \
        [ $status = 0 ]
}

seeds 1 1000
tail -n 19 "$said"
for kind in loss flip delete insert repeat burst stall one-way cut partition \
    pause crash slow-host tiny dead-wire dead-node missing-wire second-host; do
    strikes=$(awk -v kind="$kind" '$1 == kind { print $2 }' "$said" | tail -n 1)
    check "simulation/strikes $kind" "only ${strikes:-0} times" \
        [ "${strikes:-0}" -ge 100 ]
done
seeds 1001 5000

# 90 s, 550 MB.
incode sim --seed 1 --nodes 1024 > "$said" 2>&1
status=$?
check 'simulation/1,024 nodes' "exit $status: $(last "$said")" \
    [ $status = 0 ]
check 'simulation/they were so many' "$(head -n 1 "$said")" \
    grep -q ' 1024 nodes' "$said"

INCODE_SIM_STRIDE=1 within "$BUILD/tests/test_sim" > "$said" 2>&1
status=$?
check 'simulation/each frame' "exit $status: $(last "$said")" [ $status = 0 ]
grep ' runs' "$said"
