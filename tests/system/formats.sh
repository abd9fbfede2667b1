#!/usr/bin/env bash
# The points of a real set in formats that awk makes of it: the digest is the
# set's, whatever the format, packed or not.
. tests/system/lib.sh

need_data formats
set=pdb_3GQP
read -r _ file _ _ _ digest < <(list_sets | grep "^$set ")
from=$scratch/$set.xyz
gzip -cd "$INCODE_DATA/$file" > "$from"
rows=$(wc -l < "$from")

# made EXTENSION PROGRAM: by awk, from the rows of the set.
made() { awk -v rows="$rows" "$2" "$from" > "$scratch/a.$1"; }
same() { # NAME FILE [OPTION...]
    triangulates "formats/$1" "$set" "$2" "$digest" "${@:3}"
}
made pts 'NR == 1 { print rows } { print $0, -1024 + NR % 7, 255, 0, 0 }'
made obj '{ print "v", $0, 1; print "vn 0 0 1" } END { print "f 1 2 3" }'
made csv 'BEGIN { print "id,z,y,x" } { print NR "," $3 "," $2 "," $1 }'
for extension in pts obj csv; do
    same ".$extension" "$scratch/a.$extension"
    gzip "$scratch/a.$extension"
    same ".$extension.gz" "$scratch/a.$extension.gz"
done

# Three rows are a facet; the last one is said again where they do not suffice.
awk 'BEGIN { print "solid of three" }
    { row[NR % 3] = last = $0 }
    NR % 3 == 0 { facet() }
    END { for (n = NR; n % 3 != 0;) { row[++n % 3] = last }
        if (n > NR) facet(); print "endsolid" }
    function facet() {
        print "facet normal 0 0 0\nouter loop\nvertex", row[1], "\nvertex", \
            row[2], "\nvertex", row[0], "\nendloop\nendfacet"
    }' "$from" > "$scratch/a.stl"
same '.stl, as text' "$scratch/a.stl"

# Thousandths as whole numbers, as a scanner has them; and what they are as
# doubles.  awk writes no bytes of zero: the shell does.
le4() { # a column of whole numbers as bytes, the lowest first
    awk '{ n = $1 < 0 ? $1 + 4294967296 : $1
        for (i = 0; i < 4; i++) { printf "\\x%02x", n % 256; n = int(n / 256) }
    }'
}
zeros() { head -c "$1" /dev/zero; }
whole() { awk '{ printf "%.0f\n%.0f\n%.0f\n0\n0\n", 1000 * $1, 1000 * $2, \
    1000 * $3 }' "$from"; }
{
    printf 'LASF' && zeros 20 && printf '\1\2' && zeros 68
    printf '\xe3\0\xe3\0\0\0\0\0\0\0\0\x14\0'
    printf '%b' "$(echo "$rows" | le4)"
    zeros 20
    for _ in x y z; do printf '\xfc\xa9\xf1\xd2\x4d\x62\x50\x3f'; done
    zeros 72
    printf '%b' "$(whole | le4)"
} > "$scratch/a.las"
awk '{ for (d = 1; d <= 3; d++) {
        printf "%.17g%s", sprintf("%.0f", 1000 * $d) * 0.001, d < 3 ? " " : "\n"
    } }' "$from" > "$scratch/thousandths.xyz"
incode run "$scratch/thousandths.xyz" -q -o "$scratch/thousandths.npy"
incode run "$scratch/a.las" -q -o "$scratch/las.npy" 2> "$scratch/errors"
status=$?
check 'formats/.las' "exit $status: $(last "$scratch/errors")" \
    cmp "$scratch/thousandths.npy" "$scratch/las.npy"

# What has no extension is told by --format: a pipe, a file, a packed one.
rm "$scratch/first.$set.npy"
gzip -c "$scratch/a.stl" > "$scratch/packed"
mkfifo "$scratch/pipe"
cat "$scratch/a.stl" > "$scratch/pipe" &
same '--format, a named pipe' "$scratch/pipe" --format stl
kill $! 2> /dev/null # it would wait for a reader for ever
same '--format, a packed file' "$scratch/packed" --format .stl.gz
gzip -cd "$scratch/a.obj.gz" |
    same '--format, standard input' - --format obj --nodes 4
name='formats/--format of other commands'
mv "$scratch/first.$set.npy" "$scratch/first.npy"
# shellcheck disable=SC2016
succeeds "$name" bash -c 'cd "$1" && "$2" convert packed --format STL.gz p.npy &&
    "$2" verify --format stl - first.npy < a.stl &&
    "$2" gen grid 27 -o grid --format las 2> said && exit 1
    grep -q "^incode: --format las: .*allowed: .xyz .txt .pts" said &&
    "$2" gen grid 27 --format ply | head -n 1 | grep -qx ply' \
    - "$scratch" "$(realpath "$INCODE")"
refuses 'formats/--format of no format' 2 \
    '^incode: --format frob: no such format; allowed: .xyz .* .las ' \
    incode run "$scratch/a.stl" --format frob -o "$scratch/left/o.npy"
refuses 'formats/no format is told' 3 'pipe: .*--format' incode run \
    "$scratch/pipe" -q -o "$scratch/left/o.npy"

# VTKHDF, out and in, and by what h5py writes: the library is loaded for it alone.
needs=$(readelf -d "$INCODE" "$BUILD/libincode.so.0" 2>&1)
check 'formats/HDF5 is linked nowhere' "$needs" \
    bash -c '[[ $0 = *libexpat* && $0 = *libm.so* && $0 != *hdf5* ]]' "$needs"
succeeds 'formats/.vtkhdf, written' incode run "$from" -q \
    -o "$scratch/a.vtkhdf" -o "$scratch/a.ele"
wanted=$(incode digest "$scratch/a.ele")
found=$(incode digest "$scratch/a.vtkhdf" 2>&1)
check 'formats/.vtkhdf, read' "$found, not $wanted" \
    [ "$found:${wanted%%:*}" = "$wanted:sha256" ]
succeeds 'formats/.hdf of .ele' incode convert "$scratch/a.ele" "$scratch/b.hdf"
check 'formats/.vtkhdf is one set of bytes' 'they differ' \
    cmp "$scratch/a.vtkhdf" "$scratch/b.hdf"
incode verify --format hdf - "$scratch/a.ele" < "$scratch/b.hdf" \
    > "$scratch/verified" 2>&1
check 'formats/.hdf, standard input' "$(last "$scratch/verified")" \
    grep -q 'the Delaunay triangulation of' "$scratch/verified"
same '.vtkhdf, its points' "$scratch/a.vtkhdf"
gzip -kc "$scratch/a.vtkhdf" > "$scratch/d.vtkhdf.gz"
same '.vtkhdf.gz' "$scratch/d.vtkhdf.gz"
if ! /usr/bin/python3 -c 'import h5py' 2> "$scratch/said"; then
    skip 'formats/VTKHDF of h5py' 'there is no python3-h5py; make deps installs it'
else
    /usr/bin/python3 tests/system/vtkhdf.py "$from" "$scratch"
    for kind in grid parts poly variable; do
        same "VTKHDF of h5py: $kind" "$scratch/$kind.vtkhdf"
    done
    incode convert "$scratch/single.vtkhdf" "$scratch/single.0.xyz"
    incode convert "$scratch/single.npy" "$scratch/single.1.xyz"
    check 'formats/VTKHDF of h5py: single' 'its points are others' \
        cmp "$scratch/single.0.xyz" "$scratch/single.1.xyz"
    found=$(incode digest "$scratch/pair.hdf" 2>&1)
    wanted=$(incode digest "$scratch/pair.ele" 2>&1)
    check 'formats/cells of two partitions' "$found, not $wanted" \
        [ "$found:${wanted%%:*}" = "$wanted:sha256" ]
    while read -r name pattern; do
        refuses "formats/VTKHDF of h5py: $name" 3 "$name.vtkhdf: $pattern" \
            incode run "$scratch/$name.vtkhdf" -q -o "$scratch/left/o.npy"
    done <<-'END'
		version VTKHDF 3.0, where 1.x and 2.x are read;
		image its Type is neither UnstructuredGrid nor PolyData;
		steps it has several time steps;
		none HDF5 without a group VTKHDF
		sum the points of its partitions are not those of Points;
		many more than 2.32 points;
		filter /VTKHDF/Points is packed by filter number 32000,
		empty /VTKHDF/Points claims more numbers than the file holds;
		linked /VTKHDF/Points is missing or cannot be read;
		outside /VTKHDF/Points claims more numbers than the file holds;
		flat /VTKHDF/Points has another shape or type;
	END
    refuses 'formats/no cells in PolyData' 3 'poly.vtkhdf: PolyData, which has' \
        incode digest "$scratch/poly.vtkhdf"
fi

# A library that crashes is an error, and so is one that is not there.
soname=$(strings -a "$INCODE" | grep -m 1 '^libhdf5')
mkdir "$scratch/lib"
breaks='the HDF5 library has crashed on this file .Illegal instruction.'
echo '__attribute__((constructor)) void f(void) { __builtin_trap(); }' |
    gcc -shared -fPIC -x c - -o "$scratch/lib/${soname:-none}"
for what in "$breaks" "needs the HDF5 library, which cannot be loaded .*; install .*hdf5"; do
    refuses "formats/.vtkhdf, in: ${what:0:20}" 3 "a.vtkhdf: .*$what" \
        env LD_LIBRARY_PATH="$scratch/lib" "$INCODE" run "$scratch/a.vtkhdf" -q \
        -o "$scratch/left/o.npy"
    refuses "formats/.vtkhdf, out: ${what:0:20}" 3 "o.vtkhdf: .*$what" \
        env LD_LIBRARY_PATH="$scratch/lib" "$INCODE" run "$from" -q \
        -o "$scratch/left/o.vtkhdf"
    : > "$scratch/lib/${soname:-none}"
done

# What is known and not read, by its extension or by its first bytes.
laz='LAS whose points LASzip has compressed.*; unpack them with laszip'
e57='E57 .ASTM E2807., which is not read; convert it with pdal translate'
{
    head -c 104 "$scratch/a.las" && printf '\x83' && tail -c +106 "$scratch/a.las"
} > "$scratch/marked.las"
printf 'ASTM-E57\1\0\0\0\0\0\0\0' > "$scratch/scans.xyz"
refuses 'formats/.laz' 3 "a.laz: $laz" incode run "$scratch/a.laz" -q \
    -o "$scratch/left/o.npy"
refuses 'formats/.e57' 3 "a.e57: $e57" incode run "$scratch/a.e57" -q \
    -o "$scratch/left/o.npy"
refuses 'formats/compressed, in .las' 3 "marked.las: $laz" incode run \
    "$scratch/marked.las" -q -o "$scratch/left/o.npy"
refuses 'formats/E57, in .xyz' 3 "scans.xyz: $e57" incode convert \
    "$scratch/scans.xyz" "$scratch/left/o.npy"
help=$(incode run --help | tr -s ' \n' ' ')
check 'formats/--help lists them' "$help" \
    grep -qF '.xyz .txt .pts .csv .node .ply .off .obj .stl .las' <<< "$help"
