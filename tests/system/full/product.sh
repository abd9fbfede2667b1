#!/usr/bin/env bash
# Every set with every strategy, partition, face rule, index, number of nodes
# and memory.  `naive` is left out past `naive_max` points, for its work is
# n^2; each set so left out is named.
. tests/system/lib.sh
need_data product
naive_max=${NAIVE_MAX:-15000}

while read -r set file points _ tetrahedra digest; do
    [ "$tetrahedra" = 0 ] && continue
    if [ -n "$(no_set "$file" "$points")" ]; then
        skip "product/$set" "$(no_set "$file" "$points")"
        continue
    fi
    for index in kd grid naive; do
        if [ $index = naive ] && [ "$points" -gt "$naive_max" ]; then
            skip "product/$set naive" "more than $naive_max points"
            continue
        fi
        for nodes in 1 2 8 32; do
            for memory in 512K 1M 2M 4M; do
                triangulates "product/$set $index $nodes $memory sequential" \
                    "$set" "$INCODE_DATA/$file" "$digest" --index $index \
                    --nodes $nodes --memory $memory --strategy sequential
                for partition in uniform adaptive; do
                    for rule in own paper; do
                        triangulates "product/$set $index $nodes $memory \
spatial $partition $rule" "$set" "$INCODE_DATA/$file" "$digest" \
                            --index $index --nodes $nodes --memory $memory \
                            --strategy spatial --partition $partition \
                            --face-rule $rule
                    done
                done
            done
        done
    done
    rm -f "$scratch/first.$set.npy"
done < <(list_sets)
