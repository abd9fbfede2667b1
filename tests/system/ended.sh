#!/usr/bin/env bash
# A run that is ended says so in one line, with what it leaves, and ends with
# the signal's status.
. tests/system/lib.sh

has_open() { # PID FILE
    readlink "/proc/$1/fd/"* | grep -qFx "$(realpath "$2")"
} 2> /dev/null

# ended NAME SIGNAL STATUS LINE [OPTION...]: of a run that waits for its points.
ended() {
    local name=$1 signal=$2 status=$3 line=$4 points=$scratch/points.xyz run
    local found
    shift 4
    rm -f "$points"
    mkfifo "$points"
    env --default-signal=INT "$INCODE" run "$points" "$@" \
        2> "$scratch/errors" > "$scratch/output" &
    run=$!
    exec {hold}<> "$points" # does not wait for the run, which waits for more
    await has_open $run "$points"
    kill -s "$signal" $run
    wait $run
    found=$?
    check "ended/$name/status" "$found, not $status" [ $found = "$status" ]
    exec {hold}>&-
    check "ended/$name/line" "it says: $(cat "$scratch/errors")" \
        [ "$(cat "$scratch/errors")" = "$line" ]
}
none='no output was written'
ended interrupted INT 130 "incode: interrupted; $none" -o "$scratch/o.vtu"
ended terminated TERM 143 "incode: terminated; $none" -o "$scratch/o.ele" \
    --stats "$scratch/o.json"
ended without-output INT 130 'incode: interrupted'
check ended/leaves-nothing "$(ls "$scratch")" \
    [ -z "$(find "$scratch" -name 'o.*')" ]
