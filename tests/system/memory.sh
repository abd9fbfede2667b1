#!/usr/bin/env bash
# `incode run` in less memory than its points and tetrahedra take: the same bytes
# as in memory, and no more resident than the limit.  Then what ends such a run:
# a folder or a disk that takes nothing, sizes and options that do not go.
. tests/system/lib.sh

# limited NAME POINTS SIZE OPTION...: the peak is below SIZE (MiB), and each
# output NAME.* is that of the run in memory, whole.*.
limited() {
    local name=$1 points=$2 size=$3 stats=$scratch/stats.json peak
    shift 3
    succeeds "memory/$name" incode run "$points" -q --stats "$stats" \
        --host-memory "${size}M" --scratch "$scratch" "$@"
    peak=$(stat_of "$stats" host_peak_bytes)
    check "memory/$name: peak" "$peak bytes of $size MiB" \
        [ "$peak" -lt $((size << 20)) ]
    check "memory/$name: stated" "$(stat_of "$stats" host_memory_bytes)" \
        [ "$(stat_of "$stats" host_memory_bytes)" = $((size << 20)) ]
}

incode gen uniform 2000000 --seed 2 -o "$scratch/large.npy"
succeeds 'memory/in memory' incode run "$scratch/large.npy" -q \
    -o "$scratch/whole.npy"
limited '2,000,000 in 64M' "$scratch/large.npy" 64 -o "$scratch/part.npy"
check 'memory/2,000,000 in 64M: bytes' 'they differ' \
    cmp -s "$scratch/whole.npy" "$scratch/part.npy"
rm -f "$scratch"/*.npy

# A file that half of the memory may not hold.
incode gen uniform 400000 --seed 4 -o "$scratch/large.npy"
succeeds 'memory/it fits' incode run "$scratch/large.npy" -q \
    --stats "$scratch/fits.json" -o "$scratch/whole.npy"
check 'memory/it fits: nothing is put aside' "$(stat_of "$scratch/fits.json" scratch_bytes)" \
    [ "$(stat_of "$scratch/fits.json" scratch_bytes)" = 0 ]
succeeds 'memory/it may not fit' bash -c 'ulimit -d 120000; exec "$@"' - "$INCODE" \
    run "$scratch/large.npy" -q --stats "$scratch/stats.json" \
    --scratch "$scratch" -o "$scratch/part.npy"
check 'memory/it may not fit: the rest is put aside' "$(cat "$scratch/stats.json")" \
    jq -e '.scratch_bytes > 1e7 and .host_peak_bytes < .host_memory_bytes and
        .host_memory_bytes < 6e7' "$scratch/stats.json"
check 'memory/it may not fit: bytes' 'they differ' \
    cmp -s "$scratch/whole.npy" "$scratch/part.npy"

# A pipe, whose size is not known: what fits stays in memory.
piped() { # NAME OPTION...
    succeeds "memory/$1" incode run - --format npy -q -o "$scratch/part.npy" \
        --stats "$scratch/stats.json" --scratch "$scratch" "${@:2}" \
        < <(cat "$scratch/large.npy")
    check "memory/$1: bytes" 'they differ' \
        cmp -s "$scratch/whole.npy" "$scratch/part.npy"
}
piped 'a pipe that fits'
check 'memory/a pipe that fits: nothing is put aside' "$(cat "$scratch/stats.json")" \
    jq -e '.scratch_bytes == 0' "$scratch/stats.json"
(ulimit -d 120000; piped 'a pipe that may not fit')
check 'memory/a pipe that may not fit: the rest is put aside' \
    "$(cat "$scratch/stats.json")" jq -e '.scratch_bytes > 1e7 and
        .host_peak_bytes < .host_memory_bytes and .host_memory_bytes < 6e7' \
    "$scratch/stats.json"
rm -f "$scratch"/*.npy

# Every format, with a set that 16M do not hold.
incode gen bubbles 40000 --seed 3 -o "$scratch/small.npy"
formats='npy ele vtu vtk msh mesh'
for size in '' 16; do
    outputs=()
    for format in $formats; do
        outputs+=(-o "$scratch/${size:-whole}.$format")
    done
    if [ -z "$size" ]; then
        succeeds 'memory/formats in memory' incode run "$scratch/small.npy" -q \
            "${outputs[@]}"
    else
        limited 'formats' "$scratch/small.npy" $size "${outputs[@]}"
    fi
done
for format in $formats node neigh face; do
    check "memory/formats: .$format" 'its bytes differ' \
        cmp -s "$scratch/whole.$format" "$scratch/16.$format"
done

# A scratch that takes nothing, or not all.
exits 'memory/no such folder' 3 incode run "$scratch/small.npy" -q \
    --host-memory 16M --scratch "$scratch/absent"
check 'memory/no such folder: message' "$(last "$scratch/errors")" \
    grep -q 'absent: no scratch file .* --scratch DIR' "$scratch/errors"
exits 'memory/full' 3 bash -c 'ulimit -f 1024; exec "$@"' - "$INCODE" run \
    "$scratch/small.npy" -q --host-memory 16M --scratch "$scratch"
check 'memory/full: message' "$(last "$scratch/errors")" \
    grep -q 'no room for .* bytes .* --scratch DIR' "$scratch/errors"

# What does not go.
for options in '--host-memory 1M' '--host-memory some'; do
    # shellcheck disable=SC2086
    exits "memory/$options" 2 incode run "$scratch/small.npy" -q $options
done

# Real sets: their digests.
need_data 'memory/sets'
while read -r set file points _ tetrahedra digest; do
    [ "$tetrahedra" = 0 ] && continue
    if [ -n "$(no_set "$file" "$points")" ]; then
        skip "memory/$set" "$(no_set "$file" "$points")"
        continue
    fi
    limited "$set" "$INCODE_DATA/$file" 16
    check "memory/$set: digest" "$(stat_of "$scratch/stats.json" digest)" \
        [ "$(stat_of "$scratch/stats.json" digest)" = "sha256:$digest" ]
done < <(list_sets)
