#!/usr/bin/env bash
# The library as programs use it: the rows of a cube's run, byte for byte; points
# that are located, and edges; two calls at once; cancelling; memory and threads
# that fail.  install.sh has its page's examples, and the names that are seen from
# outside.
. tests/system/lib.sh
# Of this build.  The thread sanitizer knows few places for memory.
user=(setarch -R "$BUILD/tests/library")

succeeds library/arguments "${user[@]}" arguments

# same NAME FILE.xyz: the rows of a cube's run, with 1 to 3 threads.
same() {
    local threads
    succeeds "library/$1, a cube" incode run "$2" -q --nodes 2 --memory 4M \
        -o "$scratch/cube.npy"
    for threads in 1 2 3; do
        succeeds "library/$1, $threads threads" within "${user[@]}" rows "$2" \
            $threads "$scratch/rows.npy"
        check "library/$1, $threads threads, rows" 'they differ from the cube'"'"'s' \
            cmp -s "$scratch/rows.npy" "$scratch/cube.npy"
        rm -f "$scratch/rows.npy"
    done
    succeeds "library/$1, located" within "${user[@]}" locate "$2" 2
    succeeds "library/$1, incode run" incode run "$2" -q -o "$scratch/rows.npy"
    check "library/$1, incode run, rows" 'they differ from the cube'"'"'s' \
        cmp -s "$scratch/rows.npy" "$scratch/cube.npy"
    rm -f "$scratch/cube.npy" "$scratch/rows.npy"
}
for kind in uniform bubbles bluntfin sphere grid hub; do
    "$INCODE" gen $kind 3000 --seed 7 -o "$scratch/$kind.xyz"
    same $kind "$scratch/$kind.xyz"
done
awk 'BEGIN { for (i = 0; i < 20; i++) for (j = 0; j < 20; j++)
    for (k = 0; k < 20; k++) printf "%.17g %.17g %.17g\n", i / 10, j / 10, k / 10
    print "0.5 0.5 0.5\n-0.0 0 0\n0 0 0" }' > "$scratch/lattice.xyz"
same 'a lattice of decimal steps, with duplicates' "$scratch/lattice.xyz"
awk 'BEGIN { for (i = 0; i < 60; i++) for (j = 0; j < 60; j++)
    print i, j, 3 * i + 5 * j; print 100, 100, 1000 }' > "$scratch/tilted.xyz"
same 'a tilted plane' "$scratch/tilted.xyz"
if has_data library; then
    while read -r set file points _ tetrahedra _; do
        [ "$tetrahedra" = 0 ] || [ "$points" -gt "${POINTS_MAX:-12000}" ] &&
            continue
        zcat -f "$INCODE_DATA/$file" > "$scratch/set.xyz"
        same "$set" "$scratch/set.xyz"
    done < <(list_sets)
fi

if command -v g++ > "$scratch/where"; then
    succeeds 'library/the header in C++' g++ -std=c++11 -Wall -Wextra -Werror \
        -pedantic -fsyntax-only -x c++ host/library/incode.h
else
    skip 'library/the header in C++' 'g++ is not installed'
fi
succeeds 'library/two calls at once' "${user[@]}" twice "$scratch/bubbles.xyz"
succeeds 'library/memory and threads that fail' "${user[@]}" failing \
    "$scratch/uniform.xyz" > "$scratch/tried"
check 'library/so many were tried' "$(xargs < "$scratch/tried")" \
    awk '{ n += $1 > 15 } END { exit n != 2 }' "$scratch/tried"
"$INCODE" gen uniform "${POINTS_MAX:-60000}" -o "$scratch/many.xyz"
succeeds library/cancelled "${user[@]}" cancel "$scratch/many.xyz" \
    > "$scratch/longest"
check 'library/it tells how long that took' "after $(cat "$scratch/longest") ms" \
    grep -qE '^[0-9]+$' "$scratch/longest"

# What `incode run` does where no option speaks of a cube.
direct="$scratch/uniform.xyz"
for threads in 1 3; do
    succeeds "direct/$threads threads" incode run "$direct" --threads $threads \
        --verify --stats "$scratch/stats.json" -o "$scratch/rows.npy" \
        > "$scratch/output"
    check "direct/$threads threads, last line" "$(last "$scratch/output")" \
        grep -q "^direct on $threads thread.*; verified$" "$scratch/output"
    check "direct/$threads threads, statistics" "$(head -30 "$scratch/stats.json")" \
        jq -e ".strategy == \"direct\" and .link == \"memory\" and
            .nodes == $threads and (.per_node | length) == $threads and
            .verified and .hull_facets > 0 and .distinct_points == 3000 and
            .tetrahedra_per_second > 0 and .checks_failed == 0 and
            ([.per_node[].tetrahedra_built] | add) >= .tetrahedra and
            ([.per_node[].cpu_s] | add) > 0" "$scratch/stats.json" > /dev/null
done
for option in '--nodes 2' '--strategy spatial' '--link tcp' '--memory 4M' \
    '--board linux' '--index kd' '--partition uniform' '--face-rule own' \
    '--build points' '--patience 600'; do
    # shellcheck disable=SC2086
    refuses "direct/--threads with ${option% *}" 2 \
        "^incode: --threads: .* ${option% *} " "$INCODE" run "$direct" \
        --threads 2 $option -o "$scratch/left/o.npy"
done
refuses 'direct/no threads' 2 '^incode: --threads 0: ' "$INCODE" run "$direct" \
    --threads 0 -o "$scratch/left/o.npy"
incode run "$direct" -q --patience 600 --stats "$scratch/stats.json"
check 'direct/an option of a cube' "$(head -30 "$scratch/stats.json")" \
    jq -e '.strategy != "direct" and .link == "tcp"' \
    "$scratch/stats.json" > /dev/null
