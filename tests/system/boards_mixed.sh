#!/usr/bin/env bash
# A cube of four nodes of three kinds, Cortex-M, RISC-V and Linux, gives the
# digest of one node.  Two programs emulate the boards; a relay is the wire
# between them.
. tests/system/wires/boards.bash
need_boards mixed mps2-an500
need_boards mixed icicle

points=$scratch/points.npy
make_points "$points" 500

# Nodes 0 and 1 are mps2-an500, node 2 is icicle, node 3 is a process here.
# boards BOARD FILE OTHERS: in the background, $emulator.
boards() {
    "$INCODE" emulate --board "$1" --nodes 4 --linux "$3" -o "$2" \
        > "$2.said" 2> "$scratch/emulate.errors" &
    emulator=$!
    await test -s "$2"
}
arm=$scratch/arm.cube riscv=$scratch/riscv.cube
boards mps2-an500 "$arm" 2,3
first=$emulator
boards icicle "$riscv" 0,1,3
await test -S "$arm.d/0-2.socket"
await test -S "$riscv.d/2-0.socket"
"$RELAY" uart baud=2000000 "$arm.d/0-2.socket,$riscv.d/2-0.socket" \
    > "$scratch/relay" &
relay=$!
cat > "$cube" << EOF
dimension = 2;
board = "mps2-an500";
nodes = ({ node = 2; board = "icicle"; }, { node = 3; board = "linux"; });
start = [3];
links = (
    { node = 0; to = "host"; unix = "arm.cube.d/host.socket"; },
    { node = 1; to = 3; unix = "arm.cube.d/1-3.socket"; },
    { node = 2; to = 3; unix = "riscv.cube.d/2-3.socket"; }
);
EOF
for strategy in spatial exchange; do
    # shellcheck disable=SC2086
    computes "mixed/$strategy" "--strategy $strategy $patient"
    tells "mixed/$strategy: statistics" '.board == "mixed" and .nodes == 4'
done
part
end_boards mixed/riscv
emulator=$first
end_boards mixed/arm
