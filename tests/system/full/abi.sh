#!/usr/bin/env bash
# Programs that are linked with the library of the last release run with the one
# that is built: no symbol is gone, and none has another type.  What was added is
# listed.  Each kind of change is made in a copy, and must be found.
. tests/system/lib.sh
released=host/library/libincode.abi
built=$scratch/built.abi

if ! command -v abidiff > "$scratch/where"; then
    skip abi 'there is no abidiff; make deps-full installs it'
    exit 0
fi
succeeds 'abi/the library' "${MAKE:-make}" --no-print-directory \
    BUILD="$BUILD" ABI="$built" abi > "$scratch/said"
check 'abi/of nothing but the header' "$(cut -c 1-60 "$built")" eval \
    'grep -q incode_options "$built" && ! grep -qE "incode_pager|$PWD" "$built"'

# differs OLD NEW: $found has the bits of abidiff's status, without additions: 4,
# something changed; 8, so that programs of the old one fail; 1 or 2, they were
# not compared.
differs() {
    abidiff --no-added-syms "$1" "$2" > "$scratch/report" 2>&1
    found=$?
}
differs "$released" "$built"
check 'abi/nothing is gone or has changed' \
    "status $found: $(grep -m 1 -E '^ +\[|^  ' "$scratch/report")" \
    [ "$found" = 0 ]
abidiff --no-default-suppression "$released" "$built" |
    sed -n "s/^ *\[A\] *'\(.*\)'.*/added since the last release: \1/p"

# In copies: a function less, one argument of another type, a member of another
# type, an enumerator of another value.
name=incode_version
sed "/<elf-symbol name='$name'/d
    /<function-decl name='$name'/,/<\/function-decl>/d" "$built" \
    > "$scratch/less.abi"
unsigned=$(sed -n "s/.* name='threads' type-id='\([^']*\)'.*/\1/p" "$built")
sed "s/type-id='[^']*' \(name='points'\)/type-id='$unsigned' \1/" "$built" \
    > "$scratch/argument.abi"
sed "s/\(name='memory_max' type-id='\)[^']*/\1$unsigned/" "$built" \
    > "$scratch/member.abi"
sed "s/\(name='INCODE_FLAT' value='\)5/\155/" "$built" > "$scratch/value.abi"
for what in less argument member value; do
    differs "$built" "$scratch/$what.abi"
    check "abi/a change is found: $what" "status $found" \
        [ $((found % 4)):$((found / 4 > 0)) = 0:1 ]
done
differs "$scratch/less.abi" "$built"
check 'abi/a function more passes' "status $found" [ "$found" = 0 ]
