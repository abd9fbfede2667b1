#!/usr/bin/env bash
# `incode run --resume DIR`: a run that is killed goes on, and writes the same
# bytes; so it does if its state is damaged.  A state that is another run's is
# refused, and a disk that takes no more costs nothing of what was kept.
. tests/system/lib.sh

RANDOM=31 kept=$scratch/kept kills=6

size_of_spool() { stat -c %s "$kept/spool" 2> /dev/null || echo 0; }
is_far() { [ "$(size_of_spool)" -ge "$1" ] || ! kill -0 "$2" 2> /dev/null; }

# killed POINTS BYTES OPTION...: a run that is killed as soon as its spool has so
# many bytes.
killed() {
    "$INCODE" run "$1" -q -o "$scratch/part.npy" --resume "$kept" "${@:3}" \
        2> /dev/null &
    await is_far "$2" $!
    kill -KILL $! 2> /dev/null
    wait $! 2> /dev/null
}

# same NAME POINTS OPTION...: a run that succeeds, with the bytes of $whole.
same() {
    rm -f "$scratch/part.npy"
    succeeds "resume/$1" incode run "$2" -o "$scratch/part.npy" \
        --resume "$kept" --stats "$scratch/stats.json" "${@:3}" > /dev/null
    check "resume/$1: bytes" 'they differ' cmp -s "$whole" "$scratch/part.npy"
}

# whole POINTS: what a run without --resume writes.
whole_of() {
    whole=$scratch/whole.npy
    succeeds "resume/$1 without it" incode run "$2" -q -o "$whole"
}

# chain NAME POINTS BYTES OPTION...: a run that is killed again and again, at
# random places of a spool that has so many bytes in the end.
chain() {
    local name=$1 points=$2 each=$(($3 / kills)) resumed bricks i
    shift 3
    for ((i = 0; i < kills; i++)); do
        killed "$points" $((each * i + each * RANDOM / 32768)) "$@"
    done
    same "$name killed $kills times" "$points" "$@"
    resumed=$(stat_of "$scratch/stats.json" resumed_bricks)
    bricks=$(stat_of "$scratch/stats.json" bricks)
    check "resume/$name: work is kept" "$resumed of $bricks bricks" \
        [ "$((resumed * 2))" -ge "$bricks" ]
    check "resume/$name: it says so" "$(cat "$scratch/errors")" \
        grep -q 'resuming: [1-9][0-9]* % of the bricks' "$scratch/errors"
    check "resume/$name: nothing is left" "$(ls "$kept" 2>&1)" [ ! -e "$kept" ]
}

incode gen uniform 600000 --seed 3 -o "$scratch/large.npy"
whole_of threads "$scratch/large.npy"
chain threads "$scratch/large.npy" 60000000
incode gen uniform 100000 --seed 4 -o "$scratch/small.npy"
whole_of 'a cube' "$scratch/small.npy"
chain 'a cube' "$scratch/small.npy" 10000000 --nodes 4 --strategy spatial

# Other threads and less memory go on as well.
killed "$scratch/small.npy" 1000000
same 'other threads and memory' "$scratch/small.npy" --threads 1 \
    --host-memory 32M --scratch "$scratch"

# damage FILE HOW: cuts a file in half, or flips a bit of it.
damage() {
    local size place byte
    size=$(stat -c %s "$1")
    place=$((RANDOM * 32768 % size + RANDOM % 100))
    if [ "$2" = cut ]; then
        truncate -s $((size / 2 + RANDOM % 100)) "$1"
    else
        place=$((place < size ? place : size - 1))
        byte=$(od -An -tu1 -j $place -N 1 "$1")
        printf %b "\\x$(printf %x $((byte ^ 8)))" |
            dd of="$1" bs=1 seek=$place conv=notrunc status=none
    fi
}

# A state that has all, as the output could not be written.
for way in threads cube; do
    options=()
    [ $way = cube ] && options=(--nodes 4 --strategy exchange)
    exits "resume/$way: an output that fails" 3 incode run "$scratch/small.npy" \
        -o - --resume "$kept" "${options[@]}" > /dev/full
    check "resume/$way: it says how to go on" "$(last "$scratch/errors")" \
        grep -q "$kept: the same command goes on" "$scratch/errors"
    mv "$kept" "$scratch/all" 2> /dev/null
    for file in state order spool; do
        for how in cut flip; do
            rm -rf "$kept"
            cp -rp "$scratch/all" "$kept" && damage "$kept/$file" $how
            same "$way: $file, $how" "$scratch/small.npy" "${options[@]}"
        done
    done
    rm -rf "$kept"
    mv "$scratch/all" "$scratch/all of $way" 2> /dev/null
done

# A run on threads that has all.
mv "$scratch/all of threads" "$kept" 2> /dev/null
before=$(cat "$kept"/* | cksum)
incode gen uniform 100000 --seed 5 -o "$scratch/other.npy"
exits 'resume/other points' 3 incode run "$scratch/other.npy" -q --resume "$kept"
check 'resume/other points: message' "$(last "$scratch/errors")" \
    grep -q "state: belongs to another run (the points' digest .* there, .* now); give" \
    "$scratch/errors"
exits 'resume/other options' 2 incode run "$scratch/small.npy" -q \
    --resume "$kept" --nodes 2
check 'resume/other options: message' "$(last "$scratch/errors")" \
    grep -q '(a run on threads there, nodes now)' "$scratch/errors"
check 'resume/refused: nothing has changed' "$(ls -l "$kept")" \
    [ "$(cat "$kept"/* | cksum)" = "$before" ]

exits 'resume/an output in its place' 2 incode run "$scratch/small.npy" -q \
    --resume "$kept" --stats "$kept/spool"
check 'resume/an output in its place: nothing has changed' "$(ls -l "$kept")" \
    [ "$(cat "$kept"/* | cksum)" = "$before" ]

# A process that has the folder, and waits for the reader of its output.
mkfifo "$scratch/pipe"
exec {pipe}<> "$scratch/pipe"
"$INCODE" run "$scratch/small.npy" -q -o - --resume "$kept" \
    > "$scratch/pipe" 2> /dev/null &
waits() { grep -q pipe "/proc/$1/wchan" || ! kill -0 "$1"; } 2> /dev/null
await waits $!
exits 'resume/a second process' 3 incode run "$scratch/small.npy" -q \
    --resume "$kept"
check 'resume/a second process: message' "$(last "$scratch/errors")" \
    grep -q "$kept: is in use by another run; wait" "$scratch/errors"
kill -TERM $! 2> /dev/null
wait $! 2> /dev/null
exec {pipe}>&-
same 'after a process that was ended' "$scratch/small.npy"

# A disk without room, in the midst of it.
exits 'resume/full' 3 bash -c 'ulimit -f 6000; exec "$@"' - "$INCODE" run \
    "$scratch/small.npy" --resume "$kept" --nodes 4 --strategy spatial
check 'resume/full: message' "$(last "$scratch/errors")" \
    grep -q 'spool: cannot be written .*; make room, and give' "$scratch/errors"
same 'full before' "$scratch/small.npy" --nodes 4 --strategy spatial
check 'resume/full before: work is kept' \
    "$(stat_of "$scratch/stats.json" resumed_bricks)" \
    [ "$(stat_of "$scratch/stats.json" resumed_bricks)" -gt 100 ]

# A signal says how to go on.
"$INCODE" run "$scratch/large.npy" -q -o "$scratch/part.npy" --resume "$kept" \
    2> "$scratch/said" &
await is_far 1 $!
kill -TERM $! 2> /dev/null
wait $! 2> /dev/null
check 'resume/terminated: it says how to go on' "$(cat "$scratch/said")" \
    grep -q "the same command goes on from what is in $kept" "$scratch/said"
rm -rf "$kept"

# Folders that are none, or are not this user's alone.
: > "$scratch/file"
exits 'resume/no folder' 3 incode run "$scratch/small.npy" -q \
    --resume "$scratch/file"
check 'resume/no folder: message' "$(last "$scratch/errors")" \
    grep -q 'file: .*; give another place' "$scratch/errors"
mkdir -m 755 "$scratch/open"
exits 'resume/an open folder' 3 incode run "$scratch/small.npy" -q \
    --resume "$scratch/open"
check 'resume/an open folder: message' "$(last "$scratch/errors")" \
    grep -q 'can be entered by other users' "$scratch/errors"
exits 'resume/--table' 2 incode run "$scratch/small.npy" -q --nodes 2 --table \
    --resume "$kept"
