#!/usr/bin/env bash
# incode bench paper with all points: the goals of exchange and hybrid on the
# modelled nCUBE 2, 1,000,000 points on 1,024 nodes of 4 MiB among them.
SECONDS_MAX=1800
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
check full/paper/million 'not the efficiency that 1,024 nodes are to have' \
    grep -q 'Uniform 1000000, 1024 nodes: efficiency .*: reached' "$said"
