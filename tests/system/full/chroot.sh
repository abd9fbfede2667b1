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
# enter USER: a fresh base system with a clone of this project in it and the data
# beside it.
enter() {
    root_enter
    mkdir "$root/src"
    git clone -q . "$root/src/incode"
    [ -d "$INCODE_DATA" ] && mkdir "$root/src/shared" &&
        cp -a "$INCODE_DATA" "$root/src/shared/data"
    [ -d "$INCODE_REAL" ] && mkdir -p "$root/src/shared" &&
        cp -a "$INCODE_REAL" "$root/src/shared/real"
    if [ "$1" != root ]; then
        chroot "$root" useradd -m "$1"
        echo "$1 ALL=(ALL) NOPASSWD: ALL" > "$root/etc/sudoers.d/$1"
        chown -R 1000:1000 "$root/src"
    fi
}
works() { # USER TARGET
    local name="chroot/make $2 as $1"
    if chroot "$root" su - "$1" -c "cd /src/incode && make $2" \
        > "$BUILD/results/chroot-$1-$2.txt" 2>&1 < /dev/null; then
        pass "$name"
    else
        fail "$name" "$(last "$BUILD/results/chroot-$1-$2.txt")"
    fi
}

mkdir -p "$BUILD/results"
if ! root_base git,make,ca-certificates,sudo; then
    fail 'chroot' "$(last "$scratch/log")"
    exit 1
fi
for user in root someone; do
    enter $user
    works $user run
    check "chroot/make run as $user: a result" 'no file in out/' \
        test -s "$root/src/incode/out/uniform20k.vtu"
    check "chroot/make run as $user: it says what it installs" 'not how many' \
        grep -qE '^With what they need these are 1[0-9]{2} packages: ' \
        "$BUILD/results/chroot-$user-run.txt"
    works $user test
    echo "$user: $(last "$BUILD/results/chroot-$user-test.txt")"
done
