#!/usr/bin/env bash
# Wrong input, wrong usage, an output that cannot be written, a disk that
# fills: the exit status, one line that says where and what next, no file left.
. tests/system/lib.sh

in=$scratch/in
left=$scratch/left
mkdir "$in"
good=$in/good.xyz
"$INCODE" gen uniform 300 --seed 5 -o "$good" 2> /dev/null
"$INCODE" gen uniform 3000 -o "$in/many.xyz" 2> /dev/null

# run FILE [OPTION...] as `refuses` wants it
run() { "$INCODE" run "$@"; }
wrong() { # NAME PATTERN FILE [OPTION...]
    local name=$1 pattern=$2
    shift 2
    refuses "errors/$name" 3 "$pattern" run "$@" -q --nodes 2 -o "$left/o.vtu"
}

printf '0 0 0\n1 0 0\n0 x1 0\n' > "$in/text.xyz"
printf '0 0 0\n1 0 0\n0 1 nan\n0 0 1\n' > "$in/nan.xyz"
printf '0 0 0\n1 0 0\n0 inf 0\n0 0 1\n' > "$in/infinity.xyz"
printf '0 0 0\n1 0 0\n0 1e999 0\n0 0 1\n' > "$in/huge.xyz"
printf '0 0 0\n1 0\n0 1 0\n0 0 1\n' > "$in/columns.xyz"
printf '0 0 0\n1 0 0\n1 0 0\n0 1 0\n0 1 -0\n' > "$in/three.xyz"
printf '0 0 1\n1 0 1\n0 1 1\n3 5 1\n8 9 1\n' > "$in/plane.xyz"
printf '0 0 0\n1 2 3\n2 4 6\n3 6 9\n-1 -2 -3\n' > "$in/line.xyz"
: > "$in/empty.xyz"
printf '\n  \n' > "$in/blank.xyz"
cp "$good" "$in/points.dat"
mkdir "$in/folder.xyz"
printf 'this is no gzip' > "$in/notgzip.xyz.gz"
gzip -c "$good" | head -c 900 > "$in/short.xyz.gz"
"$INCODE" convert "$good" "$in/good.npy"
"$INCODE" convert "$good" "$in/good.ply"
"$INCODE" convert "$good" "$in/good.vtu"
head -c 3000 "$in/good.npy" > "$in/short.npy"
head -c 3000 "$in/good.ply" > "$in/short.ply"
head -c 3000 "$in/good.vtu" > "$in/short.vtu"

wrong 'missing file' 'absent.xyz' "$in/absent.xyz"
wrong 'a folder' 'in: it is a directory; name a file in it$' "$in"
wrong 'a folder, by a name of a file' 'it is a directory; name a file in it$' \
    "$in/folder.xyz"
wrong 'empty file' 'empty.xyz' "$in/empty.xyz"
wrong 'file of blanks' 'blank.xyz' "$in/blank.xyz"
wrong 'no number, with line and column' 'text.xyz:3:3' "$in/text.xyz"
wrong 'not a number' 'nan.xyz:3.*[nN]a[nN]' "$in/nan.xyz"
wrong 'infinity' 'infinity.xyz:3' "$in/infinity.xyz"
wrong 'a number beyond double' 'huge.xyz:3' "$in/huge.xyz"
wrong 'column count' 'columns.xyz:2' "$in/columns.xyz"
wrong 'three distinct points' 'three.xyz.*(3|three|4|four)' "$in/three.xyz"
wrong 'a plane' 'plane.xyz.*plane' "$in/plane.xyz"
wrong 'a line' 'line.xyz.*line' "$in/line.xyz"
wrong 'truncated .npy' 'short.npy' "$in/short.npy"
wrong 'truncated .ply' 'short.ply' "$in/short.ply"
wrong 'truncated .vtu' 'short.vtu' "$in/short.vtu"
wrong 'truncated .gz' 'short.xyz.gz' "$in/short.xyz.gz"
wrong 'no gzip' 'notgzip.xyz.gz' "$in/notgzip.xyz.gz"
wrong 'unknown input format' 'points.dat' "$in/points.dat"
wrong 'empty standard input' 'standard input|stdin|-' - < /dev/null

# What a terminal would obey is printed as \xNN: in names, in what files hold.
plainly() { # NAME COMMAND...: nothing but printable lines, \x1b among them
    "${@:2}" > "$scratch/said" 2>&1 < /dev/null
    check "errors/printable: $1" "$(head -c 300 "$scratch/said" | od -c)" \
        eval 'LC_ALL=C grep -qF "\x1b" "$scratch/said" &&
            ! LC_ALL=C grep -q "[^ -~]" "$scratch/said"'
}
escape=$(printf '\033[31mred')
cp "$good" "$in/$escape.xyz"
printf '0 0 0\n1 0 %s\n' "$escape" > "$in/token.xyz"
plainly 'a token of a file' run "$in/token.xyz" -q
plainly 'a file that is not there' run "$in/absent$escape.xyz" -q
plainly 'the report' run "$in/$escape.xyz" --nodes 2
plainly 'a command' incode "$escape"
plainly 'an argument of a node' "$BUILD/incode-node" --wire "0=$escape"

# --- nothing is written over what is read, nor twice --------------------------

# spares NAME PATTERN FILE COMMAND...: refused, and FILE is what it was.
spares() {
    local name=$1 file=$3 before
    before=$(cksum < "$file")
    refuses "errors/$name" 2 "$2" "${@:4}"
    check "errors/$name: the input is as it was" "$file has changed" \
        test "$(cksum < "$file")" = "$before"
}
over=$in/over
mkdir "$over"
"$INCODE" convert "$good" "$over/a.node"
"$INCODE" convert "$good" "$over/a.npy"
"$INCODE" convert "$good" "$over/a.vtu"
ln -s a.npy "$over/link.npy"
ln "$over/a.npy" "$over/hard.npy"
ln -s . "$over/again"
spares 'output beside another is the input' \
    '-o .*a.ele: .*a.node, beside it, would overwrite the input .*a.node; ' \
    "$over/a.node" run "$over/a.node" -q --format xyz -o "$over/a.ele"
before=$(cd "$over" && stat -c '%i %Y %s' a.node && cksum < a.node)
succeeds 'errors/.node stays beside its .ele' incode run "$over/a.node" -q \
    -o "$over/a.ele"
check 'errors/.node stays beside its .ele: as it was' 'it has changed' \
    test "$before" = "$(cd "$over" && stat -c '%i %Y %s' a.node && cksum < a.node)"
succeeds 'errors/.node stays beside its .ele: they belong together' \
    incode verify "$over/a.node" "$over/a.ele"
check 'errors/.node stays beside its .ele: the others are there' \
    "$(ls "$over")" test -s "$over/a.neigh" -a -s "$over/a.face"
for as in a link hard again/a; do
    spares "output is the input, as $as.npy" "$as.npy: it would overwrite" \
        "$over/a.npy" run "$over/a.npy" -q -o "$left/o.vtu" -o "$over/$as.npy"
done
spares 'output is the input, .vtu' 'overwrite the input' "$over/a.vtu" \
    run "$over/a.vtu" -q -o "$over/a.vtu"
spares 'statistics are the input' '--stats .*overwrite the input' \
    "$over/a.npy" run "$over/a.npy" -q --stats "$over/link.npy"
spares 'output is standard input' 'overwrite the input on standard input' \
    "$good" bash -c "'$INCODE' run - -q --stats '$good' < '$good'"
spares 'convert to the input' '^incode: .*hard.npy: it would overwrite' "$over/a.npy" \
    "$INCODE" convert "$over/a.npy" "$over/hard.npy"
"$INCODE" run "$over/a.node" -q -o "$over/b.npy"
cp "$over/a.node" "$over/b.node"
spares 'convert over the points it takes' 'b.node' "$over/b.node" \
    "$INCODE" convert "$over/b.npy" "$over/b.ele"
twice() { # NAME PATTERN OPTION...
    refuses "errors/twice, $1" 2 "$2" run "$good" -q "${@:3}"
}
twice 'one output' 'o.vtu: .*already written for -o ' -o "$left/o.vtu" \
    -o "$left/../left/o.vtu"
twice 'statistics and output' '--stats .*already' -o "$left/o.npy" \
    --stats "$left/o.npy"
twice 'statistics and a file beside' 'already written beside -o .*o.ele; ' \
    -o "$left/o.ele" --stats "$left/o.face"
ln -s new.npy "$over/first.npy"
ln -s new.npy "$over/second.npy"
twice 'links to what is not there yet' 'second.npy: .*already written for -o ' \
    -o "$over/first.npy" -o "$over/second.npy"
twice 'standard output' 'standard output is already' -o - --stats -
check 'errors/two outputs to nowhere' 'refused' run "$good" -q -o - \
    --stats /dev/null > /dev/null

refuses 'errors/output in no directory' 3 'absent' run "$good" -q --nodes 2 \
    -o "$left/absent/o.vtu"
refuses 'errors/output is a directory' 3 'o.vtu' \
    bash -c "mkdir '$in/o.vtu'; '$INCODE' run '$good' -q --nodes 2 \
        -o '$in/o.vtu'"
refuses 'errors/standard output is full' 3 '-: .*space' \
    bash -c "'$INCODE' run '$good' -q --nodes 2 -o - > /dev/full"
refuses 'errors/statistics cannot be written' 3 'absent' run "$good" -q \
    --nodes 2 -o "$left/o.vtu" --stats "$left/absent/s.json"
refuses 'errors/statistics fill the disk' 3 '/dev/full: .*space' run "$good" \
    -q --nodes 2 -o "$left/o.vtu" --stats /dev/full
# What was there before a run that fails late is there after it, and no more.
late=$in/late
mkdir "$late" "$late/real"
ln -s real/o.vtu "$late/o.vtu"
mkfifo "$late/o.npy"
cp "$good" "$late/o.msh"
exec 7<> "$late/o.npy"
refuses 'errors/a run that fails late' 3 '/dev/full: .*space' run "$good" -q \
    --nodes 2 -o "$late/o.vtu" -o "$late/o.npy" -o "$late/o.msh" \
    -o "$late/o.mesh" --stats /dev/full
exec 7>&-
check 'errors/what was there before a run that fails late' \
    "$(ls "$late" "$late/real")" test -L "$late/o.vtu" -a -p "$late/o.npy" -a \
    "$(cksum < "$late/o.msh")" = "$(cksum < "$good")" -a \
    "$(cd "$late" && find . | wc -l)" = 5
refuses 'errors/the report fills the disk' 3 '^incode: standard output: .*space' \
    bash -c '"$@" > /dev/full' - "$INCODE" run "$good" --nodes 2 \
    -o "$left/o.ele" -o "$left/o.npy" --stats "$left/s.json"
for arguments in --help --version 'run --help' 'gen uniform 9000'; do
    # shellcheck disable=SC2086
    refuses "errors/$arguments into a full disk" 3 ': .*space' \
        bash -c '"$@" > /dev/full' - "$INCODE" $arguments
done
for arguments in "run $in/many.xyz -q -o -" 'gen uniform 90000'; do
    # shellcheck disable=SC2086
    refuses "errors/the reader of '${arguments%% *}' goes away" 3 \
        '^incode: -: its reader went away before the end' bash -c \
        '"$@" | head -n 1 > /dev/null; exit "${PIPESTATUS[0]}"' - "$INCODE" \
        $arguments
done

# A pipe has a name like a file; its reader is there, or it is not.
mkfifo "$in/pipe.npy"
refuses 'errors/a pipe without a reader' 3 'pipe.npy: .*no.* reads' \
    incode run "$good" -q -o "$left/o.vtu" -o "$in/pipe.npy"
exec 7<> "$in/pipe.npy" 8< "$in/pipe.npy" # both ends, before anybody looks
within cat <&8 7>&- > "$scratch/piped.npy" &
incode run "$good" -q -o "$in/pipe.npy" -o "$scratch/plain.npy" 7>&-
status=$?
exec 7>&- 8<&-
check 'errors/a pipe with a reader' "exit $status" \
    eval 'wait $! && [ $status = 0 ] && cmp "$scratch/piped.npy" "$scratch/plain.npy"'
# Whatever started it.
has_terminals 'errors/a closed standard input' &&
    succeeds 'errors/a closed standard input' \
        incode run "$good" -q --nodes 2 --link serial <&-
check 'errors/nothing is open' 'it fails' incode run "$good" -q \
    --nodes 2 -o "$scratch/closed.npy" <&- >&- 2>&-
refuses 'errors/a closed standard output' 3 'standard output: Bad file' \
    bash -c '"$@" >&-' - "$INCODE" run "$good" --nodes 2 -o "$left/o.vtu"
refuses 'errors/tetrahedra to a closed standard output' 3 '-: .*Bad file' \
    bash -c '"$@" >&-' - "$INCODE" run "$good" -q --nodes 2 -o -
refuses 'errors/ends of children are ignored' 4 'ended 3 times, .*status 1;' within \
    env --ignore-signal=CHLD "$INCODE" run "$good" -q --nodes 2 \
    --node-program /bin/false -o "$left/o.vtu"

# Pseudo-terminals of the same numbers in a container, seen from outside it.
name='errors/terminals of a container'
user=$([ "$(id -u)" = 0 ] || echo -r)
# shellcheck disable=SC2016
contained=(unshare ${user:+"$user"} -m bash -c 'mount -t devpts -o \
    newinstance,ptmxmode=666 none /dev/pts &&
    mount --bind /dev/pts/ptmx /dev/ptmx && exec "$@"' -)
if ! has_terminals "$name"; then
    :
elif "${contained[@]}" true 2> /dev/null; then
    "${contained[@]}" "$INCODE-testing" run "$in/many.xyz" -q --nodes 16 \
        --link serial --host-rate 2000 &
    all_there() { [ "$(pgrep -c -P $! incode-node)" = 16 ]; }
    await all_there
    succeeds "$name" incode run "$good" -q --nodes 16 \
        --link serial
    kill $!
    wait $! 2> /dev/null
else
    skip "$name" 'no right to mount here'
fi

# Root may write anywhere: nobody tries.
name='errors/output in a directory without permission'
nobody=
[ "$(id -u)" = 0 ] && nobody='setpriv --reuid 65534 --clear-groups'
mkdir -m 555 "$in/locked"
chmod 755 "$scratch" "$in"
# shellcheck disable=SC2086
if $nobody "$INCODE" --version > /dev/null 2>&1; then
    refuses "$name" 3 locked $nobody "$INCODE" run "$good" -q --nodes 2 \
        -o "$in/locked/o.vtu"
else
    skip "$name" 'another user cannot reach the program here'
fi

# A link that the system does not follow is not followed, whether something is
# where it leads or not: here on a mount that follows none.
unfollowed() { # COMMAND...
    # shellcheck disable=SC2016
    unshare ${user:+"$user"} -m bash -c 'cd "$0" &&
        mount -t tmpfs -o nosymfollow none . && cd "$0" && echo kept > there &&
        ln -s there a.npy && ln -s absent b.npy && ! cat a.npy || exit 99
        "$@" 2>&7
        status=$?
        [ "$(cat there)" = kept ] && [ ! -e absent ] && exit $status' \
        "$left" "$@" 7>&2 2> /dev/null
}
name='errors/an output through a link that the system does not follow'
mkdir -p "$left"
if unfollowed true; then
    for link in a b; do
        refuses "$name, $link" 3 "$link.npy: cannot be written .*symbolic" \
            unfollowed "$(realpath "$INCODE")" run "$good" -q --nodes 2 \
            -o $link.npy
    done
else
    skip "$name" 'no right to mount here, or no such mount'
fi

# A disk of 64 KiB; what is left on it is listed before it goes.
full_disk() {
    unshare ${1:+"$1"} -m bash -c "
        mount -t tmpfs -o size=64k none '$left' || exit 99
        '$INCODE' run '$in/many.xyz' -q --nodes 2 -o '$left/o.$2'
        status=\$?
        [ -z \"\$(ls -A '$left')\" ] || exit 98
        exit \$status"
}
for format in vtu ele npy vtk msh mesh; do
    name="errors/disk fills under .$format"
    if ! unshare ${user:+"$user"} -m mount -t tmpfs -o size=64k none "$in" \
        2> /dev/null; then
        skip "$name" 'no right to mount a small disk here'
        continue
    fi
    refuses "$name" 3 "o.$format|space" full_disk "$user" $format
done

for outputs in '-o o.vtu' '-o o.ele' '--stats o.json'; do
    # shellcheck disable=SC2016
    refuses "errors/limit of a file's size, $outputs" 3 \
        'o.* writing failed \(File too large\)' bash -c \
        'ulimit -f 1; cd "$1" && "$2" run "$3" -q $4' - "$left" \
        "$(realpath "$INCODE")" "$good" "$outputs"
done

# Ended while it writes into a pipe, which nobody empties, beside three parts
# and an output that is done.
interrupted() { # SIGNAL
    local pipe=$left/o.neigh parts status
    rm -rf "$left"
    mkdir "$left"
    mkfifo "$pipe"
    exec 7<> "$pipe"
    "$INCODE" run "$in/many.xyz" -q -o "$left/o.npy" -o "$left/o.ele" &
    all_parts() { [ "$(find "$left" -name '*.part-*' | wc -l)" = 4 ]; }
    await all_parts
    # shellcheck disable=SC2012
    parts=$(ls "$left" | wc -l)
    kill -s "$1" $!
    wait $! 2> /dev/null
    status=$?
    exec 7>&-
    check "errors/$1 while it writes" \
        "$parts files, then status $status and $(ls "$left" | tr '\n' ' ')" \
        test "$parts $status $(ls "$left")" = "5 $(($(kill -l "$1") + 128)) o.neigh"
}
interrupted TERM
interrupted HUP

# --- usage -------------------------------------------------------------------

usage() { # NAME PATTERN ARGUMENT...
    refuses "usage/$1" 2 "$2" "$INCODE" "${@:3}"
}
out="$left/o.npy"
usage 'no command' '^incode: COMMAND: none is given; allowed: run, gen'
usage 'unknown command' 'run' frobnicate
usage 'no points' 'POINTS: not given; ' run -o "$out"
usage 'two point files' 'good' run "$good" "$good" -o "$out"
usage 'unknown option' 'frob' run "$good" --frob -o "$out"
usage 'option without its value' '--nodes: wants a value; ' run "$good" --nodes
usage 'nodes not a power of two' '(2, 4|power)' run "$good" --nodes 3 -o "$out"
usage 'no nodes' 'nodes' run "$good" --nodes 0 -o "$out"
usage 'negative nodes' 'nodes' run "$good" --nodes=-2 -o "$out"
usage 'too many nodes' 'nodes' run "$good" --nodes 1048576 -o "$out"
usage 'nodes not a number' 'nodes' run "$good" --nodes many -o "$out"
usage 'unknown strategy' 'sequential.*spatial.*hybrid' run "$good" \
    --strategy quick -o "$out"
for strategy in master-slaves hybrid; do
    share=(run "$good" -o "$out" --strategy "$strategy")
    usage "$strategy on one node" 'a builder; give --nodes 2' \
        "${share[@]}" --nodes 1
    usage "$strategy with the face rule paper" '--face-rule paper: .*leave' \
        "${share[@]}" --nodes 4 --face-rule paper
    usage "$strategy with too many builders" '--builders 4: .*give 1 to 3' \
        "${share[@]}" --nodes 4 --builders 4
    usage "$strategy without builders" '--builders 0: .*1 to' \
        "${share[@]}" --nodes 4 --builders 0
    usage "$strategy with no faces" '--faces-per-job 0: .*1 to 96' \
        "${share[@]}" --nodes 4 --faces-per-job 0
    usage "$strategy with too many lists" '--jobs-per-worker 17: .*1 to 16' \
        "${share[@]}" --nodes 4 --jobs-per-worker 17
done
usage 'clusters of three' '--cluster 3: .*a power of two, 2 to 8' run "$good" \
    -o "$out" --strategy hybrid --nodes 8 --cluster 3
usage 'clusters larger than the cube' '--cluster 16: .*2 to 8' run "$good" \
    -o "$out" --strategy hybrid --nodes 8 --cluster 16
usage 'clusters of two nodes' '--cluster 3: 2 nodes .*; give 2, or more --nodes$' \
    run "$good" -o "$out" --strategy hybrid --nodes 2 --cluster 3
usage 'builders of two nodes' '--builders 2: 2 nodes .*; give 1, or more --nodes$' \
    run "$good" -o "$out" --strategy master-slaves --nodes 2 --builders 2
for option in cluster builders faces-per-job jobs-per-worker; do
    usage "--$option without its strategy" "--$option: goes with .*leave it out" \
        run "$good" -o "$out" --nodes 4 --strategy spatial --$option 2
done
usage 'unknown partition' 'uniform|adaptive' run "$good" --partition odd \
    -o "$out"
usage 'unknown index' 'naive.*grid.*kd' run "$good" --index tree -o "$out"
usage 'unknown face rule' 'own.*paper' run "$good" --face-rule all -o "$out"
usage 'unknown build' 'auto, faces, points' run "$good" --build all -o "$out"
usage 'unknown link' 'tcp' run "$good" --link pigeon -o "$out"
usage 'unknown board' 'linux' run "$good" --board z80 -o "$out"
usage 'memory too small' 'memory' run "$good" --memory 1K -o "$out"
# What is said to be needed is: that much works, and less does not.
for nodes in 1 64; do
    usage "memory too small for $nodes" 'needs at least [0-9]+K; give that' \
        run "$good" --nodes $nodes --memory 256K -o "$out"
    need=$(sed -n 's/.*at least \([0-9]*\)K.*/\1/p' "$scratch/errors")
    usage "memory a little too small for $nodes" "needs at least ${need}K" \
        run "$good" --nodes $nodes --memory $((need - 16))K -o "$out"
    for index in naive grid kd; do
        succeeds "memory just enough for $nodes, $index" "$INCODE" run "$good" \
            -q --nodes $nodes --index $index --memory "${need}K"
    done
done
check 'memory that always suffices' "$need K are more" test "$need" -le 640
usage 'memory enough on fewer nodes' 'give that, or fewer --nodes' run "$good" \
    --nodes 64 --memory $((need - 32))K -o "$out"
usage 'memory enough without --window' 'give that, fewer --nodes, or no --window' run "$good" \
    --nodes 64 --window 64 --memory 1M -o "$out"
usage 'memory no number' 'memory' run "$good" --memory lots -o "$out"
usage 'unknown output format' 'vtu' run "$good" -o "$left/o.xls"
usage 'packed tetrahedra' 'vtu' run "$good" -o "$left/o.vtu.GZ"
usage 'packed tetrahedra, .ele' 'vtu' run "$good" -o "$left/o.ele.GZ"
usage 'packed points' 'xyz' gen uniform 9 -o "$left/o.xyz.Gz"
usage 'unknown kind' 'uniform' gen cheese 100 -o "$left/o.xyz"
usage 'too few to generate' 'give 4 to 4294901760$' gen uniform 3 -o "$left/o.xyz"
check 'as many as are triangulated' 'the limits differ' test \
    $((2 ** 32 - 2 ** 16)) = 4294901760 -a \
    -n "$(grep 'At most 2^32 - 2^16 points' README.md host/README.md)" -a \
    -n "$("$INCODE" gen --help | tr '\n' ' ' | grep -F '4 to 4294901760 (2^32 - 2^16)')"
usage 'verify without tetrahedra' 'TETS' verify "$good"
usage 'digest without a file' \
    '^incode: digest: too few arguments; give TETS, see incode digest --help$' digest
usage 'convert to nothing' 'OUT' convert "$good"

# What a new user writes: done as it was meant, or what to write instead.
usage 'a command mistyped' 'gne: no such command; did you mean gen\?' gne
usage 'a file for a command' 'write incode run .*good.xyz -o OUT' "$good"
usage 'a file that is named like a command' \
    'write incode run convert.xyz -o OUT' convert.xyz
usage 'a file whose name a shell would run' \
    "write incode run 'a; touch b.xyz' -o OUT" 'a; touch b.xyz'
usage 'an option mistyped' '--strateyg: .*did you mean --strategy\?' run "$good" \
    --strateyg auto
usage 'one dash' '-nodes: .*did you mean --nodes\?' run "$good" -nodes 2
usage 'a short option' '-x: no such option of incode run; ' run "$good" -x
usage 'two files' 'other.xyz: a second file of points' run "$good" other.xyz
usage '128 nodes' '--nodes 128: .*allowed: 1, 2, .*64' run "$good" \
    --nodes 128
usage 'gen, the number first' 'gen 100 uniform: the kind .*; write gen uniform 100$' \
    gen 100 uniform -o "$left/o.xyz"
usage 'a folder for the output' 'left: it is a directory; name a file in it' run \
    "$good" -o "$left"
usage 'a folder for points' 'left/: it is a directory; name a file in it' gen grid 27 \
    -o "$left/"
usage 'too many to generate' 'gen uniform 1e12: too few points, or too many; ' \
    gen uniform 1e12 -o "$left/o.xyz"
usage 'an output without -o' 'give one, and an output as -o o.vtu$' run "$good" o.vtu
refuses 'usage/tetrahedra for points' 3 \
    'a.ele: no format of points has this extension, which tetrahedra have; use ' \
    incode verify "$in/a.ele" "$good"
refuses 'usage/points for tetrahedra' 3 \
    'good.xyz: no format of tetrahedra has this extension, which points have; use ' \
    incode digest "$good"
usage 'half a point' 'gen uniform 4.5: not a whole number' gen uniform 4.5
usage 'help of nothing' 'runn: .*did you mean run\?' help runn
for memory in 4MB '4 MiB' 4m 4096K; do
    succeeds "usage/--memory $memory" incode run "$good" -q --nodes 2 \
        --memory "$memory" --stats "$scratch/memory.json"
    check "usage/--memory $memory, the bytes" 'not 4 MiB' \
        test "$(jq .memory_bytes "$scratch/memory.json")" = 4194304
done
script -qec "$INCODE gen uniform 9" /dev/null > "$scratch/output" < /dev/null
check 'usage/points for a terminal' "$(last "$scratch/output")" \
    grep -q '^incode: gen: the points would go to the terminal; give -o FILE' \
    "$scratch/output"
succeeds 'usage/gen uniform 1e3' \
    incode gen uniform 1e3 -o "$scratch/thousand.xyz"
check 'usage/1e3 points' "$(wc -l < "$scratch/thousand.xyz")" \
    test "$(wc -l < "$scratch/thousand.xyz")" = 1000
incode --help > "$scratch/help"
incode run --help > "$scratch/help.run"
for words in -h 'help' 'run -h' 'help run'; do
    # shellcheck disable=SC2086
    check "usage/$words is --help" 'another text, or none' eval \
        'incode $words | tee "$scratch/said" | cmp - \
            "$scratch/help$([ "${words#*run}" = "$words" ] || echo .run)" &&
        grep -q "^Usage: incode" "$scratch/said"'
done

# --- no error ----------------------------------------------------------------

printf '0 0 0\n1 0 0\n0 1 0\n0 0 1\n-0 0 0\n0 0 1\n' > "$in/four.xyz"
check 'more nodes than points' 'it failed' "$INCODE" run "$in/four.xyz" -q \
    --nodes 32 --verify -o "$scratch/four.npy" --stats "$scratch/four.json"
check 'duplicates and -0.0 are counted' "$(cat "$scratch/four.json")" \
    test "$(jq -c '[.points, .distinct_points, .duplicates, .negative_zeros,
        .tetrahedra]' "$scratch/four.json")" = '[6,4,2,1,1]'
"$INCODE" run "$in/four.xyz" > "$scratch/output"
check 'duplicates and -0.0 are told' "$(tr '\n' ' ' < "$scratch/output")" \
    test "$(grep -cE ': 4 distinct points, 1 tetra|2 of 6 points are dup|-0\.0.*: 1$' \
    "$scratch/output")" = 3
# A scan with colours is its points, which is said once, and not to those who
# want nothing but errors.
sed 's/$/ 255 0 0 roof/' "$in/four.xyz" > "$in/scan.xyz"
incode run "$in/scan.xyz" -o "$scratch/scan.npy" > "$scratch/output" \
    2> "$scratch/errors"
status=$?
check 'columns after the third' "exit $status, $(last "$scratch/errors")" \
    cmp "$scratch/scan.npy" "$scratch/four.npy"
check 'columns after the third are told once' "$(cat "$scratch/errors")" \
    test "$(grep -c '^incode: .*scan.xyz: .*passed over$' "$scratch/errors") \
$(wc -l < "$scratch/errors")" = '1 1'
check 'columns after the third, quietly' "$(cat "$scratch/errors")" \
    eval 'incode run "$in/scan.xyz" -q 2> "$scratch/errors" &&
        [ ! -s "$scratch/errors" ]'
# Where nothing is asked for, that is said before it is computed.
none='^incode: no output was asked for, .*; -o FILE writes .* \.ele \.vtu '
incode run "$good" > "$scratch/output" 2> "$scratch/errors"
check 'no output is told' "$(cat "$scratch/errors")" \
    test "$(grep -cE "$none" "$scratch/errors") $(wc -l < "$scratch/errors")" = '1 1'
for asked in -q "-o $scratch/o.npy" "--stats $scratch/o.json" --table --map; do
    # shellcheck disable=SC2086
    incode run "$good" --nodes 2 $asked > "$scratch/output" 2> "$scratch/errors"
    check "no output is not told with ${asked%% *}" "$(cat "$scratch/errors")" \
        [ ! -s "$scratch/errors" ]
done
# Why a strategy was taken is told to those who ask.
explained() { grep -c '^auto: .* is expected to take ' "$scratch/output"; }
incode run "$good" -o "$scratch/o.npy" > "$scratch/output"
check 'the choice is not explained' "$(cat "$scratch/output")" \
    [ "$(explained) $(wc -l < "$scratch/output")" = '0 2' ]
incode run "$good" -o "$scratch/o.npy" --explain > "$scratch/output"
check 'the choice is explained with --explain' "$(cat "$scratch/output")" \
    [ "$(explained)" = 1 ]
# What other tools write is read as it is meant, and what is taken for granted
# is said once.
reads() { # NAME EXTENSION NOTE: of four.xyz, as standard input has it
    cat > "$in/other.$2"
    rm -f "$scratch/other.npy"
    succeeds "$1: exit 0" incode run "$in/other.$2" -o "$scratch/other.npy" \
        > "$scratch/output"
    check "$1" "$(last "$scratch/errors")" \
        cmp "$scratch/other.npy" "$scratch/four.npy"
    check "$1: what is said" "$(cat "$scratch/errors")" [ "$(sed "s,.*/,," \
        "$scratch/errors")" = "${3:+other.$2: $3}" ]
}
names='its first line is taken for names of columns'
reads 'lines that end in CR' xyz '' < <(tr '\n' '\r' < "$in/four.xyz")
reads 'names of columns in .xyz' xyz "$names" < <(echo 'X Y Z' && cat "$in/four.xyz")
reads 'comments with //' txt '' < <(echo '//X Y Z' && sed 's,$, // a point,' \
    "$in/four.xyz")
columns='the first three columns are x, y and z; those after them are passed over'
reads 'commas that may be decimal ones' csv \
    "$columns (if its commas are decimal ones, write decimal points instead)" \
    < <(sed 's/ /,/g; s/$/,1,2,3/' "$in/four.xyz")
sed 's/^\([^ ]*\) \([^ ]*\) \(.*\)/\1,05,\2,5,\3,25/' "$in/four.xyz" > "$in/decimal.csv"
wrong 'decimal commas' 'decimal.csv:1:.*decimal ones; write decimal points, or' \
    "$in/decimal.csv"
printf '1 2 3 4 5\n1 3 2 5 4\n9 8 1 7 6\n' > "$in/turned.xyz"
wrong 'a row an axis' 'turned.xyz: 3 rows .*transpose' "$in/turned.xyz"
"$INCODE" gen grid 27 -o "$in/grid.npy"
sed 's/(27, 3), }/(3, 27), }/' "$in/grid.npy" > "$in/turned.npy"
wrong 'a row an axis, .npy' 'shape \(3, 27\).*; save its transpose: numpy.save' \
    "$in/turned.npy"
# Coordinates have the digits that they came with.
printf '512051.182 0.1 -3.7\n5403327.77 2e-9 0.30000000000000004\n' > "$in/digits.xyz"
for format in xyz csv pts node off; do
    "$INCODE" convert "$in/digits.xyz" "$scratch/digits.$format"
    check "digits of .$format" "$(cat "$scratch/digits.$format")" \
        grep -qE '(^|[ ,])512051.182[ ,]0.1[ ,]-3.7$' "$scratch/digits.$format"
    check "digits of .$format: all of them" "$(cat "$scratch/digits.$format")" \
        grep -qE '5403327.77[ ,]2e-09[ ,]0.30000000000000004$' \
        "$scratch/digits.$format"
done
mkdir "$in/packed"
"$INCODE" run "$good" -q -o "$in/packed/a.ele" -o "$scratch/plain.vtu"
gzip "$in/packed/a.ele"
succeeds 'packed tetrahedra and the points beside them' "$INCODE" convert \
    "$in/packed/a.ele.gz" "$scratch/packed.vtu"
check 'packed tetrahedra are the same' 'another file' \
    cmp "$scratch/packed.vtu" "$scratch/plain.vtu"
gzip "$in/packed/a.node"
succeeds 'packed tetrahedra and packed points' "$INCODE" convert \
    "$in/packed/a.ele.gz" "$scratch/packed.vtu"
for arguments in --help --version 'run --help' 'gen --help' 'verify --help' \
    'digest --help' 'convert --help'; do
    # shellcheck disable=SC2086
    "$INCODE" $arguments > "$scratch/help" 2>&1
    status=$?
    check "$arguments" "exit $status" test $status = 0 -a -s "$scratch/help"
done

# --- cube files ---------------------------------------------------------------

cube() { "$INCODE" cube "$@"; }
refuses 'cube/a directory' 3 "^incode: $in: a directory; " cube "$in"
refuses 'cube/no such file' 3 'absent.cube: No such file' cube "$in/absent.cube"
refuses 'cube/no text' 3 'good.npy: not a text' cube "$in/good.npy"
printf 'dimension = 0; key = "seen.key";
    links = ( { node = 0; to = "host"; tcp = "127.0.0.1:7500"; } );\n' \
    > "$in/seen.cube"
printf '%064d\n' 0 > "$in/seen.key"
chmod 640 "$in/seen.key"
cube "$in/seen.cube" > "$scratch/output" 2> "$scratch/errors"
check 'cube/a key that others can read' "$(last "$scratch/errors")" \
    grep -q "^incode: .*seen.cube:1: key: .*/seen.key: can be read by others.*; " \
    "$scratch/errors"
chmod 600 "$in/seen.key"
cube "$in/seen.cube" > "$scratch/output" 2> "$scratch/errors"
status=$?
check 'cube/a key of its own, from a file' "exit $status" \
    test $status = 0 -a ! -s "$scratch/errors"
refuses 'cube/from a pipe' 3 ': a pipe or device; ' cube <(cat "$in/seen.cube")

# --- a node's own arguments ---------------------------------------------------

node() { # NAME PATTERN ARGUMENT...
    local name=node/$1 pattern=$2 status
    shift 2
    within "$BUILD/incode-node" "$@" > "$scratch/output" 2> "$scratch/errors"
    status=$?
    check "$name" "exit $status: $(last "$scratch/errors")" test $status = 2 \
        -a -n "$(grep -E -e "^incode-node: $pattern.*; " "$scratch/errors")"
}
node 'no arguments' 'arguments: none is given, and a node has to know its wires'
node 'unknown argument' '--frob: no such argument' --frob 3
node 'argument without its value' '--node: wants' --node
node 'no number' '--window x: not a number' --window x
node 'no such node' '--node: .*no such node' --node 9 --dimension 3 --links 3,4,5
node 'a wire too few' '--wire: not one for each link' --node 0 --dimension 1 \
    --wire 0=call:127.0.0.1:5
node 'a name for an address' '--wire 0=call:localhost:5: not an address' \
    --node 0 --dimension 0 --wire 0=call:localhost:5
node 'no key file' '--key .*absent: cannot be read: No such file' \
    --node 0 --dimension 0 --wire 0=call:127.0.0.1:5 --key "$in/absent"
node 'a bad key file' '--key .*: not a file of 64 hexadecimal' \
    --node 0 --dimension 0 --wire 0=call:127.0.0.1:5 --key "$in/empty.xyz"
printf '%064d\n' 0 > "$in/key"
node 'a directory for a key' '--key .*: cannot be read: Is a directory' \
    --node 0 --dimension 0 --wire 0=call:127.0.0.1:5 --key "$in"
printf '%064d\n' 0 > "$in/open.key"
chmod 602 "$in/open.key"
node 'a key that others can write' '--key .*: can be written by others' \
    --node 0 --dimension 0 --wire 0=call:127.0.0.1:5 --key "$in/open.key"
node 'another board' '--board z80: another board' \
    --node 0 --dimension 0 --wire 0=call:127.0.0.1:5 --board z80
node 'an address of others' '--wire 0=listen:192.0.2.1:5: cannot listen .*: ' \
    --node 0 --dimension 0 --wire 0=listen:192.0.2.1:5 --key "$in/key"
node 'no key' '--wire 0=listen:127.0.0.1:5: a wire over TCP wants a key' \
    --node 0 --dimension 0 --wire 0=listen:127.0.0.1:5
node 'no key to call with' '--wire 0=call:.*: a wire over TCP wants a key' \
    --node 0 --dimension 0 --wire 0=call:127.0.0.1:5
node 'no links' '--insecure x: not links as in 0,2' \
    --node 0 --dimension 0 --wire 0=call:127.0.0.1:5 --insecure x
node 'links without TCP' '--insecure: does nothing for a link' \
    --node 0 --dimension 1 --wire 0=call:127.0.0.1:5 \
    --wire 1=unix-call:/a --insecure 1
node 'no link over TCP' '--insecure: does nothing for a link' \
    --node 0 --dimension 0 --wire 0=unix-call:/a --insecure
node 'a path that is too long' '--wire .*: not a path of 1 to 107 bytes' \
    --node 0 --dimension 0 --wire "0=unix-listen:/$(printf '%0107d' 0)"
node 'a path of a file' '--wire 0=unix-listen:.*: cannot listen there: File exists' \
    --node 0 --dimension 0 --wire "0=unix-listen:$in/key"
node 'no such wire' '--wire 0=tape:a: not one of listen:' \
    --node 0 --dimension 0 --wire 0=tape:a
node 'a port without a rate' '--wire 0=serial:/dev/null:fast: not a device' \
    --node 0 --dimension 0 --wire 0=serial:/dev/null:fast
ln -s /dev/null "$in/usb:1:1.0"
node 'a port whose name has colons' '--wire .*1.0:9600:rtscts: does not open' \
    --node 0 --dimension 0 --wire "0=serial:$in/usb:1:1.0:9600:rtscts"
"$BUILD/incode-node" --help > "$scratch/output" 2> "$scratch/errors"
status=$?
check 'node/help' "exit $status" grep -q -e '--wire LINK=WIRE' "$scratch/output"
