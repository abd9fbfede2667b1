# shellcheck shell=bash
# A bare Debian of this machine's release or another, in a folder: for scripts of
# full/ that source this after lib.sh.  Needs root and a network with Debian's
# packages.
# shellcheck disable=SC2154
root=${CHROOT:-$scratch/root}

root_leave() {
    umount "$root/dev/pts" "$root/dev/shm" "$root/dev" "$root/proc" \
        "$root/sys" 2> /dev/null
}
trap 'root_leave; rm -rf --one-file-system "$scratch"' EXIT

# The archive of this machine's own packages, as its apt has it.
root_mirror() {
    local codename
    # shellcheck disable=SC1091
    codename=$(. /etc/os-release && echo "$VERSION_CODENAME")
    # shellcheck disable=SC2016
    apt-get indextargets --format '$(CODENAME) $(COMPONENT) $(SITE)' \
        'Created-By: Packages' | awk -v codename="$codename" '
        $1 == codename && $2 == "main" { print codename, $3; exit }'
}

# root_base [PACKAGE,.. [RELEASE]]: the base system, $scratch/base.
root_base() {
    local from
    read -r -a from <<< "$(root_mirror)"
    debootstrap --variant=minbase ${1:+"--include=$1"} "${2:-${from[0]}}" \
        "$scratch/base" "${MIRROR:-${from[1]}}" > "$scratch/log" 2>&1
}

# A fresh copy of it, $root, with what a running system has.
root_enter() {
    root_leave
    rm -rf --one-file-system "$root"
    cp -a "$scratch/base" "$root"
    mount -t proc proc "$root/proc"
    mount -t sysfs -o ro sysfs "$root/sys"
    mount --bind /dev "$root/dev"
    mount -t devpts devpts "$root/dev/pts" 2> /dev/null
    mount -t tmpfs tmpfs "$root/dev/shm" 2> /dev/null
    cp /etc/resolv.conf "$root/etc/"
    [ -d /etc/apt/apt.conf.d ] && grep -lsi proxy /etc/apt/apt.conf.d/* |
        xargs -r cp -t "$root/etc/apt/apt.conf.d"
}

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
# works NAME USER TARGET: make TARGET there; what it says is $said.
works() {
    local name="$1/make $3 as $2"
    said=$BUILD/results/$1-$2-$3.txt
    mkdir -p "$BUILD/results"
    if chroot "$root" su - "$2" -c "cd /src/incode && make $3" \
        > "$said" 2>&1 < /dev/null; then
        pass "$name"
    else
        fail "$name" "$(last "$said")"
    fi
}
