#!/usr/bin/env bash
# Keys, images, and their way to boards: what is no image or is signed by
# somebody else changes nothing on any; emulated boards with nothing but their
# loader take one, all at once.
. tests/system/lib.sh

errors=$scratch/errors
said=$scratch/said
key=$scratch/lab.sign

# --- keys and images ------------------------------------------------------------

succeeds 'flash/key' incode key --sign "$key"
succeeds 'flash/key of a cube' incode key "$scratch/cube.key"
check 'flash/key: for its owner alone' "$(stat -c %a "$key")" \
    [ "$(stat -c %a "$key")" = 600 ]
check 'flash/key: its public half' "$(cat "$key.pub")" \
    grep -qxE '[0-9a-f]{64}' "$key.pub"
refuses 'flash/key: is not replaced' 3 'is there already' \
    incode key --sign "$key"

head -c 40000 /dev/urandom > "$scratch/raw"
raw=$scratch/raw.img
succeeds 'flash/sign' incode sign "$scratch/raw" --key "$key" \
    --board mps2-an500 --number 7 --version 1.2.3 -o "$raw"
succeeds 'flash/image' incode image "$raw" --key "$key.pub" > "$said"
for row in 'board      mps2-an500' 'version    1.2.3' 'number     7' \
    "signed by  $(cat "$key.pub")"; do
    check "flash/image: $row" "$(tr '\n' ' ' < "$said")" \
        grep -qxF "$row" "$said"
done
refuses 'flash/sign: a key of a cube' 3 "a cube's key" \
    incode sign "$raw" --key "$scratch/cube.key"
refuses 'flash/sign: a public half' 3 'a public half' \
    incode sign "$raw" --key "$key.pub"
refuses 'flash/image: another key' 5 'signed with another key; sign it' \
    incode image "$raw" --key "$scratch/cube.key"
refuses 'flash/sign: a full disk' 3 '^incode: /dev/full: ' \
    incode sign "$raw" --key "$key" -o /dev/full
refuses 'flash/sign: an ELF file' 3 'an ELF file; .* objcopy -O binary' \
    incode sign "$INCODE" --key "$key" --board mps2-an500 -o "$scratch/none.img"
{ head -c 200 "$raw" && tail -c +202 "$raw"; } > "$scratch/shifted.img"
refuses 'flash/sign: a damaged header' 3 'a damaged header; ' \
    incode sign "$scratch/shifted.img" --key "$key" --board mps2-an500 \
    -o "$scratch/none.img"
chmod 640 "$key"
refuses 'flash/sign: others can read the key' 3 'read by others.*; chmod 600' \
    incode sign "$raw" --key "$key"
chmod 600 "$key"

# A cube where nobody is: what is wrong with an image is told before.
cat > "$scratch/nobody.cube" << END
dimension = 1;
board = "mps2-an500";
links = ( { node = 0; to = "host"; unix = "nobody.socket"; } );
END
# refuses_image NAME PATTERN FILE: by incode flash, and by incode image unless
# it is whole.
refuses_image() {
    refuses "flash/$1" 3 "$2" incode flash --cube "$scratch/nobody.cube" "$3"
}
head -c 30000 "$raw" > "$scratch/short.img"
refuses_image 'a truncated image' '30000 bytes, fewer than the 40256' \
    "$scratch/short.img"
cp "$raw" "$scratch/false.img"
# Another than it is, whatever it is.
byte=$(od -An -tu1 -j 20000 -N 1 "$raw")
printf '%b' "\\x$(printf %02x $((byte ^ 255)))" |
    dd of="$scratch/false.img" bs=1 seek=20000 conv=notrunc 2> /dev/null
refuses_image 'a false byte' 'its code is not what was signed; ' \
    "$scratch/false.img"
refuses 'flash/image: a false byte' 5 'its code is not what was signed; ' \
    incode image "$scratch/false.img"
refuses_image 'no image' 'no image, or one with a damaged header; ' \
    "$scratch/raw"
refuses_image 'an empty file' ': .*; ' /dev/null
refuses_image 'no file' 'No such file' "$scratch/no.img"
refuses_image 'a file without an end' 'the most that an image has; ' /dev/zero
refuses_image 'a directory' ': .*; ' "$scratch"
incode sign "$raw" --key "$key" --board mps2-an385 -o "$scratch/other.img"
refuses_image 'an image for another board' 'is for mps2-an385, and .*; ' \
    "$scratch/other.img"
refuses 'flash/no place' 2 'give --cube FILE' incode flash "$raw"
refuses 'flash/nodes that there are not' 2 '^incode: 0-3: not nodes of this cube; ' \
    incode flash --cube "$scratch/nobody.cube" --nodes 0-3 "$raw"
incode cube --new 2 --serial /dev/none -o "$scratch/none.cube" > /dev/null
for nodes in 3-1 0-99999999 '' ',' 0-1,,1 0x1 0- - 99999999999999999999 '0,'; do
    refuses "flash/nodes that are none: '$nodes'" 2 'not nodes of this cube; ' \
        incode flash --cube "$scratch/none.cube" --nodes "$nodes" "$raw"
done
# clock: nobody is waited for for a second.
refuses 'flash/nobody there' 4 '^incode: nodes? 0.*; ' \
    incode flash --cube "$scratch/nobody.cube" -q --patience 1 --nodes 0 "$raw"

# --- boards ---------------------------------------------------------------------

image=$BUILD/firmware/mps2-an500.img
hangs=$BUILD/firmware/tests/image-mps2-an500-hang.img
need_boards flash mps2-an500
cube=$scratch/lab.cube
# Not by within, a function, whose process is not what is to be ended.
# clock: lib.sh has the time.
timeout -k 5 "$hang" "$INCODE" emulate --board mps2-an500 --nodes 2 --empty -o "$cube" \
    > "$scratch/boards" 2>&1 &
boards=$!
trap 'kill $boards 2> /dev/null; wait $boards; rm -rf "$scratch"' EXIT
if ! await grep -q '^2 nodes' "$scratch/boards"; then
    fail 'flash/boards' "they do not start: $(last "$scratch/boards")"
    exit 1
fi

# flashes NAME PATTERN OPTION... IMAGE: ends with 0, and says that.
flashes() {
    local name=$1 pattern=$2 status
    shift 2
    incode flash --cube "$cube" "$@" > "$said" 2> "$errors"
    status=$?
    if [ $status != 0 ]; then
        fail "$name" "exit $status: $(last "$errors")"
    else
        check "$name" "$(last "$said")" grep -qE "$pattern" "$said"
    fi
}
flashes 'flash/a dry run' '^nodes 0-1: would be given mps2-an500' --dry-run \
    "$image"
refuses 'flash/a wrong key' 3 \
    '^incode: nodes 0-1: refuses the image: it is signed with another key; ' \
    incode flash --cube "$cube" -q "$raw"
refuses 'flash/an image that hangs' 4 \
    '^incode: node 1: did not come up with the image, and waits.*: .*; ' \
    incode flash --cube "$cube" -q --nodes 1 "$hangs"

# Ended in mid-transfer, and begun again.  Meanwhile nobody else gets in.
"$INCODE" flash --cube "$cube" "$image" > /dev/null 2> "$scratch/first" &
flash=$!
await grep -q 'node 1: takes blocks' "$scratch/first"
kill -STOP $flash
refuses 'flash/two at once' 4 'in use by incode flash .*; ' \
    incode flash --cube "$cube" -q "$image"
kill -TERM $flash
kill -CONT $flash
wait $flash
status=$?
check 'flash/interrupted' "exit $status" [ $status != 0 ]
if has_terminals 'flash/a terminal'; then
    script -qec "stty cols 80 rows 24; exec '$INCODE' flash --cube '$cube' \
'$image'" "$said" > /dev/null 2>&1 < /dev/null
    status=$?
    check 'flash/a terminal: exit 0' "exit $status: $(last "$said")" \
        [ $status = 0 ]
    check 'flash/a terminal: a row a node' "$(head -c 300 "$said")" \
        grep -qE 'node 1 \[#+ +\] +[0-9]+ % takes blocks' "$said"
    check 'flash/a terminal: all of them' "$(last "$said")" \
        grep -q 'nodes 0-1: run mps2-an500' "$said"
else
    flashes 'flash/all of them' '^nodes 0-1: run mps2-an500' "$image"
fi
flashes 'flash/nothing to do' '^nodes 0-1: had mps2-an500 .* already' "$image"

# A wrong one changes nothing, and they compute all the same.
refuses 'flash/a wrong key for boards that run' 3 'signed with another key; ' \
    incode flash --cube "$cube" -q "$raw"
flashes 'flash/the old image stays' '^nodes 0-1: had mps2-an500 .* already' \
    --dry-run "$image"
"$INCODE" gen uniform 200 --seed 1 -o "$scratch/points.npy" 2> /dev/null
# shellcheck disable=SC2086
succeeds 'flash/they triangulate' incode run "$scratch/points.npy" -q \
    --cube "$cube" --verify $patient

# --- a Raspberry Pi, whose flash is a part of its card --------------------------

image=$BUILD/firmware/raspi3b.img
if [ ! -r "$image" ] || ! command -v qemu-system-aarch64 > /dev/null; then
    skip flash/raspi3b 'its image or qemu-system-aarch64 is not there'
    exit 0
fi
kill $boards
wait $boards
cube=$scratch/pi.cube
pis() {
    : > "$scratch/pis"
    timeout -k 5 "$hang" "$INCODE" emulate --board raspi3b --nodes 2 --empty \
        -o "$cube" > "$scratch/pis" 2>&1 &
    boards=$!
    if ! await grep -q '^2 nodes' "$scratch/pis"; then
        fail 'flash/raspi3b' "they do not start: $(last "$scratch/pis")"
        exit 1
    fi
}
pis
refuses 'flash/raspi3b: a wrong image' 3 \
    'is for mps2-an500, and .*; ' \
    incode flash --cube "$cube" -q "$raw"
flashes 'flash/raspi3b: two at once' '^nodes 0-1: run raspi3b' "$image"
flashes 'flash/raspi3b: nothing to do' '^nodes 0-1: had raspi3b' "$image"
refuses 'flash/raspi3b: an image that hangs' 4 \
    '^incode: node 1: did not come up with the image, and went back.*; ' \
    incode flash --cube "$cube" -q --nodes 1 \
    "$BUILD/firmware/tests/image-raspi3b-hang.img"
# shellcheck disable=SC2086
succeeds 'flash/raspi3b: they triangulate' incode run "$scratch/points.npy" -q \
    --cube "$cube" --verify $patient
# Off and on: what a card has stays.
kill $boards
wait $boards
pis
flashes 'flash/raspi3b: the card keeps it' '^nodes 0-1: had raspi3b' \
    --dry-run "$image"
