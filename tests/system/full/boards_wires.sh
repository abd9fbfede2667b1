#!/usr/bin/env bash
# Bare boards, emulated, on bad wires, for long: boards that are reset, stopped
# and killed at random, on cubes of two and four of either kind, and sixteen
# boards at 19,200 baud.  SEED=N draws the same again, ROUNDS=N as many of each.
. tests/system/wires/boards.bash
need_boards 'full wires' mps2-an500
RANDOM=${SEED:-$$}
echo "seed $RANDOM"
rounds=${ROUNDS:-12}
# A run that takes as long hangs: it is a quarter of an hour otherwise.
hang=${SECONDS_MAX:-400}

points=$scratch/points.npy
make_points "$points" 500

# trouble TIMES: boards in turn, at random.
trouble() {
    local times=$1
    while [ "$times" -gt 0 ] && kill -0 "$host" 2> /dev/null; do
        local node=$((RANDOM % nodes))
        case $((RANDOM % 3)) in
        0) reset_board $node ;;
        1) stop_board $node "$((RANDOM % 4)).$((RANDOM % 10))" ;;
        *) kill_board $node ;;
        esac
        times=$((times - 1))
        # clock: chance
        [ "$times" = 0 ] || sleep "$((1 + RANDOM % 3)).$((RANDOM % 10))"
    done
}

strategies=(auto spatial sequential exchange master-slaves)
for board in mps2-an500 mps2-an385 icicle; do
    for size in 2 4; do
        emulate $board $size
        for round in $(seq "$rounds"); do
            seed=$RANDOM
            strategy=${strategies[RANDOM % ${#strategies[@]}]}
            later=$((RANDOM * 3 * size / 2))
            name="full wires/$board $size nodes $round: $strategy, seed $seed"
            join 115200 flip=5000 drop=10000 burst=20000 fifo=256 seed=$seed
            computes "$name" "--strategy $strategy" trouble $((RANDOM % 4))
            part
        done
        end_boards "full wires/$board $size nodes"
    done
done

for board in mps2-an500 mps2-an385; do
    emulate $board 16
    join 19200 flip=10000 drop=20000 burst=40000 seed=$RANDOM
    computes "full wires/16 $board at 19200 baud" ''
    later=300000
    computes "full wires/16 $board at 19200 baud, in trouble" '' trouble 3
    part
    suffered "full wires/16 $board at 19200 baud" \
        '[1-9][0-9]* flips, [1-9][0-9]* drops, [1-9][0-9]* bursts'
    end_boards "full wires/16 $board"
done
