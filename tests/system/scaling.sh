#!/usr/bin/env bash
# incode bench scaling, quick: that its rows are there and fit each other, and
# what it refuses.
. tests/system/lib.sh
csv=$scratch/rows.csv

refuses scaling/option 2 '--table: no option of bench scaling' \
    "$INCODE" bench scaling --table 2
refuses scaling/quick 2 '--quick: no option of bench boards' \
    "$INCODE" bench boards --quick
refuses scaling/csv 3 'nowhere/rows.csv: ' \
    "$INCODE" bench scaling --quick --csv "$scratch/nowhere/rows.csv"

scaling() { # OPTION...: quick, up to four nodes
    within "$INCODE" bench scaling --quick --nodes 4 "$@" > "$scratch/said"
}
succeeds scaling/tables scaling --csv "$csv"
check scaling/points 'not a row for each number of points' \
    [ "$(grep -cE '^ +(1000|3000|10000|30000) +[0-9]+ +[1-5] ' \
        "$scratch/said")" = 4 ]
check scaling/nodes 'not a row for each number of nodes' \
    [ "$(grep -cE '^ +[124] \| .* \| ' "$scratch/said")" = 3 ]

# incode bench scale: a row without a limit and one within it, a size.
refuses scaling/scale-sizes 2 '--sizes 1000,x: ' \
    "$INCODE" bench scale --sizes 1000,x
refuses scaling/scale-option 2 '--sizes: no option of bench scaling' \
    "$INCODE" bench scaling --sizes 1000
refuses scaling/scale-folder 3 'nowhere/incode-scale-.*--scratch' \
    "$INCODE" bench scale --sizes 1000 --scratch "$scratch/nowhere"
succeeds scaling/scale within "$INCODE" bench scale --sizes 2000,60000 \
    --host-memory 16M --scratch "$scratch" --csv "$scratch/scale.csv" \
    > "$scratch/said"
check scaling/scale-rows "$(tr '\n' ' ' < "$scratch/scale.csv")" awk -F, '
    NR == 1 { next }
    { bad = bad || $2 < 6 * $1 || $4 <= 0 || $5 < 1000000 }
    $3 == "none" { tets = $2; free++; bad = bad || $6 > 0 }
    $3 == "16M" { limited++; bad = bad || $2 != tets || $6 == 0 || $5 > 2 ^ 24 }
    END { exit bad || free != 2 || limited != 2 }' "$scratch/scale.csv"
check scaling/scale-leaves-nothing "$(ls "$scratch")" \
    [ -z "$(compgen -G "$scratch/incode-scale-*")" ]

# The number of tetrahedra is the strategy's nowhere; no node works longer than
# all together, nor as long for more of them.
awk -F, '
    NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i; fields = NF; next }
    { rows++; bad = bad || NF != fields }
    $at["how"] == "measured" {
        bad = bad || $at["node_ns"] <= 0 || $at["host_ns"] <= 0
        tets[$at["points"]] = $at["tetrahedra"]
    }
    $at["how"] == "modelled" {
        one = $at["busiest_ns"]; all = $at["all_ns"]; s = $at["strategy"]
        bad = bad || one * $at["nodes"] < all * 0.999999 || one > all * 1.000001
        bad = bad || (s in before && one >= before[s])
        bad = bad || $at["wire_bytes"] < 5
        bad = bad || $at["tetrahedra"] != tets[$at["points"]]
        before[s] = one
    }
    END { exit bad || rows != 4 + 2 * 3 }' "$csv"
status=$?
check scaling/rows "rows that do not fit: $(tr '\n' ' ' < "$csv")" \
    [ $status = 0 ]

if command -v gnuplot > /dev/null; then
    succeeds scaling/figure scaling --svg "$scratch/figure.svg"
    check scaling/svg 'no curves in the figure' \
        grep -q '<path' "$scratch/figure.svg"
    succeeds scaling/scale-figure within "$INCODE" bench scale --sizes 500,2000 \
        --svg "$scratch/scale.svg" > "$scratch/said"
    check scaling/scale-svg 'no curves in the figure' \
        grep -q '<path' "$scratch/scale.svg"
else
    refuses scaling/no-gnuplot 3 'gnuplot is not installed' \
        "$INCODE" bench scaling --quick --svg "$scratch/f.svg"
    skip scaling/svg 'gnuplot is not installed: make bench installs it'
fi
