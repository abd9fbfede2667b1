#!/usr/bin/env bash
# A hundred runs whose nodes are killed, stopped and let go on at random, with
# every strategy, index, face rule and link: the digest is that of the
# undisturbed run.  SEED=N draws the same strikes again.  Ten minutes.
. tests/system/lib.sh

RANDOM=${SEED:-$$}
echo "seed $RANDOM"
points=$scratch/points.npy
"$INCODE" gen bubbles 60000 --seed 3 -o "$points" 2> /dev/null
"$INCODE" run "$points" -q --nodes 1 --stats "$scratch/first.json"
digest=$(stat_of "$scratch/first.json" digest)

pick() { shift $((RANDOM % $#)); echo "$1"; }

# Strikes a node of the run at random, a few times.
strike() {
    local times=$((1 + RANDOM % 5)) pid
    for _ in $(seq $times); do
        sleep "0.$((RANDOM % 4))$((RANDOM % 10))" # clock: chance
        pid=$(pgrep -P "$host" -x incode-node | shuf -n 1)
        [ -z "$pid" ] && return
        case $((RANDOM % 3)) in
        0) kill -STOP "$pid" && sleep 0.3 && kill -CONT "$pid" ;;
        *) kill -KILL "$pid" ;;
        esac 2> /dev/null
    done
}

restarts=0
for run in $(seq 100); do
    how="--strategy $(pick spatial sequential) --index $(pick kd kd grid) \
--face-rule $(pick own paper) --build $(pick auto faces points) \
--link $(pick tcp serial) --nodes $(pick 2 4 8 16) --memory $(pick 512K 1M 4M)"
    # shellcheck disable=SC2086
    within "$INCODE" run "$points" -q --stats "$scratch/stats.json" $how \
        2> "$scratch/errors" &
    timer=$!
    sleep 0.03 # clock: chance
    host=$(pgrep -P $timer)
    [ -n "$host" ] && strike
    wait $timer
    status=$?
    found=$(stat_of "$scratch/stats.json" digest 2> /dev/null)
    check "full survival/$run: $how" \
        "exit $status, digest $found: $(last "$scratch/errors")" \
        test $status = 0 -a "$found" = "$digest"
    # A run that failed has none.
    again=$(stat_of "$scratch/stats.json" node_restarts 2> /dev/null)
    restarts=$((restarts + ${again:-0}))
    rm -f "$scratch/stats.json"
done
check 'full survival/nodes were killed' "$restarts starts" test $restarts -ge 50
