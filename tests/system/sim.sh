#!/usr/bin/env bash
# The simulation: as many seeds as fit its time, the same trace for the same
# seed, faults of every kind, wrong usage, and the planted faults found.
# SIM_SECONDS: of processor time, for the seeds; below 100 there are too few of
# them for every fault to strike, and nothing else is tried.  SIM_FIRST: of them.
. tests/system/lib.sh
SECONDS_MAX=1100
seconds=${SIM_SECONDS:-300}
first=${SIM_FIRST:-1}
said=$scratch/said

incode sim --seeds "$first..$((first + 999999))" --seconds "$seconds" > "$said" 2>&1
status=$?
grep -A 2 'FAILED$' "$said"
grep -A 20 ' seeds, ' "$said"
totals=$(grep ' seeds, .* failed' "$said")
if [ $status = 0 ] && [ -n "$totals" ]; then
    pass "sim/seeds: $totals"
else
    fail sim/seeds "exit $status: ${totals:-$(last "$said")}"
fi
[ "$seconds" -ge 100 ] || exit 0

# struck KIND: in how many seeds.
struck() { awk -v kind="$1" '$1 == kind { print $3 }' "$said" | tail -n 1; }
for kind in loss flip delete insert repeat burst stall one-way cut partition \
    pause crash slow-host tiny dead-wire dead-node missing-wire second-host; do
    check "sim/strikes $kind" "it struck in no seed" \
        [ "$(struck $kind)" -gt 0 ]
done

incode sim --seeds 1..3 > "$scratch/a" 2>&1
incode sim --seeds 1..3 > "$scratch/b" 2>&1
grep '^seed' "$scratch/a" > "$scratch/a.seeds"
grep '^seed' "$scratch/b" > "$scratch/b.seeds"
check sim/repeatable "two runs of one seed differ" \
    cmp -s "$scratch/a.seeds" "$scratch/b.seeds"
check sim/nodes "--nodes 64 did not simulate 64 nodes" \
    grep -q ' 64 nodes' <(incode sim --seed 3 --nodes 64)

refuses sim/no-cube 2 'not a number of nodes' incode sim --nodes 3
refuses sim/no-range 2 'not a range' incode sim --seeds 5
refuses sim/backwards 2 'not a range' incode sim --seeds 9..5

# found NAME: the fault planted in that program is found, and replayed by the
# command that the failure prints.
found() {
    local program=$BUILD/tests/incode-$1 seed
    if ! [ -x "$program" ]; then
        fail "sim/finds $1" "there is no $program; make planted"
        return
    fi
    timeout 1000 "$program" sim --seeds 1..200 --seconds 60 > "$said" 2>&1
    seed=$(sed -n 's/.* replay: .* --seed \([0-9]*\).*/\1/p' "$said" | head -n 1)
    if [ -z "$seed" ]; then
        fail "sim/finds $1" "not found in $(grep -c '^seed' "$said") seeds"
    elif timeout 300 "$program" sim --seed "$seed" > "$said" 2>&1; then
        fail "sim/finds $1" "seed $seed does not replay it"
    else
        pass "sim/finds $1 at seed $seed"
    fi
}
found twice
found lost-batch
