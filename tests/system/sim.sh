#!/usr/bin/env bash
# The simulation: seeds that together meet every kind of fault, as many fresh
# ones as fit its time, the same trace for the same seed, wrong usage, and the
# planted faults found.
# SIM_SECONDS: of processor time, for fresh seeds.  SIM_FIRST: of them.
# SIM_SEEDS=only: nothing else is tried.
SECONDS_MAX=3600
. tests/system/lib.sh
seconds=${SIM_SECONDS:-25}
first=${SIM_FIRST:-1}
said=$scratch/said

# Each kind of fault strikes in eight of these at least, in a few seconds of
# processor time in all.  Where a change of the protocol leaves one out, more
# are found by `incode sim --seeds 1..400`, whose lines say what struck.
fixed=(19 21 23 26 35 37 38 43 59 61 63 67 79 91 92 96 97 100 121 126 131 135
    139 150 161 169 175 182 183 189 200 204 206 211 213 215 217 218 229 245 246
    248 254 258 278 280 282 286 309 318 343 350 358 366 203096 203402)

# seeds NAME ARGUMENT...: they all come to the right result.
seeds() {
    local name=$1 status totals
    shift
    incode sim "$@" > "$said" 2>&1
    status=$?
    grep -A 2 'FAILED$' "$said"
    sed -n '/ seeds, /,$p' "$said"
    totals=$(grep ' seeds, .* failed' "$said")
    if [ $status = 0 ] && [ -n "$totals" ]; then
        pass "sim/$name: $totals"
    else
        fail "sim/$name" "exit $status: ${totals:-$(last "$said")}"
    fi
}

# However slow the machine is, these are run to their end.
# shellcheck disable=SC2046
seeds fixed $(printf ' --seed %s' "${fixed[@]}")
fault_table "$said" > "$scratch/kinds"
while read -r kind _ struck; do
    check "sim/strikes $kind" "it struck in no seed" [ "$struck" -gt 0 ]
done < "$scratch/kinds"
check sim/kinds "a kind of fault is not in the table" \
    [ "$(wc -l < "$scratch/kinds")" -ge 20 ]

seeds fresh --seeds "$first..$((first + 999999))" --seconds "$seconds"
[ "${SIM_SEEDS:-}" = only ] && exit

incode sim --seeds 1..3 > "$scratch/a" 2>&1
incode sim --seeds 1..3 > "$scratch/b" 2>&1
grep '^seed' "$scratch/a" > "$scratch/a.seeds"
grep '^seed' "$scratch/b" > "$scratch/b.seeds"
check sim/repeatable "two runs of one seed differ, or there is none" eval \
    'cmp -s "$scratch/a.seeds" "$scratch/b.seeds" && [ -s "$scratch/a.seeds" ]'
check sim/nodes "--nodes 64 did not simulate 64 nodes" \
    grep -q ' 64 nodes' <(incode sim --seed 3 --nodes 64)

incode sim --seed 7 > "$said" 2>&1
check sim/rate "$(grep 'in ours' "$said")" \
    grep -qE ' in ours$| [1-9][0-9]*\.[0-9] in ours, ' "$said"

refuses sim/no-cube 2 'not a power of two' incode sim --nodes 3
refuses sim/no-range 2 'not a range' incode sim --seeds 5
refuses sim/backwards 2 'not a range' incode sim --seeds 9..5

# found NAME [SEEDS]: the fault planted in that program is found, in 40 seeds or
# these, and replayed by the command that the failure prints.
found() {
    local program=$BUILD/tests/incode-$1 seed
    if ! [ -x "$program" ]; then
        fail "sim/finds $1" "there is no $program; make planted"
        return
    fi
    within "$program" sim --seeds "${2:-1..40}" > "$said" 2>&1
    seed=$(sed -n 's/.* replay: .* --seed \([0-9]*\).*/\1/p' "$said" | head -n 1)
    if [ -z "$seed" ]; then
        fail "sim/finds $1" "not found in $(grep -c '^seed' "$said") seeds"
    elif within "$program" sim --seed "$seed" > "$said" 2>&1; then
        fail "sim/finds $1" "seed $seed does not replay it"
    else
        pass "sim/finds $1 at seed $seed"
    fi
}
found twice
found lost-batch
found answer
found taken-by-two
found kept
found late 1..200
found untrimmed 92..96
