#!/usr/bin/env bash
# `incode nodes` on cubes of real processes: who is there, what is missing, what
# is wired wrongly, who has the cube.

. tests/system/lib.sh
case $INCODE in /*) ;; *) INCODE=$PWD/$INCODE ;; esac
node=$(dirname "$INCODE")/incode-node
common=(--dimension 2 --memory 1048576 --dead 3000000)

# The cube of each case is in a folder of its own; cases wait at the same time.
begin() {
    mkdir "$scratch/$1" && cd "$scratch/$1" || exit 1
    started=()
    trap 'kill "${started[@]}" 2>/dev/null; wait' EXIT
    {
        printf 'board = "linux"; dimension = 2; memory = "1M"; dead = 3;\n'
        printf 'links = ({ node = 0; to = "host"; unix = "host.socket"; },\n'
        printf '{ node = 0; to = 1; unix = "01.socket"; },\n'
        printf '{ node = 0; to = 2; unix = "02.socket"; },\n'
        printf '{ node = 1; to = 3; unix = "13.socket"; },\n'
        printf '{ node = 2; to = 3; unix = "23.socket"; });\n'
    } > four.cube
}

# start NODE [WIRE]...: as the cube file says, or with these wires.
start() {
    local which=$1 line words=()
    shift
    if [ $# = 0 ]; then
        line=$("$INCODE" cube four.cube | grep -e "--node $which ")
        read -r -a words <<< "${line#incode-node }"
    else
        words=(--node "$which" "${common[@]}")
        for line in "$@"; do words+=(--wire "$line"); done
    fi
    "$node" "${words[@]}" 2>> nodes.log &
    started[which]=$!
}

# told NAME STATUS PATTERN [OPTION]...: the status of `incode nodes`, and a line
# of what it says.
told() {
    local name=$1 wanted=$2 pattern=$3 status
    shift 3
    "$INCODE" nodes "$@" > said 2>&1
    status=$?
    if [ $status != "$wanted" ]; then
        fail "$name" "exit $status, not $wanted: $(last said)"
    elif ! grep -qE -e "$pattern" said; then
        fail "$name" "nobody says $pattern: $(tr '\n' '|' < said)"
    else
        pass "$name"
    fi
}

nobody() {
    begin nobody
    told nodes-none 4 'nodes? 0-?3?: nodes: .*; ' --cube four.cube
    told nodes-twice 2 'named twice' --cube four.cube --unix host.socket
    told nodes-nowhere 2 '--cube FILE' --json
    printf x > port
    for name in port unix; do
        "$INCODE" nodes --json --$name $name > said 2> errors
        jq -e '.command == "nodes" and .status == 4 and
            (.error | contains("'$name'"))' said > /dev/null 2>&1
        status=$?
        check nodes-json-$name "$(tail -c 300 said)|$(last errors)" \
            [ $status = 0 ]
    done
    "$INCODE" console --json < /dev/null > said 2> errors
    jq -e '.status == 2 and (.error | contains("--cube FILE"))' said \
        > /dev/null 2>&1
    status=$?
    check console-json-nowhere "$(tail -c 300 said)|$(last errors)" \
        [ $status = 0 ]
    told nodes-usage 2 'write --cube' four.cube
}

whole() {
    begin whole
    for i in 0 1 2 3; do start $i; done
    told nodes-all 0 '^0-3 +linux +process .* all ' --cube four.cube
    told nodes-again 0 '^0-3 +linux' --cube four.cube
    told nodes-one-wire 0 '^0-3 +linux' --unix host.socket
    told nodes-json 0 '"links_up":3.*"wires":\[\],"status":0' --cube four.cube \
        --json
    # The socket is another user's; root may do as it likes.
    local other=
    [ "$(id -u)" != 0 ] || other='setpriv --reuid 65534 --clear-groups'
    chmod 000 host.socket
    if $other "$INCODE" --version > version 2>&1; then
        $other "$INCODE" nodes --unix host.socket > said 2>&1
        check nodes-no-permission "$(last said)" \
            grep -q 'no permission to use the socket host.socket; ' said
    else
        skip nodes-no-permission 'another user cannot start the program'
    fi
    chmod 700 host.socket
    # Another program has the cube, then a run.
    mkfifo lines
    "$INCODE" console --cube four.cube < lines > console.log 2>&1 &
    local console=$!
    exec 3> lines
    echo nodes >&3
    await grep -q '^0-3 ' console.log
    told nodes-in-use 0 'a look beside incode console .*, which has the cube' \
        --cube four.cube
    exec 3>&-
    wait $console
    "$INCODE" gen uniform 2000 -o points.xyz
    "$INCODE" run points.xyz -o tets.ele --cube four.cube -q --verify \
        2> run.log
    status=$?
    check nodes-run "$(last run.log)" [ $status = 0 ]
    told nodes-after-run 0 '^0-3 +linux' --cube four.cube
    # A node that is off: how to start it.
    kill "${started[3]}"
    wait "${started[3]}" 2>/dev/null
    told nodes-off 4 '^3 +no answer; start it with: incode-node' \
        --cube four.cube
    check nodes-off-links "$(tr '\n' '|' < said)" grep -qE '^1-2 .* 1 of 2 ' said
    start 3
    told nodes-back 0 '^3 +linux .* all ' --cube four.cube
}

no_wire() {
    begin no_wire
    start 0 2=unix-listen:host.socket 0=unix-listen:01.socket \
        1=unix-listen:02.socket
    start 1 0=unix-call:01.socket 1=unix-listen:13.socket
    start 2 1=unix-call:02.socket 0=unix-listen:none.socket
    start 3 1=unix-call:13.socket 0=unix-call:nowhere.socket
    told nodes-no-wire 4 'node 2 link 0 to node 3: the wire has never been up; ' \
        --cube four.cube
}

crossed() {
    begin crossed
    start 0 2=unix-listen:host.socket 0=unix-listen:01.socket \
        1=unix-listen:02.socket
    start 1 0=unix-call:02.socket 1=unix-listen:13.socket
    start 2 1=unix-call:01.socket 0=unix-listen:23.socket
    start 3 1=unix-call:13.socket 0=unix-call:23.socket
    told nodes-crossed 4 'link . is wired to node ., expected node .; put that' \
        --cube four.cube
}

for case in nobody whole no_wire crossed; do
    ($case) &
done
wait
