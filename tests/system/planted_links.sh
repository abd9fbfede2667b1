#!/usr/bin/env bash
# Links that somebody has planted lead the program nowhere: in the folder of
# emulated boards, in that of the history, at the names of keys, cube files,
# tables and sockets.  What they point to is as it was.  As root, the folders of
# another user are refused as well.
. tests/system/lib.sh

victim=$scratch/victim
echo 'as it was' | tee "$victim" > "$scratch/before"
here=$scratch/here
mkdir "$here"
# is_whole NAME: nothing was written where a link leads.
is_whole() {
    check "planted_links/$1: what a link leads to" "it has $(wc -c < "$victim") \
bytes, and beside it are: $(find "$scratch" -maxdepth 1 -printf '%f ')" \
        eval 'cmp -s "$victim" "$scratch/before" && [ ! -e "$scratch/new" ]'
}

# --- keys, cube files, tables ---------------------------------------------------

for to in victim new; do
    for file in a.key b.sign c.sign.pub d.cube e.csv; do
        ln -sfn "$scratch/$to" "$here/$file"
    done
    refuses "planted_links/key to $to" 3 'a.key: is there already' \
        incode key "$here/a.key"
    refuses "planted_links/key --sign to $to" 3 'b.sign: is there already' \
        incode key --sign "$here/b.sign"
    refuses "planted_links/key --sign, the public half to $to" 3 \
        'c.sign.pub: is there already' incode key --sign "$here/c.sign"
    check "planted_links/key --sign, no secret half alone, $to" 'there is one' \
        [ ! -e "$here/c.sign" ]
    refuses "planted_links/cube --new to $to" 3 'd.cube: is there already' \
        incode cube --new 2 -o "$here/d.cube"
    refuses "planted_links/a table to $to" 3 'e.csv: .*symbolic links' \
        within "$INCODE" bench scaling --quick --csv "$here/e.csv"
    ln -sfn "$scratch/$to" "$here/f.socket"
    exits "planted_links/a socket to $to" 2 within "$BUILD/incode-node" \
        --node 0 --dimension 0 --wire "0=unix-listen:$here/f.socket"
    check "planted_links/a socket to $to: why" "$(last "$scratch/errors")" \
        grep -q 'cannot listen there: .*; that file is no socket; ' \
        "$scratch/errors"
    is_whole "files to $to"
done

# A part of an output has a name that can be known beforehand.
incode gen uniform 10 --seed 1 -o "$scratch/points.xyz"
parts() {
    within bash -c 'ln -s "$1" "$2.part-$$" && exec "$3" run "$4" -q -o "$2"' - \
        "$victim" "$here/out.npy" "$INCODE" "$scratch/points.xyz"
}
succeeds 'planted_links/a part of an output' parts
check 'planted_links/a part of an output: the output' "$(ls -l "$here")" \
    [ -s "$here/out.npy" -a ! -L "$here/out.npy" ]
is_whole 'a part'

# --- folders that are the user's own ----------------------------------------------

# history: a console begins and ends on a terminal, with its history in $state.
state=$scratch/state
wire=$here/none.socket
history() {
    printf 'help\nexit\n' | XDG_STATE_HOME=$state within script -qec \
        "'$INCODE' console --unix '$wire'" "$scratch/typed" > /dev/null 2>&1
}
# keeps_none NAME PATTERN: the history is not kept, and the console says why.
keeps_none() {
    history
    check "planted_links/history, $1: why" "$(head -c 300 "$scratch/typed")" \
        grep -qE "incode: no history is kept: .*$2" "$scratch/typed"
    is_whole "history, $1"
    rm -rf "$state"
}
# plant_folder LINK: in the place of a folder, a link to another that is empty.
plant_folder() {
    rm -rf "$1" "$scratch/theirs"
    mkdir -p "$(dirname "$1")" "$scratch/theirs"
    ln -s "$scratch/theirs" "$1"
}
stays_empty() { # NAME
    check "planted_links/$1: nothing is written there" \
        "$(ls -A "$scratch/theirs")" [ -z "$(ls -A "$scratch/theirs")" ]
}
if has_terminals planted_links/history; then
    history
    check 'planted_links/history is kept' "$(head -c 300 "$scratch/typed")" \
        [ -f "$state/incode/history" ]
    rm -rf "$state"
    plant_folder "$state/incode"
    keeps_none 'a link for its folder' 'is a link, or no folder; '
    stays_empty 'history, a link for its folder'
    mkdir -p "$state/incode"
    chmod 777 "$state/incode"
    keeps_none 'a folder that others can enter' 'entered by other users; '
    mkdir -p "$state/incode"
    chmod 700 "$state/incode"
    ln -s "$victim" "$state/incode/history"
    history
    is_whole 'history, a link for its file'
    rm "$state/incode/history"
    ln -s "$scratch/new" "$state/incode/history"
    history
    is_whole 'history, a link to nothing'
fi

# emulates NAME PATTERN: boards are not started with what is at lab.cube.d.
emulates() {
    refuses "planted_links/$1" 3 "$2" within "$INCODE" emulate \
        --board mps2-an500 --nodes 2 -o "$here/lab.cube"
    is_whole "$1"
    check "planted_links/$1: no cube file" "$(ls "$here")" \
        [ ! -e "$here/lab.cube" ]
}
boards=$here/lab.cube.d
need_boards planted_links/boards mps2-an500
plant_folder "$boards"
emulates 'a link for the folder of boards' 'lab.cube.d: is a link, or no folder'
stays_empty 'a link for the folder of boards'
rm "$boards"
mkdir -m 755 "$boards"
emulates 'a folder that others can enter' \
    'lab.cube.d: can be entered by other users; chmod 700 it'
chmod 700 "$boards"
for file in flash0 console1.log; do
    for to in "$victim" "$scratch/new"; do
        ln -s "$to" "$boards/$file"
        emulates "a link for $file" "lab.cube.d/$file: is no plain file"
        rm "$boards/$file"
    done
    ln "$victim" "$boards/$file"
    emulates "another name for $file" "lab.cube.d/$file: is no plain file"
    rm "$boards/$file"
done
ln -s "$victim" "$here/lab.cube"
refuses 'planted_links/a link for the cube file' 3 'lab.cube: not a file that' \
    within "$INCODE" emulate --board mps2-an500 --nodes 2 -o "$here/lab.cube"
is_whole 'a link for the cube file'
rm -f "$here/lab.cube"

# The sockets of boards are in the folder, whatever is in their places.
rm -rf "$boards"
mkdir -m 700 "$boards"
for file in host.socket qmp0.socket console1.socket; do
    ln -s "$victim" "$boards/$file"
done
"$INCODE" emulate --board mps2-an500 --nodes 2 -o "$here/lab.cube" \
    > "$scratch/emulate" 2>&1 &
emulator=$!
await test -s "$here/lab.cube"
are_sockets() {
    [ -S "$boards/host.socket" ] && [ -S "$boards/qmp0.socket" ] &&
        [ -S "$boards/console1.socket" ]
}
await are_sockets
check 'planted_links/sockets of boards' "$(ls -l "$boards")" are_sockets
kill -INT $emulator
wait $emulator
status=$?
check 'planted_links/sockets of boards: they end' \
    "exit $status: $(last "$scratch/emulate")" [ $status = 0 ]
is_whole 'sockets of boards'

# --- another user's ---------------------------------------------------------------

if [ "$(id -u)" != 0 ]; then
    skip "planted_links/another user's" 'only root can make a folder of theirs'
    exit 0
fi
rm -rf "$boards"
mkdir -m 700 "$boards"
chown 65534 "$boards"
emulates "another user's folder" 'lab.cube.d: belongs to another user; '
chown 0 "$boards"
: > "$boards/flash0"
chown 65534 "$boards/flash0"
emulates "another user's file" 'lab.cube.d/flash0: is no plain file of this'
if has_terminals "planted_links/another user's history"; then
    mkdir -p "$state/incode"
    chmod 700 "$state/incode"
    chown 65534 "$state/incode"
    keeps_none "another user's folder" 'belongs to another user; '
fi
incode key "$here/theirs.key"
chown 65534 "$here/theirs.key"
refuses "planted_links/another user's key" 3 \
    'theirs.key: belongs to another user, who can change it; ' \
    incode nodes --tcp 127.0.0.1:1 --key "$here/theirs.key"
