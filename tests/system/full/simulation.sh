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
fault_table "$said" > "$scratch/kinds"
cat "$scratch/kinds"
while read -r kind strikes _; do
    check "simulation/strikes $kind" "only $strikes times" [ "$strikes" -ge 100 ]
done < "$scratch/kinds"
check simulation/kinds "a kind of fault is not in the table" \
    [ "$(wc -l < "$scratch/kinds")" -ge 20 ]
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
