#!/usr/bin/env bash
# `make run` and `make test` in a clean Debian 12 with nothing but the base
# system, git and make: as root, and as a user with sudo.  Needs root and a
# network with Debian's packages.
. tests/system/lib.sh
root=${CHROOT:-$scratch/root}
mirror=${MIRROR:-http://deb.debian.org/debian}

if [ "$(id -u)" != 0 ]; then
    skip 'chroot' 'only root can make one'
    exit 0
fi
leave() {
    umount "$root/dev/pts" "$root/dev/shm" "$root/dev" "$root/proc" \
        2> /dev/null
}
trap 'leave; rm -rf --one-file-system "$scratch"' EXIT

# enter NAME USER: a fresh base system with a clone of this project in it and
# the data beside it.
base() {
    debootstrap --variant=minbase --include=git,make,ca-certificates,sudo \
        bookworm "$scratch/base" "$mirror" > "$scratch/log" 2>&1
}
enter() {
    leave
    rm -rf --one-file-system "$root"
    cp -a "$scratch/base" "$root"
    mount -t proc proc "$root/proc"
    mount --bind /dev "$root/dev"
    mount -t devpts devpts "$root/dev/pts" 2> /dev/null
    mount -t tmpfs tmpfs "$root/dev/shm" 2> /dev/null
    cp /etc/resolv.conf "$root/etc/"
    [ -d /etc/apt/apt.conf.d ] && grep -lsi proxy /etc/apt/apt.conf.d/* |
        xargs -r cp -t "$root/etc/apt/apt.conf.d"
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
if ! base; then
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
