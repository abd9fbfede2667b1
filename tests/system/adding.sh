#!/usr/bin/env bash
# A format and a board are a file and a row, a bare board is a folder: in a copy
# of the tree each is added so, and it is read, written, listed and run on.  What is built
# already is copied with the sources, so that little is built again.
. tests/system/lib.sh

if grep -q fsanitize "$BUILD/flags"; then
    skip adding 'a copy of a sanitizer build is not built on'
    exit 0
fi
tree=$scratch/tree
mkdir -p "$tree/build"
cp -a Makefile boards host incode node transport "$tree"
mkdir -p "$tree/tests/arithmetic"
cp -a tests/*.mk "$tree/tests"
cp -a tests/arithmetic/*.mk "$tree/tests/arithmetic"
cp -a "$BUILD/flags" "$BUILD/commit" "$BUILD/obj" "$BUILD"/*.a \
    "$BUILD/node" "$BUILD/include" "$tree/build"

cat > "$tree/host/formats/toy.c" <<'END'
/* A count, then as many rows; tetrahedra in the same way, with a sibling that
 * holds their points. */
#include "format.h"
#include "rows.h"
#include "scan.h"

static int read_points(const struct host_source *source, struct host_mesh *mesh,
                       struct host_error *error)
{
    struct host_scan s =
        host_scan_start(source->path, source->data, source->bytes);
    uint64_t count = 0;
    host_scan_unsigned(&s, UINT32_MAX, &count, error);
    for (; error->code == 0 && count > 0; count--) {
        double xyz[3];
        for (int d = 0; d < 3; d++) {
            if (host_scan_double_anywhere(&s, &xyz[d], error) != 0) {
                return error->code;
            }
        }
        host_points_append(mesh->points, xyz, 1, error);
    }
    return error->code;
}

static int read_tetrahedra(const struct host_source *source,
                           struct host_mesh *mesh, struct host_error *error)
{
    struct host_scan s =
        host_scan_start(source->path, source->data, source->bytes);
    uint64_t count = 0, v[4];
    host_scan_unsigned(&s, UINT32_MAX, &count, error);
    for (; error->code == 0 && count > 0; count--) {
        for (int k = 0; k < 4; k++) {
            if (host_scan_unsigned(&s, UINT32_MAX, &v[k], error) != 0) {
                return error->code;
            }
        }
        host_take_element(mesh, v, 0, source, &s, error);
    }
    return error->code;
}

static void write_points(struct host_output *out,
                         const struct host_points *points)
{
    host_put_line(out, "", points->count, "\n");
    host_put_points(out, points, " ", false);
}

static int write_tetrahedra(struct host_output *out, struct host_output *beside,
                            const struct host_points *points,
                            const struct host_tetrahedra *tets,
                            struct host_error *error)
{
    write_points(beside, points);
    host_put_line(out, "", tets->count, "\n");
    for (uint64_t i = 0; i < tets->count; i++) {
        host_put_row(out, tets->v[i], 4, 0);
        host_output_text(out, "\n");
    }
    return error->code;
}

const struct host_format host_format_toy = {
    .name = "a toy",
    .extensions = {".toy"},
    .read_points = read_points,
    .read_tetrahedra = read_tetrahedra,
    .write_points = write_points,
    .write_tetrahedra = write_tetrahedra,
    .beside = {".toypoints"},
    .rows_only = true,
};

const struct host_format host_format_toypoints = {
    .name = "points of a toy",
    .extensions = {".toypoints"},
    .read_points = read_points,
    .write_points = write_points,
};
END
# The board: a process, as on Linux, under its own name.
mkdir "$tree/boards/toy"
for file in boards/linux/*.c; do
    printf '#include "%s"\n' "$file" > "$tree/boards/toy/${file##*/}"
done
sed 's/(text, "linux")/(text, "toy")/; s,#include "options.h",#include "boards/linux/options.h",
    s,#include "fault.h",#include "boards/linux/fault.h",' \
    boards/linux/options.c > "$tree/boards/toy/options.c"
cat > "$tree/host/nodes/board_toy.c" <<'END'
/* Processes of a program of their own, incode-node-toy. */
#include "boards.h"

static int start(const struct host_board *board,
                 const struct host_cluster_options *options,
                 struct host_started *started, struct host_error *error)
{
    static struct host_cluster cluster;
    static char program[4096];
    struct host_cluster_options mine = *options;
    if (host_cluster_program(options->program, board->program, program,
                             sizeof program, error) != 0) {
        return error->code;
    }
    mine.program = program;
    if (host_cluster_start(&cluster, &mine, error) != 0) {
        return error->code;
    }
    started->machine = host_cluster_machine(&cluster);
    return 0;
}

const struct host_board host_board_toy = {
    .name = "toy",
    .help = "processes of a toy",
    .program = "incode-node-toy",
    .start = start,
};
END
# Two bare boards, which are folders and nothing else: a copy of raspi3b under
# another name throughout, and one of mps2-an385 without loader and flash.
copy() { # OF NAME: its symbols as well
    cp -a "boards/$1" "$tree/boards/$2"
    sed -i "s/$1/$2/g" "$tree/boards/$2"/*
    sed -i "s/\(BOARD_MACHINE\) .*/\1 \"$1\"/" "$tree/boards/$2/facts.h"
}
copy raspi3b newpi
copy mps2-an385 plain
sed -i '/^image_at/d' "$tree/boards/plain/board.mk"
sed -i 's/^\(#define BOARD_FLASH\) .*/\1 HOST_FLASH_NONE/' \
    "$tree/boards/plain/facts.h"
sed -i '/^static const struct loader_flash/d
    s/\.flash = [^,]*,/.flash = NULL,/; s/\.image_at = [^,]*,/.image_at = 0,/
    s/\.image_bytes =$/.image_bytes = 0};/; /^ *(4u << 20) - (64u/d' \
    "$tree/boards/plain/board.c"
# The fuzzer of points, which takes its formats from the table.
mkdir -p "$tree/tests/unit"
cp -a tests/fuzz "$tree/tests"
cat > "$tree/tests/unit/test_fuzzed.c" <<'END'
#include "tests/fuzz/fuzz_points.c"

int main(void)
{
    for (unsigned choice = 0; choice < 256; choice++) {
        char name[FILE_NAME_MAX];
        uint8_t bytes[] = "?1 0 0 0\n";
        bytes[0] = (uint8_t)choice;
        file_name(HOST_READ_POINTS, choice, name);
        puts(name);
        LLVMFuzzerTestOneInput(bytes, sizeof bytes - 1);
    }
    return 0;
}
END
sed -i 's/ROW(plot3d)$/ROW(plot3d) ROW(toy) ROW(toypoints)/' "$tree/host/formats/formats.c"
sed -i 's/ROW(linux)/ROW(linux) ROW(toy)/' "$tree/host/nodes/boards.c"

# The flags of what is copied, whatever they were: only what has changed is
# built, and without optimisation.
if ! "${MAKE:-make}" -C "$tree" --no-print-directory -o build/flags \
    BUILD=build OPT=-O0 ARCH=native build/incode build/incode-node-toy \
    build/tests/test_fuzzed \
    > "$scratch/log" 2>&1; then
    fail adding/build "$(grep -m 1 error "$scratch/log")"
    exit 1
fi
check adding/build 'a warning' \
    [ "$(grep -cE '\.c:[0-9:]+ warning' "$scratch/log")" = 0 ]

old=$INCODE new=$tree/build/incode
"$old" gen uniform 500 -o "$scratch/a.xyz"

# says NAME PATTERN COMMAND...: on standard output or error, line ends apart.
says() {
    local name=$1 pattern=$2
    shift 2
    "$@" < /dev/null 2>&1 | tr -s ' \n' ' ' > "$scratch/said"
    check "$name" "$(last "$scratch/said")" grep -qF -e "$pattern" \
        "$scratch/said"
}

says adding/format/help '(PLOT3D), .toy (a toy), .toypoints (points of a toy);' "$new" run --help
says adding/format/help-out '.toy (a toy; with .toypoints beside it);' \
    "$new" run --help
says adding/format/points-in '.bin .toy .toypoints, or any' "$new" run "$scratch/a.pdf"
says adding/format/points-out '.npy .toy .toypoints, or -' \
    "$new" convert "$scratch/a.xyz" "$scratch/a.pdf"
says adding/format/tetrahedra-in '.npy .toy, or any' \
    "$new" digest "$scratch/a.pdf"
says adding/format/tetrahedra-out '.npy .toy, or -' \
    "$new" run "$scratch/a.xyz" -o "$scratch/a.pdf"

succeeds adding/format/write-points \
    "$new" convert "$scratch/a.xyz" "$scratch/a.toy"
succeeds adding/format/read-points \
    "$new" convert "$scratch/a.toy" "$scratch/b.xyz"
check adding/format/same-points 'other bytes' \
    cmp -s "$scratch/a.xyz" "$scratch/b.xyz"

succeeds adding/board/run "$new" run "$scratch/a.toy" -q --board toy --nodes 2 \
    --stats "$scratch/toy.json" -o "$scratch/t.toy"
succeeds adding/format/other "$old" run "$scratch/a.xyz" -q \
    --stats "$scratch/linux.json" -o "$scratch/t.ele"
check adding/format/beside 'other points' \
    cmp -s "$scratch/a.toy" "$scratch/t.toypoints"
check adding/format/digest 'another triangulation' test \
    "$("$new" digest "$scratch/t.toy")" = "$("$old" digest "$scratch/t.ele")"

"$tree/build/tests/test_fuzzed" > "$scratch/fuzzed" 2>&1
status=$?
check adding/format/fuzzed "$(last "$scratch/fuzzed")" [ $status = 0 ]
for name in a.toy a.toy.gz; do
    check "adding/format/fuzzed-$name" 'the fuzzer does not try it' \
        grep -qx "$name" "$scratch/fuzzed"
done
succeeds adding/format/convert "$new" convert "$scratch/t.toy" "$scratch/t.vtu"
succeeds adding/format/convert-other \
    "$old" convert "$scratch/t.ele" "$scratch/other.vtu"
check adding/format/points-beside 'other bytes' \
    cmp -s "$scratch/t.vtu" "$scratch/other.vtu"
gzip "$scratch/a.toy" "$scratch/t.toypoints"
succeeds adding/format/packed \
    "$new" convert "$scratch/a.toy.gz" "$scratch/c.xyz"
check adding/format/same-packed 'other bytes' \
    cmp -s "$scratch/a.xyz" "$scratch/c.xyz"
succeeds adding/format/packed-beside \
    "$new" convert "$scratch/t.toy" "$scratch/t.vtk"

says adding/board/help 'linux (processes of this machine; the default), toy' \
    "$new" run --help
says adding/board/message 'allowed: linux, toy' \
    "$new" run "$scratch/a.xyz" --board z80
check adding/board/statistics 'another board' \
    [ "$(stat_of "$scratch/toy.json" board)" = toy ]
printf 'dimension = 0; board = "z80"; links = ();' > "$scratch/z80.cube"
says adding/board/cube-file '"linux" or "toy"' "$new" cube "$scratch/z80.cube"
printf '%s\n' 'dimension = 0; board = "toy"; start = [0];' \
    'links = ({ node = 0; to = "host"; unix = "toy.socket"; });' \
    > "$scratch/toy.cube"
says adding/board/cube-line 'incode-node-toy --node 0' \
    "$new" cube "$scratch/toy.cube"
succeeds adding/board/on-a-cube \
    "$new" run "$scratch/a.xyz" -q --cube "$scratch/toy.cube" \
    -o "$scratch/cube.ele"
rm "$tree/build/incode-node-toy"
says adding/board/its-program 'incode-node-toy: No such file' \
    "$new" run "$scratch/a.xyz" --board toy

# --- a bare board -------------------------------------------------------------

need_boards adding/bare raspi3b
need_boards adding/bare mps2-an385
cp -a "$BUILD/source" "$BUILD/libsodium" "$tree/build"
mkdir -p "$tree/build/firmware" "$tree/build/tests" "$tree/tests/system"
cp -a "$BUILD"/firmware/*.sign* "$tree/build/firmware"
cp -a "$BUILD/tests/chip" "$tree/build/tests"
cp -a tests/boards tests/stack tests/stack.* "$tree/tests"
cp -a tests/system/lib.sh "$tree/tests/system"
bare() { # TARGET...
    "${MAKE:-make}" -C "$tree" --no-print-directory -j2 -o build/flags \
        -o build/incode BUILD=build OPT=-O0 ARCH=native BARE_OPT=-Os "$@" \
        > "$scratch/log" 2>&1
}
if ! bare build/firmware/newpi.img build/firmware/loader/newpi.img \
    build/firmware/plain.img build/firmware/tests/newpi-trial.img; then
    fail adding/bare/build "$(grep -m 1 -E 'error|\*\*\*' "$scratch/log")"
    exit 1
fi
pass adding/bare/build
"$old" gen uniform 200 --seed 1 -o "$scratch/few.npy" 2> /dev/null
"$old" run "$scratch/few.npy" -q --nodes 1 --stats "$scratch/native.json"
for board in newpi plain; do
    says "adding/bare/$board: help" "$board (emulated: " "$new" run --help
    says "adding/bare/$board: emulate" "$board" "$new" emulate --help
    # shellcheck disable=SC2086
    succeeds "adding/bare/$board: a run" within "$new" run "$scratch/few.npy" \
        -q --board $board --nodes 2 $patient --stats "$scratch/$board.json"
    check "adding/bare/$board: the digest" 'another triangulation' \
        [ "$(stat_of "$scratch/$board.json" digest)" = \
        "$(stat_of "$scratch/native.json" digest)" ]
    (cd "$tree" && BUILD=build bash tests/stack $board) > "$scratch/said" 2>&1
    status=$?
    check "adding/bare/$board: its stack" "$(head -n 1 "$scratch/said")" \
        [ $status = 0 ]
done
(cd "$tree" && BUILD=build BOARDS=newpi bash tests/boards/trial) \
    > "$scratch/said" 2>&1
check 'adding/bare/newpi: its trial' "$(grep -m 1 FAIL "$scratch/said")" \
    [ "$(grep -c '^PASS' "$scratch/said").$(grep -c '^FAIL' \
        "$scratch/said")" = 22.0 ]

# A section that start.ld does not name is an error, and not memory that nobody
# fills.
printf '%s\n' '.section .nobodys, "aw"' '.global newpi_nobodys' \
    'newpi_nobodys:' '.word 1' > "$tree/boards/newpi/nobodys.S"
sed -i 's/^void board_start(void) {/extern int newpi_nobodys;\n&\n    newpi_nobodys++;/' \
    "$tree/boards/newpi/board.c"
bare build/firmware/newpi.elf
status=$?
check 'adding/bare/a section that nobody names' "exit $status" [ $status != 0 ]
check 'adding/bare/a section that nobody names: which' "$(last "$scratch/log")" \
    grep -q "orphan section \`.nobodys'" "$scratch/log"
