#!/usr/bin/env bash
# Tetrahedra in the order in which they were made (--order as-made): the digest of
# the file is that of the canonical order, for threads, for a limit of memory and
# for cubes, in every format, whether it is written meanwhile or at the end.
. tests/system/lib.sh

u=$scratch/u.npy
incode gen bubbles 20000 --seed 3 -o "$u"
incode run "$u" -q -o "$scratch/c.npy"
wanted=$(incode digest "$scratch/c.npy")

# same NAME FILE OPTION...: a run into FILE; its digest is the one that is wanted.
same() {
    local file=$scratch/$2
    succeeds "as-made/$1" incode run "$u" --order as-made -o "$file" \
        "${@:3}" > "$scratch/said"
    is_wanted "$1" "$file"
    rm -f "$file"
}
is_digest() { [[ $1 == sha256:* && $1 == "$wanted" ]]; }
is_wanted() { # NAME FILE
    local found
    found=$(incode digest "$2" 2>&1)
    check "as-made/$1, digest" "$found, not $wanted" \
        is_digest "$found"
}

for format in npy msh mesh vtu vtk; do
    same ".$format" a.$format --threads 2
    # As the check needs them, tetrahedra are written when all are there.
    same ".$format, checked" a.$format --threads 3 --verify
done
same 'one thread' a.npy --threads 1
same 'a limit' a.npy --host-memory 16M --scratch "$scratch"
same 'a limit, checked' a.msh --host-memory 16M --scratch "$scratch" --verify
same 'a cube' a.npy --nodes 2 --strategy spatial --verify
same 'a cube of one' a.msh --nodes 1

succeeds 'as-made/several outputs' incode run "$u" --order as-made --threads 3 \
    -o "$scratch/a.npy" -o "$scratch/a.msh" --no-progress > "$scratch/said"
is_wanted 'several outputs, the first' "$scratch/a.npy"
is_wanted 'several outputs, the second' "$scratch/a.msh"
check 'as-made/the summary' "$(cat "$scratch/said")" grep -q \
    ' tetrahedra, in the order in which they were made, so without a digest$' \
    "$scratch/said"
check 'as-made/as many bytes' 'the files differ in length' \
    [ "$(wc -c < "$scratch/a.npy")" -eq "$(wc -c < "$scratch/c.npy")" ]
not_sorted() { [ -s "$scratch/a.npy" ] && ! cmp -s "$scratch/a.npy" "$scratch/c.npy"; }
check 'as-made/without the sort' 'the rows are in canonical order' not_sorted
incode convert "$scratch/a.npy" "$scratch/b.npy"
check 'as-made/each row is canonical' 'sorted, the file differs' \
    cmp -s "$scratch/b.npy" "$scratch/c.npy"

# What is no file takes the rows at the end.
incode run "$u" -q --order as-made -o - > "$scratch/a.ele"
is_wanted 'standard output' "$scratch/a.ele"
mkfifo "$scratch/pipe.npy"
within cat "$scratch/pipe.npy" > "$scratch/a.npy" &
reader=$!
exec 8> "$scratch/pipe.npy" # once its reader is there
succeeds 'as-made/a pipe' incode run "$u" -q --order as-made \
    -o "$scratch/pipe.npy"
exec 8>&-
wait $reader
is_wanted 'a pipe' "$scratch/a.npy"
succeeds 'as-made/statistics' incode run "$u" -q --order as-made \
    --stats "$scratch/stats.json" -o "$scratch/a.npy"
check 'as-made/statistics, no digest' "$(head -12 "$scratch/stats.json")" \
    jq -e '.digest == null and .tetrahedra > 100000 and .hull_facets > 0' \
    "$scratch/stats.json" > /dev/null

refuses 'as-made/.ele' 2 '^incode: .*o.ele: .*canonical.*--order as-made' \
    incode run "$u" --order as-made -o "$scratch/left/o.ele"
refuses 'as-made/no such order' 2 '^incode: --order sorted: .*canonical, as-made' \
    incode run "$u" --order sorted -o "$scratch/left/o.npy"
# Files of no more than a MiB are a full disk.
full() { (ulimit -f 1024 && incode run "$u" "$@"); }
refuses 'as-made/a disk without room' 3 'o.npy: writing failed .*File too large' \
    full --order as-made -o "$scratch/left/o.npy"
refuses 'as-made/fewer than four points' 3 '1 distinct points ' incode run \
    <(echo 1 2 3) --format xyz --order as-made -o "$scratch/left/o.npy"
