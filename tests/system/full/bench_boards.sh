#!/usr/bin/env bash
# incode bench boards: a row for each bare board, as a table, CSV and SVG; all
# that is executed is told of.
. tests/system/lib.sh
"${MAKE:-make}" -s bare > "$scratch/made" 2>&1 || cat "$scratch/made"
mapfile -t boards < <(cd "$BUILD/firmware" && ls -- *.img | sed 's/\.img$//')

succeeds 'bench boards/runs' incode bench boards --csv "$scratch/boards.csv" \
    --svg "$scratch/boards.svg" > "$scratch/table"
cat "$scratch/table"
for board in "${boards[@]}"; do
    check "bench boards/$board: a row of the table" 'there is none' \
        grep -q "^$board " "$scratch/table"
    check "bench boards/$board: a row of figures" \
        "$(grep "^$board," "$scratch/boards.csv")" \
        awk -F , -v board="$board" '
            NR == 1 { for (i = 1; i <= NF; i++) if ($i ~ /percent/) part[i] }
            $1 == board { for (i in part) all += $i
                good = all > 99.9 && all < 100.1 && $5 > 1000 && \
                    $(NF - 1) > 0 && $NF > 0 }
            END { exit !good }' "$scratch/boards.csv"
    check "bench boards/$board: a bar" 'there is none' \
        grep -q ">$board</text>" "$scratch/boards.svg"
done
check 'bench boards/svg: is whole' "$(last "$scratch/boards.svg")" \
    grep -q '^</svg>$' "$scratch/boards.svg"
refuses 'bench boards/other options' 2 'no option of bench boards' \
    incode bench boards --quick
