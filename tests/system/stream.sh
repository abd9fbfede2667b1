#!/usr/bin/env bash
# With --host-memory 16M, files, pipes and packed files of 300,000 points and
# their tetrahedra are read, converted, digested, drawn and checked as without
# it, in less than 16 MiB.  What is wrong with them, or with the room for what is
# put aside, is said.
. tests/system/lib.sh

aside=$scratch/aside
mkdir "$aside"
limit=(--host-memory 16M --scratch "$aside")

# limited COMMAND...: the command within the limit: its peak, in KiB, is in $peak.
limited() {
    within "$BUILD/tests/peak" "$scratch/peak" "$INCODE" "$@" "${limit[@]}"
}
below() { [ "$(cat "$scratch/peak")" -lt 16384 ]; }
# same NAME MADE WANTED COMMAND...: the command ends with 0 below the limit, MADE
# is as WANTED, and nothing is left of what was put aside.
same() {
    local name=$1 made=$2 wanted=$3 status
    shift 3
    echo 16384 > "$scratch/peak"
    limited "$@" 2> "$scratch/errors" > "$scratch/said"
    status=$?
    check "stream/$name" "exit $status, $(cat "$scratch/peak") KiB, other bytes, or\
 left: $(ls -A "$aside") $(last "$scratch/errors")" is_same "$status"
    [ "$made" = "$scratch/said" ] || rm -f "$made"
}
is_same() {
    [ "$1" = 0 ] && below && cmp -s "$made" "$wanted" && [ -z "$(ls -A "$aside")" ]
}

u=$scratch/u out=$scratch/out
incode gen uniform 300000 -o "$u.npy"
for format in xyz csv ply vtu node; do
    incode convert "$u.npy" "$u.$format"
done
gzip -1 -k "$u.xyz" "$u.npy"

# A .las of records that hold whatever the array has.
{
    zeros() { head -c "$1" /dev/zero; }
    printf 'LASF' && zeros 20 && printf '\1\2' && zeros 68
    printf '\xe3\0\xe3\0\0\0\0\0\0\0\0\x14\0\xe0\x93\x04\0' && zeros 20
    for _ in x y z; do printf '\xfc\xa9\xf1\xd2\x4d\x62\x50\x3f'; done
    zeros 72
    head -c 6000000 "$u.npy"
} > "$u.las"
incode convert "$u.las" "$scratch/las.npy"

for format in npy xyz csv ply vtu node xyz.gz npy.gz; do
    same "points from .$format" "$out.npy" "$u.npy" convert "$u.$format" "$out.npy"
done
for format in npy ply csv xyz.gz; do
    same "points from .$format through a pipe" "$out.npy" "$u.npy" \
        convert - "$out.npy" --format "$format" < <(cat "$u.$format")
done
same 'points from .las' "$out.npy" "$scratch/las.npy" convert "$u.las" "$out.npy"
for format in xyz csv ply vtu node; do
    same "points to .$format" "$out.$format" "$u.$format" \
        convert "$u.npy" "$out.$format"
done
same 'gen' "$out.npy" "$u.npy" gen uniform 300000 -o "$out.npy"

# --- tetrahedra ---------------------------------------------------------------

t=$scratch/t
incode run "$u.npy" -q -o "$t.npy" -o "$t.vtu" -o "$t.msh" -o "$t.ele"
for format in npy vtu msh; do
    incode digest "$t.npy" > "$scratch/digest"
    same "digest of .$format" "$scratch/said" "$scratch/digest" \
        digest "$t.$format"
done
for format in vtu msh; do
    same "tetrahedra to .$format" "$out.$format" "$t.$format" \
        convert "$t.vtu" "$out.$format"
done
same 'tetrahedra to .ele' "$out.ele" "$t.ele" convert "$t.ele" "$out.ele"
same 'neighbours' "$out.neigh" "$t.neigh" run "$u.npy" -q -o "$out.ele"
check 'stream/neighbours: the hull' 'other facets' cmp -s "$out.face" "$t.face"
incode verify "$u.npy" "$t.npy" > "$scratch/verified"
same 'verify' "$scratch/said" "$scratch/verified" verify "$u.npy" "$t.npy"
for picture in svg png; do
    incode draw "$u.npy" "$t.npy" -q -o "$scratch/picture.$picture"
    same "draw .$picture" "$out.$picture" "$scratch/picture.$picture" \
        draw "$u.npy" "$t.npy" -q -o "$out.$picture"
done
# Fewer, as all facets of the boundary are looked beyond then.
v=$scratch/v
incode gen uniform 40000 -o "$v.npy"
incode run "$v.npy" -q -o "$scratch/wrong.npy"
printf '\0\0\0\0' |
    dd of="$scratch/wrong.npy" bs=1 seek=160128 conv=notrunc status=none
limited verify "$v.npy" "$scratch/wrong.npy" > "$scratch/said" 2> "$scratch/errors"
status=$?
finds() { [ $status = 5 ] && below; }
check 'stream/verify finds what is wrong' \
    "exit $status, $(cat "$scratch/peak") KiB: $(last "$scratch/errors")" finds

# --- what is wrong ------------------------------------------------------------

# A pipe whose writer ends too early.
refused() { # NAME PATTERN COMMAND...
    refuses "stream/$1" 3 "$2" limited "${@:3}"
}
left=$scratch/left/o.npy
refused 'a broken pipe, .npy' '^incode: stdin: .* cut short' \
    convert - "$left" --format npy < <(head -c 5000000 "$u.npy")
refused 'a broken pipe, .ply' '^incode: stdin: .* cut short' \
    convert - "$left" --format ply < <(head -c 5000000 "$u.ply")
refused 'a broken pipe, .xyz.gz' '^incode: stdin: .* cut short' \
    convert - "$left" --format xyz.gz < <(head -c 5000000 "$u.xyz.gz")
refused 'a broken pipe, .xyz' '^incode: stdin:250001:[0-9]*: 2 columns ' \
    convert - "$left" --format xyz < <(head -n 250000 "$u.xyz" && printf '1 2')
refused 'a broken pipe, .node' '^incode: stdin:' \
    convert - "$left" --format node < <(head -n 250000 "$u.node")

# Room for what is put aside: files of no more than 4 MiB are a full disk.
full() { (ulimit -f 4096 && limited "$@"); }
no_room="^incode: $aside: no room for the points, .*File too large.*--scratch"
refuses 'stream/no room for points' 3 "$no_room" full convert "$u.npy" "$left"
refuses 'stream/no room for points that are made' 3 "$no_room" \
    full gen uniform 300000 -o "$left"
refuses 'stream/no room for a file that is held whole' 3 \
    "^incode: $aside: no room for .*u.vtu, .*--scratch" \
    full convert "$u.vtu" "$left"
refuses 'stream/no room for tetrahedra' 3 \
    "^incode: $aside: no room for the tetrahedra, .*--scratch" \
    full digest "$t.npy"
limit=(--host-memory 16M --scratch "$scratch/nowhere")
refused 'a folder that is not there' \
    "^incode: $scratch/nowhere: .*No such file.*--scratch" convert "$u.npy" "$left"
limit=(--host-memory 15M)
for command in "convert $u.npy $left" "gen uniform 9 -o $left" \
    "verify $u.npy $t.npy" "digest $t.npy" "draw $u.npy $t.npy -o $left.svg"; do
    # shellcheck disable=SC2086
    refuses "stream/too small a limit for ${command%% *}" 2 \
        '^incode: --host-memory 15M: .*; give 16M or more' limited $command
done
# Without a limit there is one where a file may not fit, and else none.
limit=(--scratch "$scratch/absent")
succeeds 'stream/a file that fits' limited digest "$t.npy"
tight() { (ulimit -d 200000 && limited "$@"); }
refuses 'stream/a file that may not fit' 3 'absent: no scratch file can be made' \
    tight digest "$t.npy"
limit=(--host-memory 16M --scratch "$aside")
refused 'a picture beyond the limit' '^incode: --width: .*give --host-memory 9' \
    draw "$u.npy" "$t.npy" --width 2000 -o "$scratch/left/o.png"
