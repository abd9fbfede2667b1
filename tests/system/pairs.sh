#!/usr/bin/env bash
# Pairwise coverage of index, nodes, memory, the seed that shuffles which page
# is ready when, and how tetrahedra are found, for `sequential`; and of these,
# partition and face rule for `spatial`.  That the rows cover every pair is
# checked too.  (Points are inserted with `kd` and `own` alone.)
# Sets past `naive_max` points are left out with `naive`, whose work is n^2, and
# past `grid_max` with `grid`; those past `kd_max` are for digests.sh, and for
# `make test-full`; so are `grid` and `naive` on many nodes of little memory.
. tests/system/lib.sh
with_faults
need_data pairs
naive_max=${NAIVE_MAX:-5000}
grid_max=${GRID_MAX:-10000}
kd_max=${KD_MAX:-10000}

rows='
sequential grid 1 1M 1 points
sequential grid 2 512K 1 faces
sequential grid 32 4M 2 auto
sequential grid 8 1M 0 faces
sequential kd 1 4M 2 faces
sequential kd 1 1M 1 points
sequential kd 2 4M 0 auto
sequential kd 32 1M 1 auto
sequential kd 32 512K 0 points
sequential kd 8 512K 2 auto
sequential naive 1 512K 0 auto
sequential naive 2 1M 2 points
sequential naive 32 4M 1 faces
sequential naive 8 4M 1 points
spatial grid 1 1M 1 faces adaptive paper
spatial grid 2 512K 0 points uniform own
spatial grid 32 4M 2 points uniform paper
spatial grid 8 1M 0 auto adaptive paper
spatial kd 1 4M 0 auto adaptive own
spatial kd 2 1M 2 auto adaptive paper
spatial kd 2 4M 2 points adaptive own
spatial kd 32 1M 0 points uniform paper
spatial kd 32 512K 1 auto adaptive own
spatial kd 8 1M 1 points uniform own
spatial kd 8 512K 2 faces uniform own
spatial naive 1 1M 2 auto uniform own
spatial naive 1 512K 1 points adaptive paper
spatial naive 2 4M 1 faces adaptive own
spatial naive 32 4M 0 faces adaptive paper
spatial naive 8 4M 1 points uniform paper'

missing=$(echo "$rows" | awk '
    NF {
        for (i = 2; i <= NF; i++) {
            values[$1, i] = values[$1, i] \
                (index(values[$1, i] " ", " " $i " ") ? "" : " " $i)
            for (j = i + 1; j <= NF; j++) seen[$1, i, $i, j, $j]
        }
        if (NF > last[$1]) last[$1] = NF
    }
    END {
        for (s in last)
            for (i = 2; i <= last[s]; i++)
                for (j = i + 1; j <= last[s]; j++) {
                    n = split(values[s, i], a, " ")
                    m = split(values[s, j], b, " ")
                    for (k = 1; k <= n; k++)
                        for (l = 1; l <= m; l++)
                            if (!((s, i, a[k], j, b[l]) in seen))
                                print s, a[k], b[l]
                }
    }' | tr '\n' ';')
check "pairs/every pair of options is covered" "$missing" test -z "$missing"

while read -r set file points _ tetrahedra digest; do
    [ "$tetrahedra" = 0 ] && continue
    if [ -n "$(no_set "$file" "$points")" ]; then
        skip "pairs/$set" "$(no_set "$file" "$points")"
        continue
    fi
    if [ "$points" -gt "$kd_max" ]; then
        skip "pairs/$set" "more than $kd_max points"
        continue
    fi
    while read -r strategy index nodes memory seed build partition rule; do
        [ -n "$strategy" ] || continue
        [ "$index" = naive ] && [ "$points" -gt "$naive_max" ] && continue
        [ "$index" = grid ] && [ "$points" -gt "$grid_max" ] && continue
        triangulates "pairs/$set $strategy $index $nodes $memory $seed $build \
${partition:-} ${rule:-}" "$set" "$INCODE_DATA/$file" "$digest" \
            --strategy "$strategy" --index "$index" --nodes "$nodes" \
            --memory "$memory" --shuffle-seed "$seed" --build "$build" \
            ${partition:+--partition "$partition" --face-rule "$rule"}
    done <<< "$rows"
    rm -f "$scratch/first.$set.npy"
done < <(list_sets)
