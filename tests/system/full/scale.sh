#!/usr/bin/env bash
# 30,000,000 and 100,000,000 uniform points within 1G of the host's memory: the
# digest of a run in memory or, where none is known, the exact check; less resident
# than the limit, at most three times the output put aside, and time a point bounded
# by that of 10,000,000 in memory and by the disk.  --stats counts the hull and
# checks that the tetrahedra tile it.  The larger set runs in a memory cgroup of
# 2 GB where one can be made.
. tests/system/lib.sh

digest=488e7d5f1d7f563ed5327105eb553c9e967f86d272dc54d917a04ba50f5f9255
group=''
for folder in /sys/fs/cgroup /sys/fs/cgroup/memory; do
    for limit in memory.max memory.limit_in_bytes; do
        made=$folder/incode-scale.$$
        if mkdir "$made" 2> /dev/null; then
            if [ -e "$made/$limit" ] && echo 2G > "$made/$limit"; then
                group=$made
                break 2
            fi
            rmdir "$made"
        fi
    done
done 2> /dev/null
[ -z "$group" ] || trap 'rmdir "$group"; rm -rf "$scratch"' EXIT
confined() (
    if [ -n "$group" ]; then echo "$BASHPID" > "$group/cgroup.procs"; fi
    exec "$@"
)

# has_room NAME POINTS MEMORY: bytes a point on the disk: the points, the output,
# three times as much put aside.  MEMORY: bytes of it that are to be available.
has_room() {
    local free memory need=$(($2 * (24 + 4 * 109)))
    free=$(df --output=avail -B1 "$scratch" | tail -n 1)
    memory=$(($(awk '/^MemAvailable:/ { print $2 }' /proc/meminfo) * 1024))
    if [ "$free" -lt $need ]; then
        skip "$1" "$free bytes are free on the disk of $scratch, not $need"
    elif [ "$memory" -lt "$3" ]; then
        skip "$1" "$memory bytes of memory are available, not $3"
    else
        return 0
    fi
    return 1
}
run() { # NAME N [OPTION...]: the statistics go to $scratch/N.json
    succeeds "scale/$1" confined "$INCODE" run "$scratch/points.npy" -q \
        --stats "$scratch/$2.json" -o "$scratch/out.npy" "${@:3}"
}
stat() { stat_of "$scratch/$1.json" "$2"; }
# Seconds without those of the check, which only statistics need.
seconds() { jq -n "$(stat "$1" time_total_s) - $(stat "$1" time_verify_s)"; }
# made N: uniform points of the seed that the digests are of.
made() {
    succeeds "scale/$1 points" "$INCODE" gen uniform "$1" --seed 2 \
        --host-memory 1G --scratch "$scratch" -o "$scratch/points.npy"
}

# bytes a second that the disk takes, of 1 GB
rate() {
    local before=$EPOCHREALTIME after
    head -c 1000000000 /dev/zero > "$scratch/rate"
    sync "$scratch/rate"
    after=$EPOCHREALTIME
    rm -f "$scratch/rate"
    jq -n "1e9 / ($after - $before)"
}

# within_limits N
within_limits() {
    local n=$1 output peak aside most
    output=$(wc -c < "$scratch/out.npy")
    peak=$(stat "$n" host_peak_bytes)
    aside=$(stat "$n" scratch_bytes)
    check "scale/$n: resident" "$peak bytes" [ "$peak" -lt $((1 << 30)) ]
    check "scale/$n: put aside" "$aside bytes, of output $output" \
        [ "$aside" -le $((3 * output)) ]
    most=$(jq -n "1.3 * $(seconds 10000000) / 10000000 * $n +
        (2 * $aside + $output + 24 * $n) / $(rate)")
    check "scale/$n: time" "$(seconds "$n") s, $most at most" \
        jq -en "$(seconds "$n") <= $most"
    echo "$n points: $(seconds "$n") s, $most at most; processor" \
        "$(stat "$n" host_cpu_s) s, $peak bytes resident, $aside put aside"
}

if has_room 'scale/all' 30000000 4000000000; then
    made 10000000
    group_of_all=$group group=''
    run '10,000,000 in memory' 10000000
    made 30000000
    run '30,000,000 in 1G' 30000000 --host-memory 1G --scratch "$scratch"
    within_limits 30000000
    check 'scale/30000000: digest' "$(stat 30000000 digest)" \
        [ "$(stat 30000000 digest)" = "sha256:$digest" ]
    check 'scale/30000000: counts' "$(cat "$scratch/30000000.json")" \
        [ "$(stat 30000000 tetrahedra) $(stat 30000000 hull_facets)" = \
        '202843208 850' ]
    group=$group_of_all
    rm -f "$scratch"/*.npy
    if has_room 'scale/100,000,000' 100000000 2000000000; then
        made 100000000
        run '100,000,000 in 1G' 100000000 --host-memory 1G --scratch "$scratch" \
            --verify
        within_limits 100000000
        check 'scale/100000000: verified' "$(cat "$scratch/100000000.json")" \
            [ "$(stat 100000000 verified)" = true ]
        echo "in a memory cgroup of 2 GB: ${group:-none can be made}"
    fi
fi
