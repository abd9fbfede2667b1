#!/usr/bin/env bash
# One build for every x86-64: which level of it runs, and that all of them give
# the same bytes, forced here and on processors that QEMU has.  The suite
# processors of tests/run has the real sets.
. tests/system/lib.sh
took=$SECONDS

if ! grep -q -- '-march=x86-64 ' "$BUILD/flags"; then
    skip processors 'the programs are made for one processor'
    exit 0
fi
"$INCODE" gen uniform 3000 --seed 7 -o "$scratch/points.npy"
"$INCODE" run -q "$scratch/points.npy" --stats "$scratch/stats.json" \
    -o "$scratch/usual.npy"

# The registers in what is made for each level: of 16 bytes, of 32, of 64.
registers() { # PROGRAM
    objdump -d --no-show-raw-insn "$1" | awk '
        /^[0-9a-f]+ </ { level = ""
            if (match($2, /x86_64_(v[0-9]_)?incode/))
                level = substr($2, RSTART + 7, 2) }
        level != "" && match($0, /%[xyz]mm/) {
            print level, substr($0, RSTART + 1, 3) }' | sort -u | xargs
}
for program in incode incode-node libincode.so.0; do
    said=$(registers "$BUILD/$program")
    check "processors/code of $program" "$said" [ "$said" = \
        'in xmm v2 xmm v3 xmm v3 ymm v4 xmm v4 ymm v4 zmm' ]
done

# What the C library says of this processor.
expected=$(/lib64/ld-linux-x86-64.so.2 --help |
    sed -n 's/^ *\(x86-64-v[234]\) (supported.*/\1/p' | head -n 1)
expected=${expected:-x86-64}
check 'processors/the highest that is here' "$(stat_of "$scratch/stats.json" \
    processor), not $expected" \
    [ "$(stat_of "$scratch/stats.json" processor)" = "$expected" ]

# same NAME LEVEL PROGRAM...: incode, by that program, runs the code of this
# level, and its output is the usual one.
same() {
    rm -f "$scratch/stats.json" "$scratch/out.npy"
    succeeds "processors/$1" "${@:3}" run -q "$scratch/points.npy" \
        --stats "$scratch/stats.json" -o "$scratch/out.npy"
    check "processors/$1: level" "$(stat_of "$scratch/stats.json" processor)" \
        [ "$(stat_of "$scratch/stats.json" processor)" = "$2" ]
    check "processors/$1: bytes" 'the output differs' \
        cmp -s "$scratch/usual.npy" "$scratch/out.npy"
}
for level in x86-64 x86-64-v2 x86-64-v3 x86-64-v4; do
    same "forced, $level" $level env INCODE_PROCESSOR=$level "$INCODE"
    [ $level != "$expected" ] || break
done
same 'forced, no value' "$expected" env INCODE_PROCESSOR= "$INCODE"

# refused NAME WHERE WHAT COMMAND...: with 2, and what may be done.
refused() {
    exits "processors/$1: status" 2 "${@:4}"
    check "processors/$1" "$(last "$scratch/errors")" \
        grep -q "^$2: $3; give x86-64" "$scratch/errors"
}
unknown='x86-64 has no such level'
refused 'an unknown level' 'incode: INCODE_PROCESSOR=i386' "$unknown" \
    env INCODE_PROCESSOR=i386 "$INCODE" gen uniform 4
refused 'an unknown level for a node' 'incode-node: INCODE_PROCESSOR i386' \
    "$unknown" env INCODE_PROCESSOR=i386 "$BUILD/incode-node" --node 0
refused 'an unknown level for a rank' 'incode-node-mpi: INCODE_PROCESSOR=i386' \
    "$unknown" env INCODE_PROCESSOR=i386 "$BUILD/incode-node-mpi"

if ! command -v qemu-x86_64-static > "$scratch/where"; then
    skip processors/emulated 'qemu-x86_64-static is missing; make deps installs it'
    exit 0
fi
emulate() { # PROCESSOR COMMAND...: QEMU's own warnings apart
    qemu-x86_64-static -cpu "$@" 2> >(grep -v '^qemu-x86_64-static: warning' >&2)
}
same 'emulated, Conroe' x86-64 emulate Conroe "$INCODE"
same 'emulated, Nehalem' x86-64-v2 emulate Nehalem "$INCODE"
same 'emulated, Haswell' x86-64-v3 emulate Haswell "$INCODE"
# A processor that has the instructions, under a system that does not keep their
# registers.
same 'emulated, no AVX of the system' x86-64-v2 emulate Haswell,-xsave "$INCODE"
refused 'more than there is' 'incode: INCODE_PROCESSOR=x86-64-v3' \
    'the processor or the operating system does not have this level' \
    env INCODE_PROCESSOR=x86-64-v3 qemu-x86_64-static -cpu Nehalem "$INCODE" \
    gen uniform 4

# Node programs, one on each, as somebody starts them by hand.
cat > "$scratch/two.cube" <<'END'
dimension = 1; links = ( { node = 0; to = "host"; unix = "host"; },
    { node = 0; to = 1; unix = "0-1"; } );
END
for processors in 'Conroe Nehalem' 'Haswell Conroe'; do
    all=()
    read -r -a processor <<< "$processors"
    for node in 0 1; do
        eval "exec qemu-x86_64-static -cpu ${processor[node]} \"\$BUILD/\"$(
            "$INCODE" cube "$scratch/two.cube" | grep -e " --node $node ")" \
            2> "$scratch/$node.errors" < /dev/null &
        all+=($!)
    done
    rm -f "$scratch/out.npy"
    succeeds "processors/nodes on $processors" "$INCODE" run -q \
        "$scratch/points.npy" --strategy spatial --cube "$scratch/two.cube" \
        --stats "$scratch/stats.json" -o "$scratch/out.npy"
    check "processors/nodes on $processors: bytes" 'the output differs' \
        cmp -s "$scratch/usual.npy" "$scratch/out.npy"
    check "processors/nodes on $processors: each took part" \
        "$(cat "$scratch"/?.errors)" test "$(jq \
            '[.per_node[] | select(.tetrahedra_built > 0)] | length' \
            "$scratch/stats.json")" = 2
    kill "${all[@]}" 2> /dev/null
    wait "${all[@]}" 2> /dev/null
done
echo "$((SECONDS - took)) s"
