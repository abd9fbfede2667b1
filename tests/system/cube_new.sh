#!/usr/bin/env bash
# incode cube --new: what it writes is valid as it stands, for each kind of wire,
# and nothing that is there is written over.
. tests/system/lib.sh
umask 077

# new NAME [OPTION...]: written, and accepted.
new() {
    local name=$1
    shift
    succeeds "cube_new/$name" incode cube --new "$@" \
        -o "$scratch/$name.cube" > "$scratch/said"
    succeeds "cube_new/$name: accepted" incode cube "$scratch/$name.cube" \
        > "$scratch/lines"
}
new local 4
"$INCODE" gen uniform 200 -o "$scratch/points.npy"
succeeds 'cube_new/local: runs' incode run -q "$scratch/points.npy" \
    --cube "$scratch/local.cube" --verify
new one 1
new large 1024
hosts=10.0.0.1,pi@10.0.0.2,10.0.0.3,10.0.0.4
new tcp 4 --tcp "$hosts"
check 'cube_new/tcp: who logs in' "$(cat "$scratch/tcp.cube")" \
    grep -q 'node = 1; ssh = "pi@10.0.0.2"' "$scratch/tcp.cube"
check 'cube_new/tcp: its key' "$(ls -l "$scratch")" \
    [ "$(stat -c %a "$scratch/tcp.key")" = 600 ]
check 'cube_new/tcp: each address once' "$(cat "$scratch/tcp.cube")" \
    [ "$(grep -o 'tcp = "[^"]*"' "$scratch/tcp.cube" | sort | uniq -c |
        awk '{ print $1 }' | sort -u)" = 1 ]
new serial 8 --serial=/dev/ttyUSB7
new blank 8 --serial /dev/ttyUSB7
check 'cube_new/serial: the port' "$(cat "$scratch/blank.cube")" eval \
    "cmp '$scratch/serial.cube' '$scratch/blank.cube' &&
     grep -q /dev/ttyUSB7 '$scratch/serial.cube'"
new bare 16 --board mps2-an385 --serial
succeeds 'cube_new/serial alone, at the end' incode cube --new 8 \
    -o "$scratch/end.cube" --serial > "$scratch/said"

before=$(cat "$scratch/tcp.cube" "$scratch/tcp.key")
incode cube --new 4 --tcp "$hosts" -o "$scratch/tcp.cube" 2> "$scratch/errors"
status=$?
check 'cube_new/nothing is written over' "$(last "$scratch/errors")" eval \
    "[ $status = 3 ] && grep -q 'is there already, and stays; give another -o' \
    '$scratch/errors'"
check 'cube_new/it stays' 'it changed, or is empty' \
    [ -n "$before" -a "$before" = "$(cat "$scratch/tcp.cube" "$scratch/tcp.key")" ]

# refused WHAT OPTION...
refused() {
    local what=$1 status
    shift
    incode cube "$@" > "$scratch/said" 2> "$scratch/errors"
    status=$?
    check "cube_new/refused: $what" "exit $status: $(last "$scratch/errors")" \
        eval "[ $status = 2 ] && grep -q '; ' '$scratch/errors' &&
              [ ! -e '$scratch/no.cube' ]"
}
refused 'three nodes' --new 3 -o "$scratch/no.cube"
refused 'no file' --new 4
refused 'an option without its value' --new 2 --serial --tcp
refused 'two orders' --new 4 -o "$scratch/no.cube" "$scratch/tcp.cube"
refused 'too few hosts' --new 4 --tcp a,b,c -o "$scratch/no.cube"
refused 'too many hosts' --new 2 --tcp a,b,c -o "$scratch/no.cube"
refused 'a host with a quote' --new 2 --tcp 'a,b"' -o "$scratch/no.cube"
refused 'a host that is an option' --new 2 --tcp a,-oX=b -o "$scratch/no.cube"
refused 'a port with a quote' --new 2 --serial='/dev/tty"' -o "$scratch/no.cube"
refused 'two wires' --new 2 --tcp a,b --serial -o "$scratch/no.cube"
refused 'too many boards' --new 4 --board raspi3b -o "$scratch/no.cube"
refused 'no board' --new 4 --board none -o "$scratch/no.cube"
refused 'nothing'
