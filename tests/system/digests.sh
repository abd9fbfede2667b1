#!/usr/bin/env bash
# Every real set with kd and spatial on 8 nodes, in 512 KiB and in 4 MiB: the
# digest of the index and the same bytes.  Flat sets are refused.  Nodes of
# 512 KiB pass the pages of a large set around for most of a minute: those past
# `small_max` points are for `make test-full`.
. tests/system/lib.sh
need_data digests
small_max=${SMALL_MAX:-15000}

while read -r set file points _ tetrahedra digest; do
    if [ -n "$(no_set "$file" "$points")" ]; then
        skip "digests/$set" "$(no_set "$file" "$points")"
        continue
    fi
    for memory in 512K 4M; do
        if [ $memory = 512K ] && [ "$points" -gt "$small_max" ]; then
            skip "digests/$set $memory" "more than $small_max points"
            continue
        fi
        if [ "$tetrahedra" = 0 ]; then
            refuses "digests/$set $memory" 3 'plane|line' "$INCODE" run \
                "$INCODE_DATA/$file" -q --strategy spatial --nodes 8 \
                --memory $memory -o "$scratch/left/out.npy"
            continue
        fi
        # Every offence of a small set is looked for as well.
        verify=$([ "$points" -lt 20000 ] && echo --verify)
        triangulates "digests/$set $memory" "$set" "$INCODE_DATA/$file" \
            "$digest" --strategy spatial --nodes 8 --memory $memory $verify
    done
    rm -f "$scratch/first.$set.npy"
done < <(list_sets)
