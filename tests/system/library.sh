#!/usr/bin/env bash
# The library, as its page shows it and as programs use it: the rows of a cube's
# run, byte for byte; two calls at once; cancelling; memory and threads that
# fail; the names that are seen from outside.
. tests/system/lib.sh
user=$BUILD/tests/library
first=$PWD

# The page's two examples, against an installed library.
root=$scratch/root
"${MAKE:-make}" --no-print-directory BUILD="$BUILD" PREFIX="$root" install \
    > "$scratch/said" 2>&1
export PKG_CONFIG_PATH=$root/lib/pkgconfig LD_LIBRARY_PATH=$root/lib
example() { # LANGUAGE FILE
    awk -v open="\`\`\`$1" '$0 == open { on = 1; next } /^```/ { on = 0 } on' \
        host/library/README.md > "$2"
}
if grep -q fsanitize "$BUILD/flags"; then
    skip library/installed 'a sanitizer build is not installed'
else
    example c "$scratch/ten.c"
    example cpp "$scratch/surface.cpp"
    # shellcheck disable=SC2046
    succeeds 'library/an example in C' gcc -std=c11 -Wall -Wextra -Werror \
        "$scratch/ten.c" $(pkg-config --cflags --libs incode) \
        -o "$scratch/ten"
    check 'library/its tetrahedra' 'not two' \
        [ "$("$scratch/ten" | tr '\n' ';')" = '0 1 2 3;1 2 3 4;' ]
    if command -v g++ > "$scratch/where"; then
        # shellcheck disable=SC2046
        succeeds 'library/an example in C++' g++ -Wall -Wextra -Werror \
            "$scratch/surface.cpp" $(pkg-config --cflags --libs incode) \
            -o "$scratch/surface"
        check 'library/its hull' "$("$scratch/surface" 2> "$scratch/errors")" \
            grep -qE '^[0-9]{4} tetrahedra, [0-9]{3} facets of the hull, area 5\.[0-9]+$' \
            <("$scratch/surface" 2> "$scratch/errors")
        check 'library/its progress' 'it does not end with 100 %' \
            grep -q '^100 %' "$scratch/errors"
    else
        skip 'library/an example in C++' 'g++ is not installed'
    fi
    names='incode_delaunay incode_status_text incode_tetrahedra_free incode_version'
    seen() { nm "$@" | awk 'NF == 3 && $2 ~ /[A-TV-Z]/ { print $3 }' | sort | xargs; }
    check 'library/names of libincode.so' "$(seen -D "$root/lib/libincode.so.0")" \
        [ "$(seen -D "$root/lib/libincode.so.0")" = "$names" ]
    check 'library/names of libincode.a' "$(seen "$root/lib/libincode.a")" \
        [ "$(seen "$root/lib/libincode.a")" = "$names" ]
fi
cd "$first" || exit 1

succeeds library/arguments "$user" arguments

# same NAME FILE.xyz: the rows of a cube's run, with 1 to 3 threads.
same() {
    local threads
    succeeds "library/$1, a cube" incode run "$2" -q --nodes 2 --memory 4M \
        -o "$scratch/cube.npy"
    for threads in 1 2 3; do
        succeeds "library/$1, $threads threads" within "$user" rows "$2" \
            $threads "$scratch/rows.npy"
        check "library/$1, $threads threads, rows" 'they differ from the cube'"'"'s' \
            cmp -s "$scratch/rows.npy" "$scratch/cube.npy"
        rm -f "$scratch/rows.npy"
    done
    rm -f "$scratch/cube.npy"
}
for kind in uniform bubbles bluntfin sphere grid hub; do
    "$INCODE" gen $kind 3000 --seed 7 -o "$scratch/$kind.xyz"
    same $kind "$scratch/$kind.xyz"
done
awk 'BEGIN { for (i = 0; i < 20; i++) for (j = 0; j < 20; j++)
    for (k = 0; k < 20; k++) printf "%.17g %.17g %.17g\n", i / 10, j / 10, k / 10
    print "0.5 0.5 0.5\n-0.0 0 0\n0 0 0" }' > "$scratch/lattice.xyz"
same 'a lattice of decimal steps, with duplicates' "$scratch/lattice.xyz"
awk 'BEGIN { for (i = 0; i < 60; i++) for (j = 0; j < 60; j++)
    print i, j, 3 * i + 5 * j; print 100, 100, 1000 }' > "$scratch/tilted.xyz"
same 'a tilted plane' "$scratch/tilted.xyz"
if has_data library; then
    while read -r set file points _ tetrahedra _; do
        [ "$tetrahedra" = 0 ] || [ "$points" -gt "${POINTS_MAX:-12000}" ] &&
            continue
        zcat -f "$INCODE_DATA/$file" > "$scratch/set.xyz"
        same "$set" "$scratch/set.xyz"
    done < <(list_sets)
fi

succeeds 'library/two calls at once' "$user" twice "$scratch/bubbles.xyz"
succeeds 'library/memory and threads that fail' "$user" failing \
    "$scratch/uniform.xyz" > "$scratch/tried"
check 'library/so many were tried' "$(xargs < "$scratch/tried")" \
    awk '{ n += $1 > 20 } END { exit n != 2 }' "$scratch/tried"
"$INCODE" gen uniform "${POINTS_MAX:-60000}" -o "$scratch/many.xyz"
succeeds library/cancelled "$user" cancel "$scratch/many.xyz" \
    > "$scratch/longest"
check 'library/it tells how long that took' "after $(cat "$scratch/longest") ms" \
    grep -qE '^[0-9]+$' "$scratch/longest"
