#!/usr/bin/env bash
# `incode bench links`: each driver's row.  With CLEAN=1, which wants the machine
# to itself, also that a clean line sends nothing again: who is starved for longer
# than a timeout does, so it is asked up to five times.  (The same in virtual time:
# tests/unit/transport/drivers/test_serial.c.)
. tests/system/lib.sh
has_terminals 'links/bench links' || exit 0

bench() {
    incode bench links > "$scratch/bench" 2> "$scratch/errors"
    status=$?
}
clean() { grep -qE '^serial, paced to 115200 .* 0\.00 %$' "$scratch/bench"; }

bench
for _ in ${CLEAN:+1 2 3 4}; do
    [ $status != 0 ] || clean && break
    bench
done
check 'links/bench links' "exit $status: $(last "$scratch/errors")" \
    test $status = 0
for driver in 'tcp, loopback' 'tcp, with a key' 'serial, pseudo-terminal' \
    'serial, paced to 115200 baud'; do
    check "links/bench links: $driver" "$(cat "$scratch/bench")" \
        grep -qE "^$driver +[0-9.]+ +(-|[0-9.]+ %) +[0-9]+ +[0-9]+ " \
        "$scratch/bench"
done
[ -z "${CLEAN:-}" ] || check 'links/bench links: a clean line resends nothing' \
    "$(cat "$scratch/bench")" clean
