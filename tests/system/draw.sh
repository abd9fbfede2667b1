#!/usr/bin/env bash
# `incode draw`: pictures of a section, and what is refused.
. tests/system/lib.sh
points=$scratch/a.xyz
tets=$scratch/a.ele
left=$scratch/left
mkdir "$left"

incode gen uniform 500 -o "$points" &&
    incode run "$points" -q -o "$tets" -o "$scratch/a.vtu" ||
    fail draw/points 'no points, no picture'

# starts FILE BYTES: whether it starts with these.
starts() { [ "$(head -c ${#2} "$1")" = "$2" ]; }

succeeds draw/svg incode draw -q "$points" "$tets" -o "$left/a.svg"
check draw/svg/file 'it is no SVG' starts "$left/a.svg" '<svg '
succeeds draw/png incode draw -q "$points" "$scratch/a.vtu" -o "$left/a.png" \
    --axis x --at 0.25 --width 333
# Of a PNG, bytes 16 to 19 are its width.
check draw/png/width 'it is not 333 pixels wide' \
    [ "$(od -An -tx1 -j16 -N4 "$left/a.png" | tr -d ' ')" = 0000014d ]
incode draw "$points" - -o - < "$tets" > "$scratch/said" 2> "$scratch/errors"
check draw/standard 'another picture' cmp -s "$scratch/said" "$left/a.svg"
check draw/standard/report "it says: $(cat "$scratch/errors")" \
    grep -q '^-: 640 x .* tetrahedra cut by z = 0' "$scratch/errors"
check draw/quiet 'it is not quiet' \
    [ -z "$(incode draw -q "$points" "$tets" -o "$left/b.svg" 2>&1)" ]
incode draw --help > "$scratch/said"
check draw/help 'no word of --axis' grep -q -e '--axis' "$scratch/said"

draw() { incode draw "$points" "$tets" "$@"; }
refuses draw/beside 3 '--at 7: .* give a z between 0\.00' \
    draw --axis z --at 7 -o "$left/a.svg"
refuses draw/axis 2 'x, y, z' draw --axis w -o "$left/a.svg"
refuses draw/at 2 '--at nan: not a coordinate' draw --at nan -o "$left/a.svg"
refuses draw/at-more 2 '--at 1m: not a coordinate' \
    draw --at 1m -o "$left/a.svg"
refuses draw/width 2 'give 16 to 8192' draw --width 9000 -o "$left/a.svg"
refuses draw/extension 2 'use .svg .png' draw -o "$left/a.jpg"
refuses draw/nowhere 3 'cannot be written' draw -o "$left/no/a.svg"
refuses draw/no-output 2 '-o FILE: missing' draw
refuses draw/few 2 'too few arguments' incode draw "$points"
refuses draw/many 2 'one argument too many' draw c -o "$left/a.svg"
refuses draw/no-points 3 'cannot be opened' \
    incode draw "$left/none.xyz" "$tets" -o "$left/a.svg"
head -n 400 "$points" > "$scratch/few.xyz"
refuses draw/fewer-points 3 'give the points that belong to it' \
    incode draw "$scratch/few.xyz" "$tets" -o "$left/a.svg"
cp "$points" "$scratch/a.svg"
ln -s a.svg "$scratch/b.svg"
refuses draw/over-points 2 'would overwrite the input' \
    incode draw "$scratch/a.svg" "$tets" -o "$scratch/b.svg"
