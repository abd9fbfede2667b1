# shellcheck shell=bash
# A bare Debian of this machine's release, in a folder: for scripts of full/ that
# source this after lib.sh.  Needs root and a network with Debian's packages.
# shellcheck disable=SC2154
root=${CHROOT:-$scratch/root}

root_leave() {
    umount "$root/dev/pts" "$root/dev/shm" "$root/dev" "$root/proc" \
        2> /dev/null
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

# root_base [PACKAGE,..]: the base system, $scratch/base.
root_base() {
    local from
    read -r -a from <<< "$(root_mirror)"
    debootstrap --variant=minbase ${1:+"--include=$1"} "${from[0]}" \
        "$scratch/base" "${MIRROR:-${from[1]}}" > "$scratch/log" 2>&1
}

# A fresh copy of it, $root, with what a running system has.
root_enter() {
    root_leave
    rm -rf --one-file-system "$root"
    cp -a "$scratch/base" "$root"
    mount -t proc proc "$root/proc"
    mount --bind /dev "$root/dev"
    mount -t devpts devpts "$root/dev/pts" 2> /dev/null
    mount -t tmpfs tmpfs "$root/dev/shm" 2> /dev/null
    cp /etc/resolv.conf "$root/etc/"
    [ -d /etc/apt/apt.conf.d ] && grep -lsi proxy /etc/apt/apt.conf.d/* |
        xargs -r cp -t "$root/etc/apt/apt.conf.d"
}
