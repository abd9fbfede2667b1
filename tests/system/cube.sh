#!/usr/bin/env bash
# What `incode cube` prints is for pasting: a shell makes of each line the
# node's program and the arguments that are meant, whatever the names in the
# cube file; the node knows them all; what is no cube file is refused at once.
. tests/system/lib.sh

# Programs that print their arguments, one a line, in the node's place.
mkdir "$scratch/bin"
printf '#!/bin/sh\nprintf "%%s\\n" "$@"\n' > "$scratch/bin/incode-node"
chmod +x "$scratch/bin/incode-node"
folder="$scratch/a lab's; \$(touch stolen) & co"
mkdir "$folder"
head -c 32 /dev/urandom | od -An -tx1 | tr -d ' \n' > "$folder/the key.key"
chmod 600 "$folder/the key.key"
device='/dev/tty; touch stolen #'
cat > "$folder/lab.cube" <<EOF
dimension = 1;
key = "the key.key";
links = (
    { node = 0; to = "host"; tcp = "[::1]:7400"; },
    { node = 0; to = 1; serial = ["$device", "/dev/\`touch stolen\`*?[a]"]; }
);
EOF
printf '%s\n' --node 0 --dimension 1 --dead 30000000 --serial-baud 115200 \
    --key "$folder/the key.key" --wire "0=serial:$device:115200" --wire \
    '1=listen:[::1]:7400' > "$scratch/expected.0"
printf '%s\n' --node 1 --dimension 1 --dead 30000000 --serial-baud 115200 \
    --key "$folder/the key.key" --wire \
    '0=serial:/dev/`touch stolen`*?[a]:115200' > "$scratch/expected.1"
incode cube "$folder/lab.cube" > "$scratch/lines" 2> "$scratch/errors"
check 'cube/the lines are printed' "$(last "$scratch/errors")" \
    test "$(wc -l < "$scratch/lines")" = 2
mkdir "$scratch/pasted"
for shell in sh bash; do
    for node in 0 1; do
        sed -n "$((node + 1))p" "$scratch/lines" > "$scratch/line"
        # shellcheck disable=SC2016
        (cd "$scratch/pasted" && PATH=$scratch/bin:$PATH $shell ../line) \
            > "$scratch/words" 2>&1
        check "cube/pasted into $shell, node $node" \
            "$(diff "$scratch/words" "$scratch/expected.$node" | head -n 2)" \
            cmp -s "$scratch/words" "$scratch/expected.$node"
    done
done
check 'cube/nothing in a name is run' "$(find "$scratch" -name 'stolen*')" \
    test -z "$(find "$scratch" -name 'stolen*')"

# Every option that is printed is told by the node's help.
"$BUILD/incode-node" --help > "$scratch/help"
for option in $(grep -oE -- ' --[a-z-]+' "$scratch/lines" | sort -u); do
    check "cube/$option is told" 'not by incode-node --help' \
        grep -qE -- "^  $option " "$scratch/help"
done

# What is no cube file does not hold it up, nor end it in the library.
mkfifo "$scratch/pipe.cube"
printf 'dimension = 0;\n  @include "/dev/zero"\n' > "$scratch/more.cube"
refuses 'cube/a pipe' 3 'pipe.cube: a pipe or device; ' \
    incode cube "$scratch/pipe.cube"
refuses 'cube/a pipe, to run on' 3 'pipe.cube: a pipe or device; ' \
    incode run "$scratch/absent.xyz" --cube "$scratch/pipe.cube"
refuses 'cube/a device' 3 '/dev/zero: a pipe or device; ' incode cube /dev/zero
refuses 'cube/a directory' 3 'a directory; ' incode cube "$scratch"
refuses 'cube/another file in it' 3 'more.cube:2: @: .*stands alone; ' \
    incode cube "$scratch/more.cube"
head -c 60000 /dev/zero | tr '\0' '(' > "$scratch/deep.cube"
refuses 'cube/deep brackets' 3 'deep.cube:1: too many brackets' \
    incode cube "$scratch/deep.cube"
refuses 'cube/a board beside it' 2 '--board: the cube file of --cube says it; ' \
    incode run "$scratch/absent.xyz" --cube "$folder/lab.cube" --board linux
