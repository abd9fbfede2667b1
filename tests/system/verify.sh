#!/usr/bin/env bash
# `incode verify` finds what is wrong in other people's tetrahedra, exit 5.
. tests/system/lib.sh

"$INCODE" gen uniform 200 --seed 3 -o "$scratch/p.xyz" 2> /dev/null
"$INCODE" run "$scratch/p.xyz" -q --nodes 1 -o "$scratch/p.ele" ||
    fail 'verify/a set to spoil' 'the run failed'
check 'verify/a right result' "$("$INCODE" verify "$scratch/p.xyz" \
    "$scratch/p.ele" 2>&1)" "$INCODE" verify "$scratch/p.xyz" "$scratch/p.ele"

# spoil NAME AWK: the result, changed by awk on its rows, must not verify.
spoil() {
    local name=$1 program=$2 status
    awk "NR == 1 { rows = \$1; next } /^#/ { next } { $program }" \
        "$scratch/p.ele" | awk '{ $1 = NR - 1; print }' > "$scratch/rows"
    { echo "$(wc -l < "$scratch/rows") 4 0"; cat "$scratch/rows"; } \
        > "$scratch/bad.ele"
    "$INCODE" verify "$scratch/p.xyz" "$scratch/bad.ele" > "$scratch/output" \
        2>&1
    status=$?
    check "verify/$name" "exit $status: $(last "$scratch/output")" \
        test $status = 5
}
spoil 'a missing tetrahedron' 'if (NR != 40) print'
spoil 'a missing tetrahedron at the end' 'if (NR != rows + 1) print'
spoil 'a tetrahedron twice' 'print; if (NR == 30) print'
spoil 'a negative tetrahedron' \
    'if (NR == 50) { t = $4; $4 = $5; $5 = t } print'
spoil 'a wrong vertex' 'if (NR == 60) $5 = ($5 + 7) % 200; print'
spoil 'a flat tetrahedron' 'print; if (NR == 20) print $1, $2, $3, $4, $4'
spoil 'nothing' ''

# A convex set cut the other way: two tetrahedra for three, or three for two.
printf '0 0 0\n4 0 0\n0 4 0\n1 1 5\n1.2 1.1 -5\n' > "$scratch/five.xyz"
"$INCODE" run "$scratch/five.xyz" -q --nodes 1 -o "$scratch/five.ele"
flip() {
    if [ "$(head -n 1 "$scratch/five.ele" | cut -d ' ' -f 1)" = 2 ]; then
        printf '3 4 0\n0 0 1 3 4\n1 1 2 3 4\n2 2 0 3 4\n'
    else
        printf '2 4 0\n0 0 1 2 3\n1 0 2 1 4\n'
    fi
}
flip > "$scratch/flipped.ele"
"$INCODE" verify "$scratch/five.xyz" "$scratch/flipped.ele" \
    > "$scratch/output" 2>&1
status=$?
check 'verify/a triangulation that is not Delaunay' \
    "exit $status: $(last "$scratch/output")" test $status = 5

printf '1 4 0\n0 0 1 2 200\n' > "$scratch/far.ele"
"$INCODE" verify "$scratch/p.xyz" "$scratch/far.ele" > "$scratch/output" 2>&1
status=$?
check 'verify/a vertex that is no point' \
    "exit $status: $(last "$scratch/output")" test $status = 5
