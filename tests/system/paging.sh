#!/usr/bin/env bash
# A run that spends its time on pages says so, and what would help; others do
# not.
. tests/system/lib.sh

# matches FILE PATTERN: all that it holds.
matches() { [[ $(cat "$1") =~ ^$2$ ]]; }

# says NAME PATTERN POINTS OPTION...: what a run says on standard error.
says() {
    local name=$1 pattern=$2
    shift 2
    incode run "$@" --nodes 2 --build faces -o "$scratch/o.npy" \
        > "$scratch/output" 2> "$scratch/errors"
    check "paging/$name" "it says: $(cat "$scratch/errors")" \
        matches "$scratch/errors" "$pattern"
}
incode gen sphere 10000 -o "$scratch/sphere.npy"
incode gen uniform 20000 -o "$scratch/uniform.npy"
asks='a node holds 5[0-9] % of these points at a time, and much of the time'
says told "incode: --memory 512K: $asks .*; --memory 1M would hold all of them" \
    "$scratch/sphere.npy" --memory 512K --strategy exchange
says advice '' "$scratch/sphere.npy" --memory 1M --strategy exchange
says quiet '' "$scratch/sphere.npy" --memory 512K --strategy exchange -q
says uniform '' "$scratch/uniform.npy" --memory 640K
