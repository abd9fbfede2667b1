#!/usr/bin/env bash
# incode bench peers, on few points: what it prints, what it refuses, and that
# it tells where tetrahedra are not CGAL's.
. tests/system/lib.sh
top=$PWD
[[ $INCODE = /* ]] || INCODE=$top/$INCODE

refuses peers/class 2 '--class tiny: .*allowed: .*growth' \
    "$INCODE" bench peers --class tiny
refuses peers/name 2 '--peers gmsh: .*allowed: cgal, tetgen, qhull, hxt, hxt2' \
    "$INCODE" bench peers --peers cgal,gmsh
refuses peers/option 2 '--rounds: no option of bench links' \
    "$INCODE" bench links --rounds 2
refuses peers/file 3 'nowhere.xyz: ' "$INCODE" bench peers nowhere.xyz
cd "$scratch" || exit 1
refuses peers/elsewhere 2 'run it at the top of the source tree' \
    "$INCODE" bench peers
cd "$top" || exit 1

# HXT, whose structures the peer declares itself: it has each tetrahedron, on
# one thread and on two.
if [ -r /usr/include/gmsh.h ]; then
    mkdir "$scratch/even"
    incode gen uniform 6000 -o "$scratch/even/even.npy"
    succeeds peers/hxt within "$INCODE" bench peers --rounds 1 \
        --peers hxt,hxt2 --class real "$scratch/even" > "$scratch/table"
    check peers/columns 'no times of HXT and HXT x2' \
        grep -qE '^even +6000( +[0-9]+){5} ' "$scratch/table"
    all=$(incode run "$scratch/even/even.npy" -q --stats - | jq .tetrahedra)
    for threads in 1 2; do
        has=$("$BUILD/peers/hxt" "$scratch/even/even.npy" "$threads" |
            jq .tetrahedra)
        check "peers/hxt $threads" "$has tetrahedra, not $all" \
            [ "${has:-none}" = "$all" ]
    done
else
    skip peers/hxt 'libgmsh-dev is not installed: make bench installs it'
fi
if [ ! -r /usr/include/CGAL/version.h ]; then
    skip peers/cgal 'CGAL is not installed: make bench installs it'
    exit 0
fi
mkdir "$scratch/sets"
incode gen sphere 300 -o "$scratch/sets/few.xyz"
incode gen uniform 6000 -o "$scratch/sets/many.npy"
printf '0 0 0\n1 0 0\n0 1 0\n2 3 0\n' > "$scratch/sets/flat.xyz"
echo 'no points' > "$scratch/sets/INDEX.md"
peers() { # CLASS: on those sets
    within "$INCODE" bench peers --rounds 1 --peers cgal --class "$1" \
        "$scratch/sets" > "$scratch/table" 2> "$scratch/errors"
}
succeeds peers/small peers small
check peers/few 'no row of the set with few points' \
    grep -qE '^few +300 +[0-9]+ +[0-9]+ +[0-9]+ +[0-9]+ ' "$scratch/table"
check peers/flat 'no word of the flat set' \
    grep -q 'flat: left out: .*plane' "$scratch/errors"
succeeds peers/real peers real
check peers/many 'not one row, of the set with many points' \
    [ "$(grep -cE '^(few|many|flat) ' "$scratch/table")" = 1 ]
check peers/median 'no median of its ratio' \
    grep -qE '^CGAL / incode: median [0-9.]+ >=2!?, .*, of 1$' "$scratch/table"
succeeds peers/locate within "$INCODE" bench peers --rounds 1 --peers cgal \
    --class locate > "$scratch/table"
check peers/located 'no rows of queries that incode and CGAL locate' \
    [ "$(grep -cE '^uniform +[0-9]+ +1[0-9]{5} +[0-9]+ +[0-9]+ +[0-9.]+ ' \
        "$scratch/table")" = 2 ]

# A tree whose peer says what is not so.
fake=$scratch/fake
mkdir -p "$fake/tests/bench" "$fake/bin" "$fake/build/peers"
cp "$INCODE" "$BUILD/incode-node" "$fake/bin"
touch "$fake/tests/bench/peer.hpp"
printf 'build/peers/cgal build/peers/locate build/peers/cgal_locate:\n' \
    > "$fake/Makefile"
cat > "$fake/build/peers/cgal" <<'END'
#!/bin/sh
echo '{"tetrahedra": 7, "cpu_s": 1, "wall_s": 1, "digest": "sha256:00"}'
END
chmod +x "$fake/build/peers/cgal"
cd "$fake" || exit 1
within bin/incode bench peers --rounds 1 --peers cgal --class small \
    "$scratch/sets/few.xyz" > "$scratch/table" 2> "$scratch/errors"
status=$?
check peers/wrong "status $status, not 1" [ $status = 1 ]
check peers/differs 'no word of what differs' \
    grep -q 'few: sha256:.*, where CGAL has sha256:00' "$scratch/errors"
# One that locates other tetrahedra, and one that locates nothing.
# located PROGRAM COUNT SUM
located() {
    printf '#!/bin/sh\necho '"'"'{"tetrahedra": %d, "cpu_s": 1, "wall_s": 1, %s' \
        "$2" "\"digest\": \"sum:$3\"}'" > "build/peers/$1"
    chmod +x "build/peers/$1"
}
# locates_wrongly NAME: what the bench says of it.
locates_wrongly() {
    within bin/incode bench peers --rounds 1 --peers cgal --class locate \
        > "$scratch/table" 2> "$scratch/errors"
    status=$?
    check "peers/$1: status" "status $status, not 1" [ $status = 1 ]
    check "peers/$1: reason" "$(cat "$scratch/errors")" \
        grep -qE "^incode: uniform: $2" "$scratch/errors"
}
located locate 9 12
located cgal_locate 9 34
locates_wrongly 'other tetrahedra' 'sum:12, where CGAL has sum:34'
located cgal_locate 0 12
locates_wrongly 'nothing located' 'CGAL ended with status 0'
located locate 0 12
located cgal_locate 9 12
locates_wrongly 'nothing located by the library' 'incode ended with status 0'
# And one that has no end.
# clock: a peer that is still at work when its time is over
printf '#!/bin/sh\nexec sleep 60\n' > build/peers/cgal
succeeds peers/endless within bin/incode bench peers --rounds 1 --peers cgal \
    --class small --limit 1 "$scratch/sets/few.xyz" > "$scratch/table"
check peers/limit 'it was waited for' grep -q '^few ' "$scratch/table"
