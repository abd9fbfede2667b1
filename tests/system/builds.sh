#!/usr/bin/env bash
# Every real set point by point, where all its points fit, and as `auto` has it
# in the usual memory: the digest of the index and the same bytes.  `auto` takes
# points where what is not final fits and one node has all bricks of a volume, or
# some of a surface, and faces else; what is asked for by points and does not fit
# is done by faces.
. tests/system/lib.sh
large=64M

# built_by NAME HOW: what the last run's nodes say.
built_by() {
    local found
    found=$(jq -r '[.per_node[].built_by] | unique | join(" ")' \
        "$scratch/stats.json")
    check "$1, how" "by $found, not by $2" [ "$found" = "$2" ]
}

# A run, and how its nodes found the tetrahedra.
goes_by() { # HOW POINTS OPTION...
    local how=$1 points=$2
    shift 2
    succeeds "builds/$(basename "$points") $*" incode run "$points" -q \
        --stats "$scratch/stats.json" "$@" &&
        built_by "builds/$(basename "$points") $*" "$how"
}

incode gen uniform 3000 -o "$scratch/uniform.npy"
incode gen sphere 3000 -o "$scratch/sphere.npy"
incode gen uniform 20000 -o "$scratch/many.npy"
incode gen lines 3000 -o "$scratch/lines.npy"
awk 'BEGIN { for (i = 0; i < 28; i++) for (j = 0; j < 28; j++)
    for (k = 0; k < 28; k++) printf "%.1f %.1f %.1f\n", i / 10, j / 10,
        k / 10 }' > "$scratch/decimal.xyz"
one='--strategy sequential --nodes 1'
two='--strategy spatial --nodes 2'
# shellcheck disable=SC2086
{
    goes_by points "$scratch/uniform.npy" $one
    goes_by faces "$scratch/uniform.npy" $two
    goes_by points "$scratch/uniform.npy" $two --build points
    goes_by points "$scratch/sphere.npy" $two
    goes_by faces "$scratch/sphere.npy" $two --build faces
    goes_by points "$scratch/sphere.npy" --strategy spatial --nodes 4
    goes_by points "$scratch/sphere.npy" --strategy spatial --nodes 8 \
        --memory 512K
    goes_by faces "$scratch/many.npy" --strategy spatial --nodes 8
    goes_by faces "$scratch/uniform.npy" $one --build faces
    goes_by faces "$scratch/uniform.npy" $one --index grid --build points
    goes_by faces "$scratch/uniform.npy" $two --face-rule paper --build points
    goes_by points "$scratch/many.npy" $one
    goes_by points "$scratch/many.npy" $one --memory $large
    goes_by faces "$scratch/many.npy" $one --memory 640K
    goes_by both "$scratch/many.npy" $one --memory 640K --build points
    # Its ties are rounded: each bound of what is final is needed.
    goes_by points "$scratch/decimal.xyz" $one --memory 640K --build points
    check builds/decimal "$(stat_of "$scratch/stats.json" tetrahedra)" \
        [ "$(stat_of "$scratch/stats.json" tetrahedra)" = 118098 ]
    # They have the square of their number of tetrahedra.
    goes_by points "$scratch/lines.npy" $one
}

sets() { # MOST
    while read -r set file points _ tetrahedra digest; do
        [ "$tetrahedra" = 0 ] && continue
        if [ -n "$(no_set "$file" "$points")" ]; then
            skip "builds/$set" "$(no_set "$file" "$points")"
            continue
        fi
        # shellcheck disable=SC2086
        if [ "$points" -le 65472 ]; then
            triangulates "builds/$set points $large" "$set" \
                "$INCODE_DATA/$file" "$digest" $one --build points \
                --memory $large
            built_by "builds/$set points $large" points
        fi
        # shellcheck disable=SC2086
        [ "$points" -gt 25000 ] ||
            triangulates "builds/$set auto 4M" "$set" "$INCODE_DATA/$file" \
                "$digest" $one --memory 4M
        rm -f "$scratch/first.$set.npy"
    done < <(list_sets)
}
if has_data builds; then sets; fi
# shellcheck disable=SC2034
INCODE_DATA=$INCODE_REAL folder=INCODE_REAL
if has_data builds; then sets; fi
