#!/usr/bin/env bash
# `make run` and `make test` in a clean Debian with nothing but the base
# system, git and make: as root, and as a user with sudo.  Needs root and a
# network with Debian's packages.
. tests/system/lib.sh
. tests/system/root.bash

if [ "$(id -u)" != 0 ]; then
    skip 'chroot' 'only root can make one'
    exit 0
fi
if ! root_base git,make,ca-certificates,sudo; then
    fail 'chroot' "$(last "$scratch/log")"
    exit 1
fi
for user in root someone; do
    enter $user
    works chroot $user run
    check "chroot/make run as $user: a result" 'no file in out/' \
        test -s "$root/src/incode/out/uniform20k.vtu"
    check "chroot/make run as $user: it says what it installs" 'not how many' \
        grep -qE '^With what they need these are 1[0-9]{2} packages: ' "$said"
    works chroot $user test
    echo "$user: $(last "$said")"
done
