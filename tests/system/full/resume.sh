#!/usr/bin/env bash
# A run of a million points that is killed at 30 moments, each time from its
# start, goes on and writes the same bytes.  Of threads, all regions that were
# finished count: what is done again are those in flight.
. tests/system/lib.sh

RANDOM=${SEED:-31} kept=$scratch/kept points=$scratch/points.npy kills=30

size_of_spool() { stat -c %s "$kept/spool" 2> /dev/null || echo 0; }
is_far() { [ "$(size_of_spool)" -ge "$1" ] || ! kill -0 "$2" 2> /dev/null; }

incode gen uniform 1000000 --seed 8 -o "$points"
succeeds 'resume/without it' incode run "$points" -q -o "$scratch/whole.npy"

for ((i = 0; i < kills; i++)); do
    options=(--threads 2)
    [ $((i % 3)) = 2 ] && options=(--nodes 4)
    "$INCODE" run "$points" -q -o "$scratch/part.npy" --resume "$kept" \
        "${options[@]}" 2> /dev/null &
    await is_far $((RANDOM * 3200)) $!
    kill -KILL $! 2> /dev/null
    wait $! 2> /dev/null
    # Whole records: each begins with its magic number.
    records=$(grep -aob incjrnl1 "$kept/spool" 2> /dev/null | wc -l)
    rm -f "$scratch/part.npy"
    succeeds "resume/$i" incode run "$points" -q -o "$scratch/part.npy" \
        --resume "$kept" --stats "$scratch/stats.json" "${options[@]}"
    check "resume/$i: bytes" 'they differ' \
        cmp -s "$scratch/whole.npy" "$scratch/part.npy"
    check "resume/$i: nothing is left" "$(ls "$kept" 2>&1)" [ ! -e "$kept" ]
    resumed=$(stat_of "$scratch/stats.json" resumed_bricks)
    bricks=$(stat_of "$scratch/stats.json" bricks)
    # A region of two threads has an eighth of the bricks.
    if [ "${options[0]}" = --threads ]; then
        check "resume/$i: all regions count" "$resumed bricks, $records regions" \
            [ "$(((resumed * 8 + bricks / 2) / bricks))" = "$records" ]
    else
        check "resume/$i: commits count" "$resumed bricks, $records records" \
            [ $((resumed > 0 || records == 0)) = 1 ]
    fi
done
