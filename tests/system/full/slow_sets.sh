#!/usr/bin/env bash
# Sets of hard shapes through strategies, numbers of nodes, memories and builds:
# one digest each, and a table of times, with what they are of those of one node
# with 4M.  SLOW_SETS names some of the sets.
. tests/system/lib.sh

# A lattice of a plane, less and more tilted, of exact and of rounded
# coordinates, and a point beside it; and coordinates of very different
# exponents.
awk 'BEGIN { for (i = 0; i < 200; i++) for (j = 0; j < 200; j++)
    print i, j, -i - j; print 100, 100, -100 }' > "$scratch/plane.xyz"
awk 'BEGIN { for (i = 0; i < 200; i++) for (j = 0; j < 200; j++)
    print i, j, 3 * i + 5 * j; print 100, 100, 1000 }' > "$scratch/tilted.xyz"
awk 'BEGIN { for (i = 0; i < 200; i++) for (j = 0; j < 200; j++)
    printf "%.17g %.17g %.17g\n", i / 10, j / 10, 3 * i / 10 + j / 2
    print 1, 1, 50 }' > "$scratch/decimal.xyz"
awk 'function draw() { s = (s * 69069 + 1) % 4294967296; return s / 4294967296 }
    BEGIN { s = 1; for (i = 0; i < 9000; i++) { k = 2 ^ (int(80 * draw()) - 40)
    printf "%.17g %.17g %.17g\n", k * (2 * draw() - 1), k * (2 * draw() - 1),
        k * (2 * draw() - 1) } }' > "$scratch/mixed.xyz"

# run SET OPTION...: it comes to the digest of the first run, and takes $seconds.
run() {
    local set=$1 name="slow sets/$*" found
    shift
    succeeds "$name" incode run "$scratch/$set.xyz" -q \
        --stats "$scratch/stats.json" "$@" || return
    seconds=$(stat_of "$scratch/stats.json" time_triangulation_s)
    found=$(stat_of "$scratch/stats.json" digest)
    digest=${digest:-$found}
    check "$name, digest" "$found, not $digest" [ "$found" = "$digest" ]
}

for set in ${SLOW_SETS:-plane tilted decimal mixed}; do
    digest=
    run "$set" --strategy sequential --nodes 1 --memory 4M
    one=$seconds
    for strategy in sequential spatial exchange; do
        for nodes in 1 2 4 8; do
            for memory in 512K 4M 64M; do
                for build in auto faces points; do
                    [ $strategy$build = exchangepoints ] && continue
                    run "$set" --strategy $strategy --nodes $nodes \
                        --memory $memory --build $build &&
                        awk -v a="$seconds" -v b="$one" -v \
                            n="$set $strategy $nodes $memory $build" \
                            'BEGIN { printf "%s: %.2f s, %.1f times\n", n, a,
                                a / b }'
                done
            done
        done
    done
done
