#!/usr/bin/env bash
# The console on a pseudo-terminal, as a person sees it, and without one, as a
# script has it: completion, resizing, Ctrl-C, a paste of 10,000 lines, a board
# that talks garbage, runs beside it, exit statuses.
. tests/system/lib.sh
with_faults
program=$(readlink -f "$INCODE")
tool=$(readlink -f "${BABBLE:-$BUILD/tests/babble}")
here=$scratch/here
mkdir -p "$here" && cd "$here" || exit 1
export XDG_STATE_HOME=$here/state XDG_RUNTIME_DIR=$here

"$program" gen uniform 2000 -o points.npy 2> /dev/null
# Enough for a run that lasts until it is ended, and leaves room for answers.
"$program" gen uniform 20000 -o many.npy 2> /dev/null
cat > four.cube <<'END'
dimension = 2;
start = [0, 1, 2, 3];
links = (
    { node = 0; to = "host"; unix = "host.socket"; },
    { node = 0; to = 1; unix = "01.socket"; },
    { node = 0; to = 2; unix = "02.socket"; },
    { node = 1; to = 3; unix = "13.socket"; },
    { node = 2; to = 3; unix = "23.socket"; }
);
END
console() { within "$program" console --cube four.cube "$@"; }

# --- scripts -------------------------------------------------------------------

# answers NAME STATUS PATTERN [OPTION...]: lines of standard input.
answers() {
    local name=$1 expected=$2 pattern=$3 status
    shift 3
    console "$@" > output 2> errors
    status=$?
    if [ $status != "$expected" ]; then
        fail "$name" "exit $status, not $expected: $(last errors)"
    else
        check "$name" "no '$pattern' in: $(head -c 300 output)" \
            grep -qE "$pattern" output
    fi
}

answers console-command 0 '3 of 3' -c 'ping 0-3 3'
answers console-commands 0 '^0-3 .* linux|^0-3 ' -c nodes -c 'log all'
answers console-wires 0 '2-----------3' -c wires
answers console-trace 0 '2  link 1  node 3' -c 'trace 0 3'
printf 'help\n# a remark\nmemory 1\nexit\nnonsense\n' > script
answers console-file 0 'windows of links' --file script
answers console-pipe 0 '1 of 1' <<< 'ping 0-3 1'
answers console-first-failure 2 '1 of 1' <<< $'ping 9\nlog 7\nping 0 1\nwires'
answers console-reset 0 '0-3  begun anew' -c 'reset 0-3' -c 'ping all 1'
answers console-json 0 '^{"command":"links",' --json -c links -c 'ping 0 1'
check console-json-objects "$(head -c 300 output)" \
    test "$(jq -r .status output | sort -u)" = 0
check console-json-links 'not two nodes with two links each and the host' \
    test "$(jq -s '.[0].nodes[1:3][].links | length' output | sort -u)" = 2
answers console-run 0 '12953 tetrahedra' \
    -c 'run points.npy -o out.ele --verify --strategy spatial' -c 'ping 1 1'
answers console-run-fails 3 '1 of 1' -c 'run missing.npy -o out.ele' -c 'ping 1 1'
answers console-json-run 0 '"digest":"sha256:' --json \
    -c 'run points.npy -o out.ele'
answers console-json-run-fails 3 '"error":"missing.npy: ' --json \
    -c 'run missing.npy'
console -c 'run many.npy -o no.ele --host-rate 20000 &' -c 'stat 1' -c abort \
    > output 2> errors
check console-looks-at-once "$(last errors)" \
    eval '! grep -q "the run has the cube" errors'
answers console-abort 0 '1 of 1' -c 'run many.npy -o no.ele --host-rate 20000 &' \
    -c abort -c 'ping 1 1'
check console-abort-leaves-nothing 'no.ele is there' test ! -e no.ele
refuses console-nowhere 2 'give --cube FILE' "$program" console -c nodes
refuses console-no-file 3 'none.cube' "$program" console --cube none.cube -c nodes
refuses console-no-file-nothing-to-do 3 'none.cube' \
    "$program" console --cube none.cube
refuses console-no-key-nothing-to-do 3 'none.key' \
    "$program" console --tcp 127.0.0.1:9 --key none.key
check console-leaves-no-folder "$(ls -d incode-console.* 2> /dev/null)" \
    test -z "$(ls -d incode-console.* 2> /dev/null)"

# --- beside another program's run ----------------------------------------------

"$program" run many.npy --cube four.cube -o beside.ele --host-rate 20000 \
    --no-progress > /dev/null 2>&1 &
run=$!
looks() { console -c 'stat 1' -c 'links 3' 2> errors | grep -q '^3  '; }
await lets_look $run
await looks
check console-looks-beside-a-run "$(last errors)" looks
answers console-touches-nothing 4 '^1-2:' -c 'memory 1-2' -c 'reset all'
check console-tells-who "$(last errors)" grep -q "incode-testing run .* has the cube" errors
kill $run
wait $run 2> /dev/null

# --- ended from outside ---------------------------------------------------------

has_folder() { ls -d incode-console.* > /dev/null 2>&1; }
for signal in TERM HUP; do
    "$program" console --cube four.cube \
        -c 'run many.npy -o no.ele --host-rate 20000' -c nodes \
        > output 2> errors &
    ended=$!
    await has_folder
    begun=$?
    kill -$signal $ended
    wait $ended 2> /dev/null
    status=$?
    check "console-ended-by-$signal" \
        "exit $status, begun: $begun: $(last errors)" \
        test $begun/$status = 0/$((128 + $(kill -l $signal)))
    check "console-ended-by-$signal-leaves-nothing" "$(ls)" \
        eval '! has_folder && [ ! -e no.ele ]'
done

# --- by one wire ---------------------------------------------------------------

take_ports
"$(dirname "$program")/incode-node" --node 0 --dimension 0 --insecure \
    --wire "0=listen:127.0.0.1:$base" 2> node.log &
node=$!
by_tcp() { within "$program" console --tcp "127.0.0.1:$base" --insecure "$@"; }
by_tcp -c 'ping 0 1' -c 'run points.npy -o tcp.ele' -c 'ping 0 1' > output 2>&1
status=$?
check console-tcp "exit $status: $(last output)" \
    test "$(grep -c '1 of 1' output)" = 2 -a -s tcp.ele
kill "$node"
"$(dirname "$program")/incode-node" --node 0 --dimension 0 \
    --wire 0=unix-listen:"$here/node.socket" 2> node.log &
node=$!
await test -S node.socket
within "$program" console --unix node.socket -c 'ping 0 1' -c 'log 0' \
    -c 'run points.npy -o unix.ele' > output 2>&1
status=$?
check console-unix "exit $status: $(last output)" test -s unix.ele
kill "$node"

# --- a person ------------------------------------------------------------------

has_terminals console-terminal || exit 0
session=incode-console-$$
t() { tmux -L "$session" -f /dev/null "$@"; }
trap 't kill-server 2> /dev/null; kill $(jobs -p) 2> /dev/null; rm -rf "$scratch"' EXIT
# clock: it stays for that long, or the server would end with its last
t new-session -d -s keep 'sleep 1800' #
screen() { t capture-pane -p -t desk 2> /dev/null; }
shows() { screen | grep -qE -e "$1"; }
type() { t send-keys -t desk "$@"; }
# seen NAME PATTERN: it comes to be shown.
seen() {
    await shows "$2"
    check "$1" "no '$2' on: $(screen | grep -v '^$' | tail -n 3 | tr '\n' '|')" \
        shows "$2"
}
# begin_console OPTION...: at a prompt, in a terminal of 100 columns; its status
# is shown at the end.
begin_console() {
    t kill-session -t desk 2> /dev/null
    t new-session -d -s desk -x 100 -y 30 \
        "'$program' console $*; echo status \$?; sleep 1800" # clock: as long
    await shows '^incode>$'
}

begin_console --cube four.cube
type 'pi' Tab
seen console-completes-command '^incode> ping *$'
type '0-' Tab Tab
seen console-lists-choices '0-0 +0-1 +0-2 +0-3'
type 3 ' 2' Enter
seen console-answers '^3 .* 2 of 2'
type Up
seen console-history '^incode> ping 0-3 2$'
type C-c
seen console-abandons-line '\^C'
check console-history-is-private "$(ls -l state/incode/history)" \
    test "$(stat -c %a state/incode/history)" = 600
type clear C-u 'ping all 100000' Enter
await shows 'ping all 100000'
sleep 0.3 # clock: Ctrl-C takes away what is typed and not read by then
type C-c
seen console-abandons-command 'incode: ping: interrupted'
type 'ping 3 1' Enter
seen console-goes-on '^3 .* 1 of 1'

# Narrow: a long line is edited over two rows, and the picture is cut.
t resize-window -t desk -x 60 -y 20
type '# a line that is longer than the sixty columns of this terminal'
seen console-resized-wraps '^is terminal$|^his terminal$|terminal$'
type C-u 'top' Enter
seen console-top '^NODE ROLE .*MEMORY'
check console-top-fits 'a row of more than 60 columns' \
    test "$(screen | awk 'length > 60' | wc -l)" = 0
t resize-window -t desk -x 120 -y 30
seen console-top-resized 'LINKS +WIRE +BUILT'
type q
seen console-top-leaves '^incode>$'

# A run beside it.
type 'run many.npy -o no.ele --host-rate 20000 &' Enter
seen console-run-behind 'incode \(run\)>$'
type 'ping 0' Enter
seen console-run-has-cube 'incode: ping: the run has the cube'
type 'top' Enter
seen console-looks-on '^ *3 [a-z-]+ +[0-9]+% .#'
type q
type 'abort' Enter
seen console-run-aborted '^run: ended'
type 'ping 0 1' Enter
seen console-after-abort '^0 .* 1 of 1'

# 10,000 lines at once; each is kept.
: > state/incode/history
seq -f '# line %.0f' 9999 > "$here/paste"
echo 'log 1-2' >> "$here/paste"
t load-buffer paste
t paste-buffer -t desk
await grep -q 'log 1-2' state/incode/history
check console-paste-whole "$(wc -l < state/incode/history) lines" \
    cmp -s paste state/incode/history
seen console-paste-last '^1-2'
type C-c
seen console-warns 'Ctrl-C again, or Ctrl-D, leaves'
type C-c
seen console-leaves '^status 0$'
begin_console --cube four.cube
type C-d
seen console-ctrl-d '^status 0$'

# A board that talks garbage.
"$tool" > board &
await grep -q /dev/ board
begin_console --port "$(cat board)" --cube-nodes 1
seen console-garbage 'brings what is no frame.*bytes so far'
seen console-garbage-escaped 'U-Boot 2023.01 .x1b.2J.r.n'
type 'ping 0 1' Enter
seen console-garbage-status 'incode: node 0: ping: '
type exit Enter
seen console-exit '^status 0$'
kill %%
