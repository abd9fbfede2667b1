#!/usr/bin/env bash
# The files of host/package agree with what make install installs, with the
# names of the library, with the version and with each other.  full/package.sh
# builds the packages.
. tests/system/lib.sh
# One at a time, as make install writes its pages and its list of folders here.
exec 9> "$BUILD/installing"
flock 9
folder=host/package
control=$folder/control
declared=$(sed -n 's/^Package: //p' $control | sort | xargs)
root=$scratch/root
make=("${MAKE:-make}" --no-print-directory BUILD="$BUILD" DESTDIR="$root"
    PREFIX=/usr LIBDIR=/usr/lib/processor PYTHONDIR=/usr/lib/python3/dist-packages)

version=$(head -n 1 $folder/changelog | sed 's/ (/ /; s/).*//')
check 'package/the version of the changelog' "$version" \
    [ "$("$INCODE" --version)" = "$version" ]

# A package has what its list names, and each file is in one of them.
succeeds 'package/make install' "${make[@]}" install > "$scratch/said"
# Node programs for other processors, which make nodes makes, are in none.
(cd "$root" 2> /dev/null && find usr ! -type d ! -name .folders \
    ! -path 'usr/lib/incode/incode-node-*' | sort) > "$scratch/installed"
for list in "$folder"/*.install; do
    sed "s,^,$(basename "$list" .install) ," "$list"
done > "$scratch/lists"
cut -d ' ' -f 2 "$scratch/lists" > "$scratch/patterns"
while read -r file; do
    count=0
    while read -r pattern; do
        # A star stands for no slash, as where files are found.
        # shellcheck disable=SC2053
        [[ $file = $pattern && ${file//[^\/]/} = "${pattern//[^\/]/}" ||
            $file = $pattern/* ]] && count=$((count + 1))
    done < "$scratch/patterns"
    [ $count = 1 ] || echo "$file is in $count packages"
done < "$scratch/installed" > "$scratch/wrong"
check 'package/each installed file is in a package' "$(last "$scratch/wrong")" \
    test -s "$scratch/installed" -a ! -s "$scratch/wrong"
while read -r pattern; do
    # What only other targets make.
    case $pattern in
        *.img) [ -e "$BUILD/firmware/mps2-an500.img" ] || continue ;;
        *python*) [ -e "$BUILD/python/incode/__init__.py" ] || continue ;;
    esac
    compgen -G "$root/$pattern" > "$scratch/found" || echo "$pattern: no such file"
done < "$scratch/patterns" > "$scratch/wrong"
check 'package/each listed file is installed' "$(last "$scratch/wrong")" \
    test ! -s "$scratch/wrong"
check 'package/each package has a list' "$declared" [ "$declared" = "$(cut \
    -d ' ' -f 1 "$scratch/lists" | sort -u | xargs)" ]
check 'package/each package is in the page' "$declared" [ "$declared" = "$(sed -n \
    's/^| `\([a-z0-9-]*\)` |.*/\1/p' $folder/README.md | sort | xargs)" ]
"${make[@]}" uninstall > "$scratch/said" 2>&1
left=$(find "$root" -mindepth 1 2> /dev/null | head -n 1)
check 'package/uninstall leaves nothing' "$left" [ ! -e "$root" -o -z "$left" ]

# The library's names, those that a package built with it will need.
if command -v dpkg-gensymbols > "$scratch/where"; then
    succeeds 'package/symbols' dpkg-gensymbols -c4 -plibincode0 \
        -v"${version#* }" -I$folder/libincode0.symbols \
        -P"$scratch" -e"$BUILD/libincode.so.0" -O/dev/null
    cat "$scratch/errors"
else
    skip 'package/symbols' 'dpkg-dev is not installed'
fi

# What is needed for a build: make deb installs it, as dpkg-buildpackage wants.
"${make[@]}" -n deps-deb > "$scratch/said" 2> "$scratch/errors"
sed -n 's/.*tests\/deps //p' "$scratch/said" | tr -s ' ' '\n' |
    grep -vxE 'gcc|libc6-dev|make|dpkg-dev|fakeroot' | sort -u > "$scratch/by_make"
awk '/^Build-Depends/ { on = 1; next } /^[^ ]|^$/ { on = 0 }
    on { sub(/debhelper-compat.*/, "debhelper"); sub(/,.*/, ""); print $1 }' \
    $control | sort -u > "$scratch/by_control"
check 'package/Build-Depends are what make deb installs' \
    "$(comm -3 "$scratch/by_make" "$scratch/by_control" | xargs)" \
    cmp -s "$scratch/by_make" "$scratch/by_control"

# Its tests, and what they depend on here.
for test in $(sed -n 's/^Tests: //p' $folder/tests/control); do
    check "package/the test $test" 'no program' [ -x "$folder/tests/$test" ]
done

# A man page's day is the packages', wherever and whenever it is made.
SOURCE_DATE_EPOCH=86400 bash host/pages incode-node.1 "$BUILD" > "$scratch/page" \
    2> "$scratch/errors"
check 'package/the day of a man page' "$(head -n 1 "$scratch/page")" \
    grep -qE "^\.TH INCODE-NODE 1 1970-01-02 \"$version\"" \
    "$scratch/page"

# The unit, and its example: the line of a cube file's node.
sed -n 's/^ *ARGUMENTS=//p' $folder/README.md > "$scratch/line"
cp boards/linux/examples/network.cube "$scratch"
"$INCODE" key "$scratch/cube.key" 2> "$scratch/errors"
"$INCODE" cube "$scratch/network.cube" 2> "$scratch/errors" |
    sed -n "s,^incode-node \(--node 2 .*\) --key $scratch/cube.key,\1,p" \
        > "$scratch/printed"
check 'package/the arguments of the page' "$(last "$scratch/printed")" \
    cmp -s "$scratch/line" "$scratch/printed"
if command -v systemd-analyze > "$scratch/where"; then
    # The program where it is here, with a version that it prints.
    sed "s,/usr/bin/incode-node,$(realpath "$BUILD/incode-node")," \
        "$folder/incode-node@.service" > "$scratch/incode-node@2.service"
    succeeds 'package/the unit' systemd-analyze verify --man=no \
        "$scratch/incode-node@2.service"
else
    skip 'package/the unit' 'there is no systemd-analyze'
fi
