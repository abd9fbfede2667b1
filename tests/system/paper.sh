#!/usr/bin/env bash
# incode bench paper, on few points and nodes: that its figures fit each other
# and the paper's, that virtual time is the same each time, and what it refuses.
. tests/system/lib.sh
csv=$scratch/rows.csv

refuses paper/table 2 '--table 9: .*allowed: 1, 2, ' \
    "$INCODE" bench paper --table 2,9
refuses paper/strategy 2 '--strategy slow: not in this version' \
    "$INCODE" bench paper --strategy slow
refuses paper/option 2 '--quick: no option of bench links' \
    "$INCODE" bench links --quick
refuses paper/csv 3 'nowhere/rows.csv: ' \
    "$INCODE" bench paper --quick --table 2 --csv "$scratch/nowhere/rows.csv"
incode gen uniform 100 -o "$scratch/few.xyz"
refuses paper/fin 3 'few.xyz: 100 points, where .* has 40960' \
    "$INCODE" bench paper --quick --table 4 --nodes 1 \
    --bluntfin "$scratch/few.xyz"

paper() { # FILE OPTION...: quick, up to eight nodes
    within "$INCODE" bench paper --quick --nodes 8 --csv "$1" "${@:2}" \
        > "$scratch/said"
}
succeeds paper/tables paper "$csv" --table 2,3,4 --strategy spatial
mv "$scratch/said" "$scratch/tables"
succeeds paper/again paper "$scratch/again.csv" --table 2,3,4 \
    --strategy spatial
check paper/same 'the same runs took other virtual times' \
    cmp -s "$csv" "$scratch/again.csv"
check paper/model 'the model is not stated' \
    grep -q '^nCUBE 2: scale [0-9]*, which makes .* 1670.25 s' "$scratch/tables"
check paper/beside "not the paper's times beside eight nodes" \
    grep -qE '^8 .*\| +252.48 +312.52 +3.48 +5.34 +0.67 +1.14 ' \
    "$scratch/tables"

# Of every row: what follows from what.  Speed-ups of a set and a machine are
# against one time.
awk -F, '
    function near(a, b) { return a - b < 1e-6 * b && b - a < 1e-6 * b }
    NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i; fields = NF; next }
    {
        rows++
        t = $at["t_max_s"]; up = $at["speed_up"]; n = $at["nodes"]
        group = $at["set"] $at["points"] $at["machine"]
        if (!(group in alone)) alone[group] = up * t
        if (!(group in tets)) tets[group] = $at["tetrahedra"]
        if (NF != fields || $at["t_min_s"] <= 0 || $at["t_min_s"] > t ||
            !near(up * t, alone[group]) || !near($at["efficiency"], up / n) ||
            $at["efficiency"] > 1.02 || $at["duplication_factor"] < 1 ||
            $at["tetrahedra"] != tets[group] || $at["t_io_s"] <= 0 ||
            !near($at["tetrahedra_per_s"], tets[group] / t)) {
            print "row " NR ": " $0
            bad = 1
        }
        if (n == 8 && $at["duplication_factor"] <= 1.05) {
            print "row " NR ": eight regions without a border"
            bad = 1
        }
    }
    END { if (rows != 4 * 4 + 2 * 4 + 3 * 2 * 4) { print rows " rows"; bad = 1 }
          exit bad }' "$csv" > "$scratch/wrong"
status=$?
check paper/rows "$(head -1 "$scratch/wrong")" [ $status = 0 ]

# The authors' estimate is for ten times the points.
succeeds paper/relation within "$INCODE" bench paper --quick --nodes 64 \
    --table relation > "$scratch/relation"
check paper/held "a tenth of the points is held to an estimate for all" \
    grep -q '64 nodes: .* not held to a tenth' "$scratch/relation"
check paper/true 'an estimate comes true, or not, at a tenth of the points' \
    [ -s "$scratch/relation" -a \
        "$(grep -c 'come.* true' "$scratch/relation")" = 0 ]

succeeds paper/measured paper "$scratch/measured.csv" --table 1,check
check paper/naive 'not six sizes, each with three indexes' \
    [ "$(grep -c ',measured,sequential,.*,\(naive\|grid\|kd\),' \
        "$scratch/measured.csv")" = 18 ]
check paper/prices 'no prices fitted to runs' \
    grep -q '^Prices fitted to 8 runs' "$scratch/said"
check paper/error 'no error of the model on two nodes' \
    grep -qE '^Uniform +2000 +2 .* %.* %$' "$scratch/said"

refuses paper/svg-alone 2 "goes with table 11" \
    incode bench paper --quick --table 2 --svg "$scratch/2.svg"
if command -v gnuplot > /dev/null; then
    succeeds paper/figure paper "$scratch/figure.csv" --table 11 \
        --svg "$scratch/figure.svg"
    check paper/svg 'no curves in the figure' \
        grep -q '<path' "$scratch/figure.svg"
else
    refuses paper/no-gnuplot 3 "gnuplot is not installed" \
        incode bench paper --quick --svg "$scratch/f.svg"
    skip paper/svg 'gnuplot is not installed: make bench installs it'
fi
