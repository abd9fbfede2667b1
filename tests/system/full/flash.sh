#!/usr/bin/env bash
# An image on its way to emulated boards whose wires are all paced to 19,200
# baud: to sixteen it takes at most 1.6 times as long as to one.
. tests/system/wires/boards.bash
need_boards 'full flash' mps2-an385
errors=$scratch/errors

# An image that hangs, made longer: how it comes up does not count.
hangs=$BUILD/firmware/tests/image-mps2-an385-hang.img
if [ ! -r "$hangs" ]; then
    skip 'full flash' "there is no $hangs: make bare"
    exit 0
fi
tail -c +257 "$hangs" > "$scratch/raw"
truncate -s 60000 "$scratch/raw"
image=$scratch/raw.img
if ! "$INCODE" sign "$scratch/raw" --key "$BUILD/firmware/development.sign" \
    --board mps2-an385 --address 0x10000 -o "$image"; then
    fail 'full flash' 'the image is not signed'
    exit 1
fi

# takes NODES: milliseconds from the first order to the last verification.
takes() {
    local begun
    emulate mps2-an385 "$1" --empty
    join 19200
    begun=$(date +%s%N) # clock: a stated time
    "$INCODE" flash --cube "$cube" "$image" > /dev/null 2> "$errors" &
    flash=$!
    await_long verified "$1"
    took=$((($(date +%s%N) - begun) / 1000000))
    kill -TERM $flash
    wait $flash
    part
    end_boards "full flash/$1"
    rm -rf "$cube.d"
}
# await_long WHAT NODES: so many have come to it, within a quarter of an hour.
await_long() {
    local end=$((SECONDS + 900)) # clock: minutes
    until [ "$(grep -c ": $1\$" "$errors" 2> /dev/null)" = "$2" ]; do
        if [ $SECONDS -ge $end ] || ! kill -0 $flash; then
            fail "full flash/$2" "not all are $1: $(last "$errors")"
            return
        fi
        sleep 0.1
    done
    pass "full flash/$2: all are $1"
}
takes 1
one=$took
takes 16
echo "full flash: one board: $one ms, sixteen: $took ms"
check 'full flash/sixteen: at most 1.6 times as long as one' \
    "$took ms, and one $one ms" [ $((10 * took)) -le $((16 * one)) ]
