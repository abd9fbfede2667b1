#!/usr/bin/env bash
# `make test` in a clean system of the other release of Debian, 12 or 13, with
# its compilers and libraries: as a user with sudo.  Needs root and a network with
# Debian's packages.
. tests/system/lib.sh
. tests/system/root.bash

if [ "$(id -u)" != 0 ]; then
    skip 'release' 'only root can make one'
    exit 0
fi
other=trixie gpiod=2
[[ "$(root_mirror)" != trixie\ * ]] || other=bookworm gpiod=1
if ! root_base git,make,ca-certificates,sudo $other; then
    fail 'release' "$(last "$scratch/log")"
    exit 1
fi
enter someone
works release someone test
echo "$other: $(last "$said")"
# That it was the other one.
check "release/$other: libgpiod" 'not that of the other release' \
    test -f "$root/src/incode/build/obj/host/cube/lines_gpiod$gpiod.o"
