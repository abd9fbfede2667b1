#!/usr/bin/env bash
# `incode bench links`.  With the machine to itself: a process that is starved
# for longer than a timeout sends again what was not lost.  Where other programs
# starve it all the same, it is asked up to five times.
. tests/system/lib.sh
has_terminals 'links/bench links' || exit 0

bench() {
    incode bench links > "$scratch/bench" 2> "$scratch/errors"
    status=$?
}
clean() { grep -qE '^serial, paced to 115200 .* 0\.00 %$' "$scratch/bench"; }

for _ in 1 2 3 4 5; do
    bench
    [ $status != 0 ] || clean && break
done
check 'links/bench links' "exit $status: $(last "$scratch/errors")" \
    test $status = 0
for driver in 'tcp, loopback' 'tcp, with a key' 'serial, pseudo-terminal' \
    'serial, paced to 115200 baud'; do
    check "links/bench links: $driver" "$(cat "$scratch/bench")" \
        grep -qE "^$driver +[0-9.]+ +(-|[0-9.]+ %) +[0-9]+ +[0-9]+ " \
        "$scratch/bench"
done
check 'links/bench links: a clean line resends nothing' \
    "$(cat "$scratch/bench")" clean
