#!/usr/bin/env bash
# How far away the next look at its links is on a bare board of 25 MHz, at most:
# 5 ms on a Cortex-M7, 50 ms on a Cortex-M3, whatever it works on.
#
#     tests/system/boards_looks.sh [all]
#
# The emulator gives each instruction 32 ns, where 25 MHz give it 40 at best:
# the limits are four fifths of these.
. tests/system/lib.sh

need_boards looks mps2-an500
need_boards looks mps2-an385
stats=$scratch/stats.json
mkdir "$scratch/bin"
printf '#!/bin/sh\nexec %s "$@" -icount shift=5,sleep=on\n' \
    "$(command -v qemu-system-arm)" > "$scratch/bin/qemu-system-arm"
chmod +x "$scratch/bin/qemu-system-arm"

in_time() { # FILE MOST
    jq -e --argjson most "$2" 'min > 0 and max <= $most' "$1" > "$scratch/told"
}

# looks NAME BOARD FILE OPTION...: of a run of these points on that board.
looks() {
    local name="looks/$2 $1" board=$2 file=$3 most=4000
    shift 3
    [ "$board" != mps2-an385 ] || most=40000
    rm -f "$stats"
    # shellcheck disable=SC2086
    PATH=$scratch/bin:$PATH incode run "$file" --no-progress -q --board "$board" \
        $patient --stats "$stats" "$@" 2> "$scratch/errors"
    jq -c '[.per_node[].look_us_max]' "$stats" > "$scratch/looks" 2>&1
    check "$name: at most $most us" \
        "$(cat "$scratch/looks"); $(last "$scratch/errors")" \
        in_time "$scratch/looks" $most
}

gen() { incode gen "$1" "$2" --seed 1 -o "$scratch/$1.npy" 2> /dev/null; }
gen uniform 300 && gen hub 1000 && gen grid 343
looks uniform mps2-an385 "$scratch/uniform.npy" --nodes 1
looks hub mps2-an500 "$scratch/hub.npy" --nodes 1
looks grid mps2-an500 "$scratch/grid.npy" --nodes 1
looks 'naive search' mps2-an500 "$scratch/uniform.npy" --nodes 2 \
    --strategy spatial --index naive
[ "${1:-}" = all ] || exit 0

gen uniform 1000 && gen hub 2000 && gen grid 1000
for board in mps2-an500 mps2-an385; do
    for kind in uniform hub grid; do
        looks "$kind, by points" $board "$scratch/$kind.npy" --nodes 1
        looks "$kind, by faces" $board "$scratch/$kind.npy" --nodes 2 \
            --strategy spatial
        for index in naive grid; do
            looks "$kind, $index search" $board "$scratch/$kind.npy" --nodes 2 \
                --strategy spatial --index $index
        done
    done
    for set in ../shared/data/{cactus,deg_cgal_lp500,deg_cgal_nested}*; do
        [ ! -r "$set" ] || looks "$(basename "$set")" $board "$set" --nodes 1
    done
    [ -d ../shared/data ] || skip "looks/$board, other sets" 'no ../shared/data'
done
