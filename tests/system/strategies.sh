#!/usr/bin/env bash
# Every set through every strategy of more nodes than one but `spatial`, which
# digests.sh tries: on 4, 8 and 32 nodes, in little memory, a face at a time, with
# fewer builders than there are nodes.  Sets past `kd_max` points are for
# `make test-full`.
. tests/system/lib.sh
need_data strategies
kd_max=${KD_MAX:-10000}

rows='
master-slaves --nodes 2
master-slaves --nodes 4 --faces-per-job 1 --jobs-per-worker 1
master-slaves --nodes 8 --memory 640K --builders 3
master-slaves --nodes 32
hybrid --nodes 4 --cluster 2
hybrid --nodes 8 --memory 640K
hybrid --nodes 32 --cluster 8 --builders 5 --faces-per-job 96
linda --nodes 4
linda --nodes 8 --memory 640K --linda spatial
linda --nodes 32 --faces-per-job 7
exchange --nodes 4
exchange --nodes 8 --memory 640K
exchange --nodes 32'

while read -r set file points _ tetrahedra digest; do
    if [ -n "$(no_set "$file" "$points")" ]; then
        skip "strategies/$set" "$(no_set "$file" "$points")"
    elif [ "$points" -gt "$kd_max" ]; then
        skip "strategies/$set" "more than $kd_max points"
    elif [ "$tetrahedra" != 0 ]; then
        while read -r strategy options; do
            # shellcheck disable=SC2086
            triangulates "strategies/$set, $strategy $options" "$set" \
                "$INCODE_DATA/$file" "$digest" --strategy $strategy $options
        done < <(echo "$rows" | grep .)
        rm -f "$scratch/first.$set.npy"
    fi
done < <(list_sets)

# Another index is the builders' own.
set=$INCODE_DATA/deg_cgal_lp500.xyz
digest=$(list_sets | awk '$1 == "deg_cgal_lp500" { print $6 }')
for index in naive grid; do
    triangulates "strategies/$index" deg_cgal_lp500 "$set" "$digest" \
        --strategy master-slaves --nodes 4 --index $index
done
