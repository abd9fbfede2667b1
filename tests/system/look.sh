#!/usr/bin/env bash
# Others look on at a run of two processes: who has the cube, figures that grow,
# what is not to be touched, lookers that are killed or too many.  A node that
# stands still holds the run for as long as it takes to look, and two looks at
# nodes at work take a small part of what is to be done.
. tests/system/lib.sh
[[ $INCODE = /* ]] || INCODE=$PWD/$INCODE
node=$(dirname "$INCODE")/incode-node
cd "$scratch" || exit 1
started=() lookers=() lines=() host=
trap '{ kill -CONT "${started[@]}"; kill "${started[@]}" $host "${lookers[@]}"
    wait; } 2> /dev/null; rm -rf "$scratch"' EXIT

# A node that is lost is never given up: it stands still, and no harm is done.
printf '%s\n' 'board = "linux"; dimension = 1; memory = "1M"; dead = 0;' \
    'links = ({ node = 0; to = "host"; unix = "host.socket"; },' \
    '{ node = 0; to = 1; unix = "01.socket"; });' > lab.cube
for i in 0 1; do
    line=$(incode cube lab.cube | grep -e "--node $i ")
    read -r -a words <<< "${line#incode-node }"
    "$node" "${words[@]}" 2>> nodes.log &
    started[i]=$!
done
incode gen uniform 100000 --seed 1 -o points.npy 2> errors
incode run points.npy -q --cube lab.cube --stats alone.json 2> errors
check 'look/nobody looks' "$(last errors)" test -s alone.json

hold() { kill -STOP "${started[@]}"; }
go_on() { kill -CONT "${started[@]}"; }
# brake: they work for a tenth of the time, in slices that are short beside a
# look; $brake.
mkfifo never
exec {never}<> never
# clock: shares of time, whatever else runs.
nap() { read -r -t "$1" -u "$never"; }
brake() {
    while :; do
        hold
        nap 0.045
        go_on
        nap 0.005
    done &
    brake=$!
}
end_brake() { { kill "$brake"; wait "$brake"; } 2> /dev/null; }
console() { incode console --cube lab.cube "$@"; }

# looker NUMBER: a console that stays; `asked` types at it.
looker() {
    local end
    rm -f "lines$1"
    mkfifo "lines$1"
    "$INCODE" console --json --cube lab.cube < "lines$1" > "looker$1" \
        2> "looker$1.errors" &
    lookers[$1]=$!
    exec {end}> "lines$1"
    lines[$1]=$end
}
answers() { [ "$(wc -l < "looker$1")" -ge "$2" ]; } # NUMBER COUNT
# asked NUMBER LINE: until the console has answered.
asked() {
    local count
    count=$(wc -l < "looker$1")
    echo "$2" >&"${lines[$1]}"
    await answers "$1" $((count + 1))
}
# built: by both, as of the first looker's last answer.
built() { tail -n 1 looker1 | jq '[.nodes[].tetrahedra_built] | add // 0'; }
# grown FROM: another look, until there is more; false: the run has ended.
grown() {
    asked 1 stat
    [ "$(built)" -gt "$1" ]
}
ahead() { grown "$1" || ! kill -0 $host 2> /dev/null; } # FROM

# --- figures grow ---------------------------------------------------------------

hold # before they are up, that nothing begins before somebody looks
"$INCODE" run points.npy --no-progress --verify --cube lab.cube \
    --patience 900 --stats stats.json -o out.npy > said 2> run.errors &
host=$!
await lets_look $host
has="run points.npy .*, process $host of [^ ]*, since "
looker 1
brake
await ahead 0
first=$(built)
await ahead "$first"
second=$(built)
check 'look/figures grow' "from $first to $second" \
    test "$first" -gt 0 -a "$second" -gt "$first"

# --- what is shown --------------------------------------------------------------

# shows WORD COMMAND...: of both nodes.
shows() {
    "${@:2}" > told 2> errors
    status=$?
    check "look/$1" "exit $status: $(last errors)" [ $status = 0 ]
    check "look/$1: of both" "$(last told)" grep -qE '^ *(0|0-1)[ :]' told
}
for word in stat top links memory nodes log; do
    shows $word console -c $word
done
shows 'incode nodes' incode nodes --cube lab.cube
check 'look/incode nodes: who has the cube' "$(last errors)" \
    grep -q "^incode: nodes: a look beside incode $has" errors
end_brake
hold
check 'look/the run is there' "$(last run.errors)" kill -0 $host

# --- what is not to be touched --------------------------------------------------

for line in 'reset 0' 'ping 0' 'trace 0 1'; do
    refuses "look/not to be touched: $line" 4 \
        "^incode: ${line%% *}: incode $has.* has the cube; look on with " \
        console -c "$line"
done
refuses 'look/no second run' 4 "host.socket: in use by incode $has.*; wait" \
    console -c 'run points.npy -o left/no.npy'
refuses 'look/not to be ended' 2 \
    '^incode: abort: this console has begun no run; ' console -c abort
# --- lookers that are killed, or too many ---------------------------------------

# looks NUMBER: it has begun a look, or ended one.
looks() { is_looking "$1" || answers "$1" $((count + 1)); }
is_looking() {
    [ -n "$(find "/proc/${lookers[$1]}/fd" -lname 'socket:*' 2> /dev/null)" ]
}
# stays NUMBER: a console that is stopped in the midst of a look, which has its
# place; false: it was over by then.
stays() {
    local count
    kill -CONT "${lookers[$1]}"
    count=$(wc -l < "looker$1")
    echo stat >&"${lines[$1]}"
    await looks "$1"
    kill -STOP "${lookers[$1]}"
    await is_stopped "${lookers[$1]}"
    is_looking "$1"
}
is_stopped() { grep -q '^State:	T' "/proc/$1/status"; }

for i in 1 2 3 4; do
    [ $i = 1 ] || looker $i
    check "look/looker $i" "$(last looker$i.errors)" await stays $i
done
refuses 'look/a fifth' 4 \
    "^incode: .*process $host .*: four programs look on already; " \
    console -c 'stat 0'
{
    kill -KILL "${lookers[2]}" "${lookers[3]}"
    wait "${lookers[2]}" "${lookers[3]}"
} 2> /dev/null
brake
fifth() { console -c stat > told 2> errors; }
check 'look/in the place of one that was killed' "$(last errors)" await fifth
kill -CONT "${lookers[1]}" "${lookers[4]}"
for i in 1 4; do
    asked $i stat
    check "look/looker $i goes on" "$(last looker$i.errors)" \
        test "$(tail -n 1 looker$i | jq .status)" = 0
done
end_brake
check 'look/the run is there still' "$(last run.errors)" kill -0 $host

# --- the run is as one at which nobody looks ------------------------------------

go_on
wait $host
status=$?
host=
check 'look/the run' "exit $status: $(last run.errors)" [ $status = 0 ]
check 'look/verified' "$(last said)" grep -q '; verified$' said
for figure in digest nodes_lost generations node_restarts; do
    check "look/the same $figure" "$(stat_of stats.json $figure)" \
        test "$(stat_of stats.json $figure)" = "$(stat_of alone.json $figure)"
done
asked 4 'ping 1' # it has the cube now
check 'look/whom the run leaves the cube' "$(last looker4)" \
    test "$(tail -n 1 looker4 | jq .status)" = 0
