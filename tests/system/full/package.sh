#!/usr/bin/env bash
# The packages of make deb: built twice, in other folders, in other hours, in
# another language and without a cache, they are the same bytes; lintian says
# nothing; a bare Debian installs them, runs what host/package/README.md says, and
# has nothing of them left when they are purged.  Needs root and a network with
# Debian's packages.
. tests/system/lib.sh
. tests/system/root.bash
page=host/package/README.md
of_page() { host/package/tests/example $page '' "$1"; } # HEADING
make=("${MAKE:-make}" --no-print-directory BUILD="$BUILD")

rm -rf "$BUILD/deb"
succeeds 'package/make deb' "${make[@]}" deb > "$scratch/log"
wanted=$(sed -n 's/^Package: //p' host/package/control | sort | xargs)
found=$(for file in "$BUILD"/deb/*.deb; do basename "${file%%_*}"; done | sort | xargs)
check 'package/six packages' "$found" [ "$found" = "$wanted" ]
[ "$found" = "$wanted" ] || exit
mkdir "$scratch/other folder" 2> /dev/null
other() {
    (umask 027
    env CCACHE_DISABLE=1 TMPDIR="$scratch/other folder" TZ=Asia/Kathmandu \
        LC_ALL=C.UTF-8 LANGUAGE=de bash host/package/build "$scratch/deb" \
        "$BUILD/source/libsodium")
}
succeeds 'package/a second build' other > "$scratch/log"
differ=
for package in $wanted; do
    cmp "$BUILD/deb/$package"_*.deb "$scratch/deb/$package"_*.deb \
        > "$scratch/log" 2>&1 || differ="$differ $(last "$scratch/log")"
done
check 'package/both builds are the same bytes' "$differ" [ -z "$differ" ]
lintian --allow-root --fail-on error,warning "$BUILD"/deb/*.changes \
    > "$scratch/lintian" 2> "$scratch/errors"
status=$?
cat "$scratch/lintian"
check 'package/lintian' "$(last "$scratch/lintian")" [ $status = 0 ]

if [ "$(id -u)" != 0 ]; then
    skip 'package/a bare Debian' 'only root can make one'
    exit 0
fi
if ! root_base; then
    fail 'package/a bare Debian' "$(last "$scratch/log")"
    exit 1
fi
root_enter
# inside COMMAND: of root there, in the folder of the packages.
inside() {
    chroot "$root" env DEBIAN_FRONTEND=noninteractive sh -euc \
        "cd /packages; $1" > "$scratch/log" 2>&1 < /dev/null
}
mkdir "$root/packages"
cp "$BUILD"/deb/*.deb "$root/packages"
echo 'APT::Get::Assume-Yes "true";' > "$root/etc/apt/apt.conf.d/90-test"
echo 'APT::Sandbox::User "root";' >> "$root/etc/apt/apt.conf.d/90-test"
chroot "$root" useradd -m someone
cp -R host/package/tests "$root/packages/tests"
inside 'apt-get update'
succeeds 'package/apt install' inside "$(of_page Install)"
last "$scratch/log"

# The scripts for autopkgtest, each with what it depends on, as a user.
while read -r name depends; do
    succeeds "package/what the test $name depends on" inside \
        "apt-get install --no-install-recommends $depends"
    succeeds "package/the test $name" inside "su - someone -c '
        mkdir $name && AUTOPKGTEST_TMP=\$PWD/$name /packages/tests/$name'"
    last "$scratch/log"
done < <(awk '/^Tests: / { name = $2 }
    /^Depends: / { sub(/^Depends: /, ""); gsub(/,/, ""); print name, $0 }' \
    host/package/tests/control)

succeeds 'package/apt purge' inside "$(of_page Remove)"
left=$(find "$root" -xdev \( -path "$root/packages" -o -path "$root/home" -o -path \
    "$root/proc" -o -path "$root/var/lib/apt" -o -path "$root/var/log" \) -prune -o \
    -name '*incode*' ! -path '*unicode*' -print)
check 'package/nothing is left' "$left" [ -z "$left" ]
