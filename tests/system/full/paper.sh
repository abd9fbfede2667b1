#!/usr/bin/env bash
# incode bench paper with all points: the goals of exchange and hybrid on the
# modelled nCUBE 2, 1,000,000 points on 1,024 nodes of 4 MiB among them.
SECONDS_MAX=3600
. tests/system/lib.sh
said=$scratch/said

goals() {
    within "$INCODE" bench paper --table goals --million > "$said"
}
succeeds full/paper/runs goals
while IFS= read -r line; do
    name=$(printf '%s' "${line%%:*}" | tr ' ,' '__')
    check "full/paper/$name" "$line" grep -q ': reached' <<< "$line"
done < <(grep -E '^(exchange|hybrid) on ' "$said")
check full/paper/million 'no goal for 1,024 nodes' \
    grep -q 'Uniform 1000000, 1024 nodes' "$said"
