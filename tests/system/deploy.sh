#!/usr/bin/env bash
# shellcheck disable=SC2016 # what eval is given
# incode deploy over a real sshd on a loopback port, as an ordinary user, to
# boards that are this machine with other folders: what it says, copies, starts,
# updates and removes, and that one that fails leaves the others alone.
. tests/system/lib.sh
umask 077
took=$SECONDS
machine=$(uname -m)
[ "$machine" != armv7l ] || machine=armhf

sshd=$(PATH=$PATH:/usr/sbin:/sbin command -v sshd)
if [ -z "$sshd" ] || ! command -v ssh > /dev/null; then
    skip deploy 'sshd or ssh is missing; make deps installs them'
    exit 0
fi
user=$(id -un)
if [ "$(id -u)" = 0 ]; then
    user=incode-test-$$
    if ! useradd --password '*' --create-home --home-dir "$scratch/home" --shell /bin/sh \
        "$user" 2> "$scratch/errors"; then
        skip deploy "no ordinary user can be made: $(last "$scratch/errors")"
        exit 0
    fi
fi
# Whatever is left of boards, and the user.
clean_up() {
    [ -z "${daemon:-}" ] || kill "$daemon" 2> /dev/null
    for pid in "$scratch"/boards/*/node-*/pid; do
        [ ! -e "$pid" ] || kill -KILL "$(cat "$pid")" 2> /dev/null
    done
    # clock: what is the user's has ended by then, or stays
    [ "$user" = "$(id -un)" ] || { sleep 0.2; userdel "$user" 2> /dev/null; }
    rm -rf "$scratch"
}
trap clean_up EXIT

# --- a board -------------------------------------------------------------------

take_ports
mkdir -p "$scratch/run" "$scratch/boards" "$scratch/programs" "$scratch/bin"
chmod 755 "$scratch" "$scratch/bin"
mkdir -p /run/sshd 2> /dev/null # where sshd, as root, looks at nothing
ssh-keygen -q -t ed25519 -N '' -f "$scratch/board"
ssh-keygen -q -t ed25519 -N '' -f "$scratch/me"
cp "$scratch/me.pub" "$scratch/allowed"
chmod 644 "$scratch/allowed"
chown "$user" "$scratch/boards" "$scratch/run" "$scratch/allowed"
cat > "$scratch/sshd.conf" << END2
Port $base
ListenAddress 127.0.0.1
HostKey $scratch/board
PidFile none
AuthorizedKeysFile $scratch/allowed
StrictModes no
UsePAM no
PasswordAuthentication no
MaxStartups 100
SetEnv PATH=$scratch/bin:/usr/local/bin:/usr/bin:/bin XDG_RUNTIME_DIR=$scratch/run
END2
"$sshd" -D -e -f "$scratch/sshd.conf" 2> "$scratch/sshd.log" &
daemon=$!
cat > "$scratch/ssh.conf" << END2
IdentityFile $scratch/me
IdentitiesOnly yes
StrictHostKeyChecking yes
UserKnownHostsFile $scratch/known
GlobalKnownHostsFile /dev/null
END2
echo "[127.0.0.1]:$base $(cut -d ' ' -f 1-2 "$scratch/board.pub")" \
    > "$scratch/known"
to=ssh://$user@127.0.0.1:$base
if ! await ssh -F "$scratch/ssh.conf" -o BatchMode=yes "$to" true \
    2> "$scratch/errors"; then
    fail deploy/sshd "$(last "$scratch/sshd.log")"
    exit 1
fi

# As many have it: a master that stays would keep the pipes of its first user.
cat >> "$scratch/ssh.conf" << END2
ControlMaster auto
ControlPath $scratch/master-%C
ControlPersist 60
END2

# cube NAME [SETTING...]: four nodes, each on a board of its own.
cube() {
    local name=$1 node
    shift
    {
        echo 'dimension = 2; key = "cube.key";' "$@"
        echo 'nodes = ('
        for node in 0 1 2 3; do
            echo "    { node = $node; ssh = \"$to\";"
            echo "      folder = \"$scratch/boards/b $node\"; }$(
                [ $node = 3 ] || echo ,)"
        done
        echo '); links = ('
        echo "{ node = 0; to = \"host\"; tcp = \"127.0.0.1:$((base + 1))\"; },"
        echo "{ node = 0; to = 1; tcp = \"127.0.0.1:$((base + 2))\"; },"
        echo "{ node = 0; to = 2; tcp = \"127.0.0.1:$((base + 3))\"; },"
        echo "{ node = 1; to = 3; tcp = \"127.0.0.1:$((base + 4))\"; },"
        echo "{ node = 2; to = 3; tcp = \"127.0.0.1:$((base + 5))\"; } );"
    } > "$scratch/$name.cube"
}
cube four
incode key "$scratch/cube.key"
cp "$BUILD/incode-node" "$scratch/programs/incode-node-$machine"

# deploy STATUS [OPTION...]: what it says is in $scratch/said and .../errors.
deploy() {
    local wanted=$1 status
    shift
    incode deploy --cube "$scratch/${cube:-four}.cube" \
        --programs "$scratch/programs" --ssh-config "$scratch/ssh.conf" "$@" \
        > "$scratch/said" 2> "$scratch/errors" < /dev/null
    status=$?
    [ $status = "$wanted" ] && return
    echo "exit $status, not $wanted: $(cat "$scratch/said" "$scratch/errors")"
    return 1
}
# does NAME STATUS [OPTION...]
does() {
    local name=$1
    shift
    deploy "$@" > "$scratch/why"
    check "deploy/$name" "$(cat "$scratch/why")" [ ! -s "$scratch/why" ]
}
# says NAME COUNT PATTERN [FILE]: so many lines.
says() {
    check "deploy/$1" "$(cat "$scratch/said" "$scratch/errors")" \
        [ "$(grep -cE -- "$3" "${4:-$scratch/said}")" = "$2" ]
}
board() { echo "$scratch/boards/b $1/node-$1"; }
runs() { kill -0 "$(cat "$(board "$1")/pid")"; }
digest() { sha256sum < "$1"; }

# --- to an empty board, and over it a run -----------------------------------------

does 'dry run' 0 --dry-run
says 'dry run: each board' 4 "^node [0-3] $to: would copy program \($machine, \
[0-9]+ bytes\), key, what starts it to .*, and start the node$"
says 'dry run: what starts each' 4 '^    exec .*/incode-node.* --node [0-3] '
check 'deploy/dry run changes nothing' "$(ls "$scratch/boards")" \
    [ -z "$(ls "$scratch/boards")" ]
# Without make nodes, what make has made for this machine's processor.
mkdir "$scratch/alone"
cp "$INCODE" "$BUILD/incode-node" "$scratch/alone"
within "$scratch/alone/incode" deploy --cube "$scratch/four.cube" --ssh-config \
    "$scratch/ssh.conf" --dry-run > "$scratch/said" 2> "$scratch/errors" < /dev/null
says 'the program of make' 4 "would copy program \($machine, \
$(stat -c %s "$BUILD/incode-node") bytes\)"
does 'status of nothing' 4 --status
says 'status of nothing: each' 4 'nothing is deployed$'
says 'status of nothing: the next step' 1 \
    'nodes 0-3 do not run; start them with: ' "$scratch/errors"

does 'first' 0
check 'deploy/first: no master of ssh stays' "$(ls "$scratch")" \
    [ -z "$(compgen -G "$scratch/master-*")" ]
says 'first: each' 4 ': deployed: program .*, key, what starts it; running by '
check 'deploy/first: the program' 'it differs' eval \
    '[ "$(digest "$(board 2)/incode-node")" = "$(digest "$BUILD/incode-node")" ]'
check 'deploy/first: the key is for its owner alone' \
    "$(ls -l "$(board 2)/key")" \
    [ "$(stat -c %a:%U "$(board 2)/key")" = "600:$user" ]
check 'deploy/first: they run' "$(cat "$(board 3)/log")" eval \
    'runs 0 && runs 1 && runs 2 && runs 3'
"$INCODE" gen uniform 2000 --seed 3 -o "$scratch/points.npy"
run_on() {
    # shellcheck disable=SC2086
    succeeds "deploy/$1" incode run -q "$scratch/points.npy" $patient \
        --cube "$scratch/four.cube" --verify -o "$scratch/out.npy"
}
run_on 'a run on them'

# --- again, and something new ------------------------------------------------------

before=$(cat "$(board 0)/pid")
does 'again' 0 --update
says 'again: each' 4 ': up to date; running'
check 'deploy/again: the same processes' 'another' \
    [ "$before" = "$(cat "$(board 0)/pid")" ]
does 'status' 0 --status
says 'status: each' 4 ': [a-z0-9_]*, running by itself.*, since '

if has_terminals 'deploy/a terminal'; then
    script -qec "stty cols 80 rows 24; exec '$INCODE' deploy --status \
--cube '$scratch/four.cube' --programs '$scratch/programs' \
--ssh-config '$scratch/ssh.conf'" "$scratch/said" > /dev/null 2>&1 < /dev/null
    status=$?
    check 'deploy/a terminal: exit 0' "exit $status: $(last "$scratch/said")" \
        [ $status = 0 ]
    check 'deploy/a terminal: a row a board' "$(head -c 600 "$scratch/said")" \
        grep -qE $'^\r?node 3 .*: [^\r]*\033\\[K' "$scratch/said"
    says 'a terminal: and at the end' 4 ': [a-z0-9_]*, running by itself.*, since '
fi

# Another program, that is the same but for a byte behind its end.
{ cat "$BUILD/incode-node"; echo; } > "$scratch/programs/incode-node-$machine"
does 'a new program, for two' 0 --nodes 1-2
says 'a new program: two' 2 '^node [12] .*: updated: program .* bytes\); running'
says 'a new program: not the others' 0 '^node [03]'
check 'deploy/a new program runs' 'it does not' eval 'runs 1 && runs 2 &&
    cmp -s "$(board 1)/incode-node" "$scratch/programs/incode-node-$machine"'
cube four 'dead = 7;'
does 'other arguments' 0
says 'other arguments: the program, too, where it is old' 2 \
    '^node [03] .*: updated: program .*, what starts it; running'
says 'other arguments: those alone' 2 \
    '^node [12] .*: updated: what starts it; running'
incode key "$scratch/new.key" && mv "$scratch/new.key" "$scratch/cube.key"
does 'another key' 0
says 'another key: that alone' 4 ': updated: key; running'
run_on 'a run after that'

# --- what fails ------------------------------------------------------------------

fails() { # NAME NODES PATTERN: these alone, and say why
    says "$1: it says why" 1 "^incode: node $2 \($3" "$scratch/errors"
    says "$1: and which" 1 "boards? failed, nodes? $2; .*--nodes $2\$" \
        "$scratch/errors"
}
kill -KILL "$(cat "$(board 3)/pid")"
sed "s,{ node = 1; ssh = .*,{ node = 1; ssh = \"ssh://$user@127.0.0.1:1\";," \
    "$scratch/four.cube" > "$scratch/refused.cube"
cube=refused does 'a board that is off' 4
fails 'a board that is off' 1 '.*onnection refused; start its ssh service'
says 'a board that is off: the others' 2 '^node [02] .*up to date'
says 'a board that is off: one that had ended' 1 '^node 3 .*started; running'
cube=refused does 'status where one is off' 4 --status
sed "s,{ node = 1; ssh = .*,{ node = 1; ssh = \"ssh://nobody-here@127.0.0.1:$base\";," \
    "$scratch/four.cube" > "$scratch/denied.cube"
cube=denied does 'a user without rights' 4
fails 'a user without rights' 1 '.*ermission denied.*; let it know your key, with'
: > "$scratch/known"
does 'an unknown board' 4 --nodes 2
fails 'an unknown board' 2 '.*ost key verification failed.*; look at its key once'
echo "[127.0.0.1]:$base $(cut -d ' ' -f 1-2 "$scratch/board.pub")" \
    > "$scratch/known"
mv "$scratch/programs/incode-node-$machine" "$scratch/kept"
does 'no program for it' 4 --nodes 0
fails 'no program for it' 0 '.*: No such file or directory; make it with: make nodes'
echo 'no program' > "$scratch/programs/incode-node-$machine"
before=$(digest "$(board 0)/incode-node")
does 'a program that does not run' 4 --nodes 0
fails 'a program that does not run' 0 '.*does not run there; see '
check 'deploy/a program that does not run: the old one stays' 'it is gone' eval \
    '[ "$before" = "$(digest "$(board 0)/incode-node")" ] && runs 0'
mv "$scratch/kept" "$scratch/programs/incode-node-$machine"
sed 's/"127.0.0.1:\([0-9]*\)"; },/"192.0.2.1:\1"; },/' "$scratch/four.cube" \
    > "$scratch/elsewhere.cube"
cube=elsewhere does 'wires that it cannot have' 4 --nodes 0
fails 'wires that it cannot have' 0 '.*the node ended: .*; see .*/log'
ln -sfn /dev/full "$(board 3)/incode-node.new"
chown -h "$user" "$(board 3)/incode-node.new"
echo >> "$scratch/programs/incode-node-$machine"
does 'a full disk' 4 --nodes 3
fails 'a full disk' 3 '.*the program cannot be written; free some space'
rm -f "$(board 3)/incode-node.new"

# --- under systemd, of which a stand-in notes what is asked of it ---------------------

cat > "$scratch/bin/systemctl" << 'END2'
#!/bin/sh
echo "$*" >> "${0%/*}/asked"
case $* in
    *is-failed*) exit 1 ;;
    *is-active*) grep -q 'restart' "${0%/*}/asked" ;;
esac
END2
printf '#!/bin/sh\nexit 1\n' > "$scratch/bin/loginctl"
chmod 755 "$scratch/bin"/*
: > "$scratch/bin/asked"
chmod 666 "$scratch/bin/asked"
unit=.config/systemd/user/incode-node-3.service
does 'systemd' 0 --nodes 3
says 'systemd: unit' 1 'updated: .*unit|deployed: .*unit; running under systemd of '
says 'systemd: a user whose units end with him' 1 \
    'sudo loginctl enable-linger' "$scratch/errors"
check 'deploy/systemd: started and enabled' "$(cat "$scratch/bin/asked")" eval \
    'grep -q "user enable.* incode-node-3" "$scratch/bin/asked" &&
     grep -q "user restart incode-node-3" "$scratch/bin/asked"'
home=$(getent passwd "$user" | cut -d : -f 6)
check 'deploy/systemd: the unit has the memory' "$(cat "$home/$unit")" eval \
    'grep -qx LimitDATA=4128768 "$home/$unit" &&
     grep -qx LimitSTACK=65536 "$home/$unit" &&
     grep -qx "MemoryMax=12582912" "$home/$unit" &&
     grep -qx Restart=always "$home/$unit"'
check 'deploy/systemd: the detached one has ended' 'it runs' \
    [ ! -e "$(board 3)/pid" ]
if command -v systemd-analyze > /dev/null; then
    succeeds 'deploy/systemd-analyze verify' env \
        XDG_RUNTIME_DIR="$scratch/run" systemd-analyze verify --user \
        --man=no "$home/$unit"
else
    skip 'deploy/systemd-analyze verify' 'systemd-analyze is missing'
fi
does 'systemd, removed' 0 --remove --nodes 3
check 'deploy/systemd, removed: the unit is gone' "$(cat "$scratch/bin/asked")" \
    eval '[ ! -e "$home/$unit" ] && grep -q "disable.*node-3" "$scratch/bin/asked"'
rm -f "$scratch/bin/systemctl"

# --- their end --------------------------------------------------------------------

does 'removed: dry' 0 --remove --dry-run
says 'removed: dry' 3 'would stop the node and remove '
pids=$(cat "$scratch"/boards/*/node-*/pid)
does 'removed' 0 --remove
says 'removed: each' 3 ': removed$'
says 'removed: what was not there' 1 ': nothing was deployed$'
check 'deploy/removed: nothing is left' "$(find "$scratch/boards")" \
    [ -z "$(ls "$scratch/boards")" ]
left=
for pid in $pids; do
    grep -qs node "/proc/$pid/cmdline" && left="$left $pid" # no zombie
done
check 'deploy/removed: none runs' "$left" [ -z "$left" ]
echo "$((SECONDS - took)) s"
