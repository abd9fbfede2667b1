#!/usr/bin/env bash
# What make install puts somewhere else: the programs, their pages for man, and
# their completion, in which stands all that --help tells of; make uninstall
# takes all of it away.
. tests/system/lib.sh
# One at a time, as make install writes its pages and its list of folders here.
exec 9> "$BUILD/installing"
flock 9
root="$scratch/root"
make=("${MAKE:-make}" --no-print-directory BUILD="$BUILD" DESTDIR="$root"
    PREFIX=/opt/incode)

mkdir -p "$root/opt/incode/share/man" # of somebody else, and stays
succeeds 'install/install' "${make[@]}" install > "$scratch/said"
cat "$scratch/said"
share=$root/opt/incode/share
completion=$share/bash-completion/completions
check 'install/the programs' 'they do not run' eval \
    '"$root/opt/incode/bin/incode" --version > "$scratch/version" &&
     "$root/opt/incode/bin/incode-node" --version > "$scratch/version.node"'
check 'install/one version' "$(cat "$scratch/version" "$scratch/version.node")" \
    test "$(cat "$scratch/version.node")" = "incode-node $(cut -d ' ' -f 2 \
        < "$scratch/version")"

# What help and pages call README.md is there, by its path, with what it links.
doc=$share/doc/incode
for arguments in '--help' 'run --help' 'console --help'; do
    # shellcheck disable=SC2086
    "$root/opt/incode/bin/incode" $arguments | tr -d '\n ' > "$scratch/help"
    check "install/$arguments names the document" "$(cat "$scratch/help")" \
        grep -qF "$(realpath "$doc")/README.md" "$scratch/help"
done
lacks=
while IFS=: read -r page link; do
    [ -e "${page%/*}/${link#??}" ] || lacks="$lacks $page: ${link#??}"
done < <(find "$doc" -name '*.md' -exec \
    grep -oHE '\]\([^)#:]+\.(md|svg|cube)' {} +)
check 'install/what the documents link' "$lacks" [ -z "$lacks" ]

# The library: the examples of its page, and the names that are seen from outside.
export PKG_CONFIG_SYSROOT_DIR=$root LD_LIBRARY_PATH=$root/opt/incode/lib
export PKG_CONFIG_PATH=$root/opt/incode/lib/pkgconfig
example() { # LANGUAGE NUMBER FILE
    awk -v open="\`\`\`$1" -v number="$2" \
        '$0 == open { on = ++n == number; next } /^```/ { on = 0 } on' \
        host/library/README.md > "$3"
}
example c 1 "$scratch/ten.c"
example c 2 "$scratch/where.c"
example c 3 "$scratch/stream.c"
example cpp 1 "$scratch/surface.cpp"
# shellcheck disable=SC2046
succeeds 'install/an example in C' gcc -std=c11 -Wall -Wextra -Werror \
    "$scratch/ten.c" $(pkg-config --cflags --libs incode) -o "$scratch/ten"
check 'install/its tetrahedra' 'not two' \
    [ "$("$scratch/ten" | tr '\n' ';')" = '0 1 2 3;1 2 3 4;' ]
# shellcheck disable=SC2046
succeeds 'install/an example of point location' gcc -std=c11 -Wall -Wextra \
    -Werror "$scratch/where.c" $(pkg-config --cflags --libs incode) \
    -o "$scratch/located"
"$scratch/located" > "$scratch/answers"
printf 'query %s\n' '0 is in tetrahedron 0' '1 is in tetrahedron 1' \
    '2 is in tetrahedron 0' '3 is outside' > "$scratch/expected"
echo 'point 0 has neighbours 1 2 3' >> "$scratch/expected"
check 'install/what it finds' "$(xargs < "$scratch/answers")" \
    cmp -s "$scratch/answers" "$scratch/expected"
# shellcheck disable=SC2046
succeeds 'install/an example of streams' gcc -std=c11 -Wall -Wextra -Werror \
    "$scratch/stream.c" $(pkg-config --cflags --libs incode) -o "$scratch/streams"
check 'install/its blocks' 'not all tetrahedra, or none' \
    grep -qE '^100000 points, 67[0-9]{4} tetrahedra, all seen$' \
    <("$scratch/streams")
if command -v g++ > "$scratch/where"; then
    # shellcheck disable=SC2046
    succeeds 'install/an example in C++' g++ -Wall -Wextra -Werror \
        "$scratch/surface.cpp" $(pkg-config --cflags --libs incode) \
        -o "$scratch/surface"
    "$scratch/surface" > "$scratch/hull" 2> "$scratch/progress"
    check 'install/its hull' "$(cat "$scratch/hull")" grep -qE \
        '^[0-9]{4} tetrahedra, [0-9]{3} facets of the hull, area 5\.[0-9]+$' \
        "$scratch/hull"
    check 'install/its progress' 'it does not end with 100 %' \
        grep -q '^100 %' "$scratch/progress"
else
    skip 'install/an example in C++' 'g++ is not installed'
fi
names=$(sed -n 's/^ \(.*\)@.*/\1/p' host/package/libincode0.symbols | xargs)
seen() { nm "$@" | awk 'NF == 3 && $2 ~ /[A-TV-Z]/ { print $3 }' | sort | xargs; }
for file in libincode.so.0 libincode.a; do
    kind=
    [ $file = libincode.a ] || kind=-D
    # shellcheck disable=SC2086
    seen $kind "$root/opt/incode/lib/$file" > "$scratch/seen"
    check "install/names of $file" "$(cat "$scratch/seen")" \
        [ "$(cat "$scratch/seen")" = "$names" ]
done

# The Python package, and the program that it runs.
package=$(find "$root" -path '*/incode/__init__.py')
if [ -n "$package" ]; then
    printf '%s\n' '0 0 0' '1 0 0' '0 1 0' '0 0 1' > "$scratch/four.xyz"
    succeeds 'install/the Python package' env -u INCODE_PROGRAM \
        PYTHONPATH="${package%/incode/*}" PATH=/usr/bin:/bin \
        "${PYTHON:-/usr/bin/python3}" -c 'import sys, incode
print(incode.Delaunay(incode.read(sys.argv[1])).simplices)' \
        "$scratch/four.xyz" > "$scratch/simplices"
    check 'install/its simplices' "$(cat "$scratch/simplices")" \
        [ "$(cat "$scratch/simplices")" = '[[0 1 2 3]]' ]
else
    skip 'install/the Python package' 'it is not made here: make python'
fi

# The firmware of boards, where the installed program finds it.
if [ -e "$BUILD/firmware/mps2-an500.img" ] &&
    command -v qemu-system-arm > "$scratch/where"; then
    "$INCODE" gen uniform 100 -o "$scratch/100.npy"
    succeeds 'install/firmware' "$root/opt/incode/bin/incode" run -q \
        "$scratch/100.npy" --board mps2-an500 --nodes 2
else
    skip install/firmware 'no firmware is made here, or qemu-system-arm missing'
fi

# complete PROGRAM WORD...: what completes the last word.
# shellcheck disable=SC1091
. "$completion/incode"
complete_words() {
    COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) COMPREPLY=()
    if [ "$1" = incode ]; then _incode; else _incode_node; fi
    echo " ${COMPREPLY[*]} "
}
told_by() { # COMMAND...: the options of a help's lists
    "$@" --help | grep -oE '^ +-.*' | sed -E 's/   .*//' |
        grep -oE -- '(^|[ ,])--?[a-zA-Z?][a-z-]*' | tr -d ' ,' | sort -u
}
lacking() { # PAGE COMPLETED OPTION...: those that are not in both
    local page=$1 completed=$2 option
    for option in "${@:3}"; do
        grep -qE -- "^\.B (.*, )?${option//\?/\\?}([= ,]|$)" "$page" ||
            echo "$option (page)"
        [[ "$completed" = *" $option "* ]] || echo "$option (completion)"
    done
}
# pages_tell PROGRAM [COMMAND]: the part of the page that is about it.
pages_tell() {
    local program=$1 command=${2:-} options=() lacks
    sed 's/\\-/-/g' "$share/man/man1/$program.1" | awk -v name="$command" '
        /^\.S[SH] / { on = $0 == (name == "" ? ".SH SYNOPSIS" : ".SS " name) }
        on' > "$scratch/page"
    mapfile -t options < <(told_by "$BUILD/$program" ${command:+"$command"})
    lacks=$(lacking "$scratch/page" "$(complete_words "$program" \
        ${command:+"$command"} -)" "${options[@]}")
    check "install/options of $program${command:+ $command}" \
        "${#options[@]}: $lacks" test -z "$lacks" -a ${#options[@]} -gt 2
}
mapfile -t commands < <("$INCODE" --help |
    awk '/^Commands:/ { on = 1 } /^$/ { on = 0 } on && /^  [a-z]/ { print $1 }')
check 'install/commands' "${commands[*]}" test ${#commands[@]} -gt 7
for command in "${commands[@]}"; do
    [ "$command" = help ] || pages_tell incode "$command"
done
pages_tell incode
pages_tell incode-node

completes() { # EXPECTED WORD...
    local said
    said=$(complete_words "${@:2}")
    check "install/completion of ${*:2}" "$said" test "$said" = " $1 "
}
completes 'sequential spatial' incode run --strategy s
completes spatial incode run a.xyz --strategy = sp
completes 512 incode sim --nodes = 5
completes --strategy incode run --str
completes verify incode ver
completes 'verify' incode help ver
completes '' incode run a # a file's name
completes --dimension incode-node --node 0 --dim

for page in incode incode-node; do
    if command -v man > "$scratch/which"; then
        man --warnings -E UTF-8 -Tutf8 -Z -l "$share/man/man1/$page.1" \
            > "$scratch/printed" 2> "$scratch/errors"
        check "install/man takes $page.1" "$(last "$scratch/errors")" \
            test ! -s "$scratch/errors" -a -s "$scratch/printed"
    else
        skip "install/man takes $page.1" 'there is no man'
    fi
done

"${make[@]}" uninstall > "$scratch/said"
# left: what is there but the folder that was there before.
left() { (cd "$root" && find . -mindepth 1 | sort | tr '\n' ' '); }
before='./opt ./opt/incode ./opt/incode/share ./opt/incode/share/man '
check 'install/uninstall leaves what was there' "$(left)" [ "$(left)" = "$before" ]
"${make[@]}" install > "$scratch/said" 2>&1
"${make[@]}" install > "$scratch/said" 2>&1
"${make[@]}" BUILD="$scratch/none" uninstall > "$scratch/said" 2>&1 # as after make clean
check 'install/uninstall after two installs' "$(left)" [ "$(left)" = "$before" ]
refused=$("${make[@]}" nodes FOR=z80 2>&1)
check 'install/make nodes FOR=z80' "$refused" grep -qF \
    'FOR=z80: there is no node program of that; allowed: x86_64 aarch64' \
    <<< "$refused"
"${make[@]}" -pq help FOR=armhf > "$scratch/said" 2>&1
check 'install/make nodes FOR=armhf' "$(grep '^cross:' "$scratch/said")" \
    grep -qx "cross: $BUILD/nodes/incode-node-armhf" "$scratch/said"

# A variable without a value is one that is not given.
"${make[@]}" -n V=1 BUILD="$scratch/none" ARCH= "$scratch/none/incode" \
    > "$scratch/said" 2> "$scratch/errors"
check 'install/make ARCH= without a value' "$(last "$scratch/errors")" eval \
    'grep -qE -- "-march=(x86-64|armv8-a) " "$scratch/said" &&
     ! grep -qE -- "-march=( |$)" "$scratch/said"'
