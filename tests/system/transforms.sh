#!/usr/bin/env bash
# The same points otherwise: scaled by powers of two, shuffled, mirrored.
#
# Scaling by a power of two changes no sign of orient3d or in_sphere and no
# lexicographic order, so the digest stays.  Shuffling renames the rows, no
# more.  Mirroring reverses the lexicographic order that breaks ties, so where
# five points are cospherical another of the possible triangulations is the
# right one: a mirrored set is verified by itself, and only a set without ties
# must give the mirror image, row for row.
. tests/system/lib.sh
need_data transforms

# runs POINTS OUT [OPTION...]: quietly, statistics in $scratch/stats.json.
runs() {
    local points=$1 out=$2
    shift 2
    rm -f "$out" "$scratch/stats.json"
    incode run "$points" -q --nodes 8 --strategy spatial \
        --stats "$scratch/stats.json" -o "$out" "$@" 2> "$scratch/errors"
}

# Exact only where scaling back gives the same points.
scaled_by() { # NAME FILE.xyz DIGEST EXPONENT
    local name=$1 from=$2 digest=$3 exponent=$4 found
    "$TOOL" scale "$exponent" < "$from" > "$scratch/scaled.xyz"
    "$TOOL" scale "$((-exponent))" < "$scratch/scaled.xyz" \
        > "$scratch/back.xyz"
    "$TOOL" scale 0 < "$from" > "$scratch/plain.xyz"
    if ! cmp -s "$scratch/back.xyz" "$scratch/plain.xyz"; then
        skip "$name" 'a coordinate of the set leaves the range of doubles'
        return
    fi
    if ! runs "$scratch/scaled.xyz" "$scratch/scaled.npy"; then
        fail "$name" "$(last "$scratch/errors")"
        return
    fi
    found=$(stat_of "$scratch/stats.json" digest)
    check "$name" "digest $found" test "$found" = "sha256:$digest"
}

shuffled() { # NAME FILE.xyz DIGEST SEED
    local name=$1 from=$2 digest=$3 seed=$4 found
    "$TOOL" shuffle "$seed" < "$from" > "$scratch/shuffled.xyz"
    if ! runs "$scratch/shuffled.xyz" "$scratch/shuffled.ele"; then
        fail "$name" "$(last "$scratch/errors")"
        return
    fi
    "$TOOL" unshuffle "$seed" "$from" < "$scratch/shuffled.ele" \
        > "$scratch/unshuffled.ele"
    found=$("$INCODE" digest "$scratch/unshuffled.ele")
    check "$name" "digest $found" test "$found" = "sha256:$digest"
}

mirrored() { # NAME FILE.xyz
    "$TOOL" mirror < "$2" > "$scratch/mirrored.xyz"
    succeeds "$1" runs "$scratch/mirrored.xyz" "$scratch/mirrored.npy" --verify
}

while read -r set file points _ tetrahedra digest; do
    [ "$tetrahedra" = 0 ] && continue
    [ "$points" -ge 20000 ] && continue
    if [ -n "$(no_set "$file" "$points")" ]; then
        skip "transforms/$set" "$(no_set "$file" "$points")"
        continue
    fi
    plain=$scratch/$set.xyz
    gzip -cdf "$INCODE_DATA/$file" > "$plain"
    for exponent in 500 -500; do
        scaled_by "transforms/$set times 2^$exponent" "$plain" "$digest" \
            $exponent
    done
    shuffled "transforms/$set shuffled" "$plain" "$digest" "$points"
    mirrored "transforms/$set mirrored" "$plain"
done < <(list_sets)

# Integers, so that even the smallest denormal and its multiples are exact.
for set in deg_cgal_grid5 deg_cgal_lp500 deg_octahedron; do
    read -r _ file points _ _ digest < <(list_sets | grep "^$set ")
    if [ -n "$(no_set "$file" "$points")" ]; then
        skip "transforms/$set at the ends" "$(no_set "$file" "$points")"
        continue
    fi
    for exponent in 1000 -1074; do
        scaled_by "transforms/$set times 2^$exponent" "$INCODE_DATA/$file" \
            "$digest" $exponent
    done
done

# The mix: one set times 2^1000 and the same times 2^-1074, in one input.
for set in deg_cgal_grid5 deg_cgal_lp500; do
    file=$INCODE_DATA/$set.xyz
    if [ -n "$(no_set "$set.xyz" 0)" ]; then
        skip "transforms/$set mixed" "$(no_set "$set.xyz" 0)"
        continue
    fi
    { "$TOOL" scale 1000 < "$file"; "$TOOL" scale -1074 < "$file"; } \
        > "$scratch/mix.xyz"
    succeeds "transforms/$set times 2^1000 and 2^-1074 mixed" \
        runs "$scratch/mix.xyz" "$scratch/mix.npy" --verify
    incode run "$scratch/mix.xyz" -q --strategy sequential --nodes 1 \
        -o "$scratch/mix1.npy" 2> "$scratch/errors"
    check "transforms/$set mixed, on one node" "$(last "$scratch/errors")" \
        cmp -s "$scratch/mix.npy" "$scratch/mix1.npy"
done

# No ties among random points: the mirror image, row for row.
"$INCODE" gen uniform 3000 --seed 11 -o "$scratch/random.xyz" 2> /dev/null
runs "$scratch/random.xyz" "$scratch/random.npy"
digest=$(stat_of "$scratch/stats.json" digest)
"$TOOL" mirror < "$scratch/random.xyz" > "$scratch/mirrored.xyz"
runs "$scratch/mirrored.xyz" "$scratch/mirrored.npy" --verify
check 'transforms/random points mirrored' "$(last "$scratch/errors")" \
    test "$(stat_of "$scratch/stats.json" digest)" = "$digest"
