#!/bin/sh
# What incode deploy runs on a board, in the shell that is there: script.h says
# what it prints and reads.  Nothing but what POSIX, coreutils or busybox have.
#
#     board.sh look|deploy|remove NODE FOLDER
set -u
umask 077
PATH=$PATH:/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin
order=$1 node=$2 folder=$3 name=incode-node-$2
say() { printf "incode-deploy %s\n" "$*"; }
fail() { say "failed $*"; exit 1; }
digest() {
    if [ -r "$1" ]; then sha256sum < "$1" | cut -c 1-64; else echo -; fi
}
command -v sha256sum > /dev/null ||
    fail "sha256sum is missing there; install its coreutils"
me=$(id -u)

# Where things are.
usual=$HOME/.local/lib/incode
[ "$me" != 0 ] || usual=/usr/local/lib/incode
case $folder in
    "") folder=$usual ;;
    /*) ;;
    *) folder=$HOME/$folder ;;
esac
above=$folder
folder=$folder/node-$node
[ "$order" != deploy ] || mkdir -p "$folder" ||
    fail "$folder cannot be made; give another folder in the cube file"
[ ! -d "$folder" ] || folder=$(cd "$folder" && pwd -P) ||
    fail "$folder cannot be entered; look at its rights"

# Who starts it.
export XDG_RUNTIME_DIR="${XDG_RUNTIME_DIR:-/run/user/$me}"
manager=none as=
if [ "$me" = 0 ]; then
    [ ! -d /run/systemd/system ] || manager=system
elif systemctl --user show-environment > /dev/null 2>&1; then
    manager=user
elif [ -d /run/systemd/system ] && sudo -n true > /dev/null 2>&1; then
    manager=system as="sudo -n"
fi
case $manager in
    none) file=$folder/start control=false ;;
    user) control="systemctl --user"
        file=${XDG_CONFIG_HOME:-$HOME/.config}/systemd/user/$name.service ;;
    system) control="$as systemctl"
        file=/etc/systemd/system/$name.service ;;
esac

# A number may be another process's by now.  A node with a key shows nobody its
# program, but its arguments.
alone() {
    pid=$(cat "$folder/pid" 2> /dev/null) && [ -n "$pid" ] || return
    [ "$({ tr "\0" "\n" < "/proc/$pid/cmdline" | head -n 1; } 2> /dev/null)" = \
        "$folder/incode-node" ]
}
state() {
    if [ $manager = none ]; then
        if alone; then echo running; else echo stopped; fi
    elif $control is-active --quiet "$name"; then echo running
    elif $control is-failed --quiet "$name"; then echo failed
    else echo stopped; fi
}
end() {
    [ $manager = none ] || [ ! -e "$file" ] ||
        $control stop "$name" > /dev/null 2>&1
    alone || return 0
    kill "$pid"
    tries=0
    while alone; do
        tries=$((tries + 1))
        [ $tries != 50 ] || kill -KILL "$pid"
        [ $tries -lt 100 ] ||
            fail "process $pid does not end; end it on the board"
        sleep 0.1
    done
    rm -f "$folder/pid"
}
since=-
if [ $manager != none ] && [ -e "$file" ]; then
    since=$($control show -p ActiveEnterTimestamp --value "$name")
elif [ -e "$folder/pid" ]; then
    since=$(date -r "$folder/pid")
fi
say fact machine "$(uname -m)"
say fact manager $manager
say fact user "$(id -un)"
say fact folder "$folder"
say fact file "$file"
say fact program "$(digest "$folder/incode-node")"
say fact key "$(digest "$folder/key")"
say fact unit "$(digest "$file")"
say fact state "$(state)"
say fact since "${since:--}"
say ready
case $order in
    look) exit ;;
    remove)
        say step stopping
        end
        if [ $manager != none ] && [ -e "$file" ]; then
            $control disable --quiet "$name"
            $as rm -f "$file" ||
                fail "$file cannot be removed; remove it on the board"
            $control daemon-reload
        fi
        rm -f "$folder/incode-node" "$folder/key" "$folder/key.new" \
            "$folder/start" "$folder/pid" "$folder/log" "$folder/$name.service" \
            "$folder/incode-node.new" "$folder/new" ||
            fail "$folder cannot be emptied; remove it on the board"
        rmdir "$folder" "$above" 2> /dev/null
        say "done removed"
        exit ;;
esac

# What is replaced; the program last, as it is all bytes that come.
IFS= read -r key || exit 1
[ "$key" != leave ] || { say "done running"; exit; }
IFS= read -r lines || exit 1
new=$folder/new
[ $manager = none ] || new=$folder/$name.service
full="cannot be written; free some space on the board"
if [ "$key" != keep ]; then
    { printf "%s\n" "$key" > "$folder/key.new" &&
        mv -f "$folder/key.new" "$folder/key"; } || {
        rm -f "$folder/key.new"
        fail "the key $full"
    }
fi
if [ "$lines" != keep ]; then
    at=0
    : > "$new" || fail "$new $full"
    while [ $at -lt "$lines" ]; do
        IFS= read -r line || exit 1
        printf "%s\n" "$line" >> "$new" || fail "$new $full"
        at=$((at + 1))
    done
fi
IFS= read -r program || exit 1
if [ "$program" != keep ]; then
    say step copying
    coming=$folder/incode-node.new
    cat > "$coming" || { rm -f "$coming"; fail "the program $full"; }
    [ "$(digest "$coming")" = "$program" ] || {
        rm -f "$coming"
        fail "the program arrived broken; deploy again"
    }
    chmod 755 "$coming"
    "$coming" --version > /dev/null 2>&1 || {
        rm -f "$coming"
        fail "the program does not run there; see that its disk is not" \
            "mounted noexec, and that make nodes made the program"
    }
    mv -f "$coming" "$folder/incode-node" ||
        fail "the program $full"
fi
if [ "$lines" != keep ] && [ $manager != none ]; then
    user=
    [ $manager != user ] || user=--user
    if command -v systemd-analyze > /dev/null; then
        said=$(systemd-analyze verify --man=no $user "$new" 2>&1) ||
            fail "systemd-analyze: $(echo "$said" | tail -n 1);" \
                "correct what it says"
    fi
    { $as mkdir -p "${file%/*}" && $as cp "$new" "$file.new" &&
        $as chmod 644 "$file.new" && $as mv -f "$file.new" "$file"; } ||
        fail "$file $full"
    rm -f "$new"
elif [ "$lines" != keep ]; then
    { chmod 700 "$new" && mv -f "$new" "$file"; } || fail "$file $full"
fi

# Its start.
say step starting
end
if [ $manager = none ]; then
    command -v setsid > /dev/null || setsid() { nohup "$@"; }
    rm -f "$folder/pid"
    setsid "$file" > "$folder/log" 2>&1 < /dev/null &
else
    { $control daemon-reload && $control enable --quiet "$name" &&
        $control restart "$name"; } ||
        fail "systemd does not start it; look there with: $control status $name"
    [ $manager = system ] || loginctl enable-linger > /dev/null 2>&1 ||
        say "note it is stopped when $(id -un) logs out; on the board:" \
            "sudo loginctl enable-linger $(id -un)"
fi

# What is wrong with its wires or its key it says at once.
tries=0
until [ $tries = 10 ] || { [ $tries -gt 4 ] && [ "$(state)" = running ]; }; do
    sleep 0.1
    tries=$((tries + 1))
done
if [ "$(state)" != running ]; then
    [ $manager = none ] ||
        fail "the node does not stay; look there with: $control status $name"
    fail "the node ended: $(tail -n 1 "$folder/log" |
        sed "s/^incode-node: //; s/;/,/g"); see $folder/log"
fi
say "done running"
