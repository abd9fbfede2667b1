#!/usr/bin/env bash
# The host of a cube in 16M, with every strategy, both ways to build and the
# indexes, on every set, checked exactly: the digests of the indexes.  Strategies
# that lend lists of faces take minutes for more than `lists_max` points.  Two
# hours.
. tests/system/lib.sh
lists_max=${LISTS_MAX:-40000}

# limited NAME SET FILE DIGEST [OPTION...]: the same output, and the peak is below.
limited() {
    local size=$((16 << 20)) peak
    triangulates "$1" "$2" "$3" "$4" --host-memory 16M --scratch "$scratch" \
        --verify "${@:5}"
    peak=$(stat_of "$scratch/stats.json" host_peak_bytes)
    check "$1: peak" "$peak bytes of $size" [ "$peak" -lt $size ]
}

# sets: those of the index in $INCODE_DATA.
sets() {
    local set file points tetrahedra digest build
    while read -r set file points _ tetrahedra digest; do
        [ "$tetrahedra" = 0 ] && continue
        if [ -n "$(no_set "$file" "$points")" ]; then
            skip "memory_cube/$set" "$(no_set "$file" "$points")"
            continue
        fi
        each() { limited "memory_cube/$set $*" "$set" "$INCODE_DATA/$file" "$digest" "$@"; }
        for build in faces points; do
            each --strategy sequential --nodes 2 --build $build
            each --strategy spatial --nodes 4 --build $build
            each --strategy linda --linda spatial --nodes 4 --build $build
        done
        each --strategy exchange --nodes 4
        each --strategy spatial --nodes 4 --partition uniform --face-rule paper
        if [ "$points" -le "$lists_max" ]; then
            each --strategy master-slaves --nodes 4
            each --strategy linda --nodes 4
            each --strategy hybrid --nodes 8
            each --strategy spatial --nodes 4 --index grid
        else
            skip "memory_cube/$set: lists of faces" "more than $lists_max points"
        fi
        rm -f "$scratch/first.$set.npy"
    done < <(list_sets)
}

need_data memory_cube
sets
# shellcheck disable=SC2034
INCODE_DATA=$INCODE_REAL folder=INCODE_REAL
need_data memory_cube/real
sets
