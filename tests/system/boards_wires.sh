#!/usr/bin/env bash
# Bare boards, emulated, on wires as real ones are: paced, with flipped bits,
# lost bytes, bursts of noise, and receivers that overrun; and boards that are
# reset, stopped for a while, or killed and started again in mid-run.  The
# digest is the native one each time, and no node is lost.
. tests/system/wires/boards.bash
need_boards wires mps2-an500

points=$scratch/points.npy
make_points "$points" 500

emulate mps2-an500 2
join 115200 flip=3000 drop=5000 burst=10000 fifo=512 seed=1
computes 'wires/noise' '--strategy spatial'
part
suffered 'wires/noise' '[1-9][0-9]* flips, [1-9][0-9]* drops, [1-9][0-9]* bursts'

# A board's trouble, and what the run says of it.  A board that has not done with
# the run before may start again by itself.
make_points "$points" 300
later=15000
join 115200 flip=20000 seed=2
computes 'wires/node 1 reset' '--strategy exchange' reset_board 1
tells 'wires/node 1 reset: is noticed' '.generations > 1'
computes 'wires/node 0 reset' '--strategy exchange' reset_board 0
tells 'wires/node 0 reset: is noticed' '.generations > 1'
# No restart of the run before is left for the next one.
computes 'wires/after the resets' '--strategy exchange'
computes 'wires/node 1 stopped' '--strategy exchange' stop_board 1 3
# The other may have started again by itself, as above.
again=$(grep -c 'node 0 link 1: has started again' "$errors")
tells 'wires/node 1 stopped: is waited for' \
    ".generations == 1 + $again and ($(grep -c 'node 1 ' "$errors") == 0)"
computes 'wires/node 1 killed' '--strategy exchange' kill_board 1
tells 'wires/node 1 killed: is noticed' '.generations > 1'
computes 'wires/node 0 killed' '--strategy exchange' kill_board 0
tells 'wires/node 0 killed: is noticed' '.generations > 1'
part
end_boards wires

# Noise on the wires of RISC-V.
need_boards wires/icicle icicle
rm -rf "$cube.d" # flash of the other board; this one has a card
emulate icicle 2
join 115200 flip=3000 drop=5000 burst=10000 fifo=512 seed=1
computes 'wires/icicle: noise' '--strategy spatial'
part
suffered 'wires/icicle: noise' '[1-9][0-9]* flips, [1-9][0-9]* drops, [1-9][0-9]* bursts'
end_boards wires/icicle
