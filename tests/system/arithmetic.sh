#!/usr/bin/env bash
# The arithmetic is the same everywhere: on each bare board, emulated, the cases
# of tests/arithmetic in blocks of 1,000, each digest compared with this
# processor's: all 10,000 of the exact predicates, and of the million of the
# filters and 90,000 single operations one block in ARITHMETIC_STEP.  And a
# processor whose arithmetic is another is found, down to the operation.
. tests/system/lib.sh
. tests/boards/lib.sh
step=${ARITHMETIC_STEP:-10}

# found NAME PROGRAM OPERATION: what it differs in first.
found() {
    local said
    said=$(within tests/arithmetic/compare '0 1099 10' "$2" | head -n 1)
    check "arithmetic/$1 is found" "compared, it says: $said" \
        grep -qE "^block .*, case .*: '$3' is [0-9a-f]+ here, and" <<< "$said"
}
if [ "$(uname -m)" != x86_64 ] || ! grep -qw fma /proc/cpuinfo; then
    skip 'arithmetic/a fused product is found' 'this processor has none'
else
    found 'a fused product' "$BUILD/tests/arithmetic-fused" \
        '[a-d][xyz] [a-d][xyz] - [a-d][xyz] [a-d][xyz]'
fi
if [ "$(uname -m)" != x86_64 ]; then
    skip 'arithmetic/excess precision is found' 'this processor has none'
else
    found 'excess precision' "$BUILD/tests/arithmetic-extended" '.*'
fi

for image in "$BUILD"/firmware/tests/*-arithmetic.img; do
    board=$(basename "$image" -arithmetic.img)
    flash=$scratch/$board.flash
    make_flash "$board"
    command_of "$board" "$image"
    within tests/arithmetic/compare "0 1089 $step,1090 1099 1" \
        "${command[@]}" > "$scratch/said" 2> "$scratch/errors"
    status=$?
    check "arithmetic/$board" "$(head -n 1 "$scratch/said")" [ $status = 0 ]
    cat "$scratch/said"
done
