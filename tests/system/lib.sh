# Shared by the scripts of tests/: where things are, and how a result is told.
# Each script sources it from the top of the project.  A test ends in exactly
# one of pass, fail and skip; each prints a line that tests/run counts.

set -u
export LC_ALL=C
BUILD=${BUILD:-build}
INCODE=${INCODE:-$BUILD/incode}
TOOL=${TOOL:-$BUILD/tests/points}
INCODE_DATA=${INCODE_DATA:-../shared/data}
export BUILD INCODE_DATA
scratch=$(mktemp -d "${TMPDIR:-/tmp}/incode-test.XXXXXX") || exit 1
trap 'rm -rf "$scratch"' EXIT
trap 'exit 130' INT TERM

pass() { printf 'PASS %s\n' "$1"; }
fail() { printf 'FAIL %s: %s\n' "$1" "$2"; }
skip() { printf 'SKIP %s: %s\n' "$1" "$2"; }

# check NAME WHY COMMAND...: passes where the command succeeds.
check() {
    local name=$1 why=$2
    shift 2
    if "$@"; then pass "$name"; else fail "$name" "$why"; fi
}

# The last line of a file, for a failure's reason.
last() { tail -n 1 "$1" 2>/dev/null | tr -d '\r' | cut -c 1-300; }

# --- the real sets: data/INDEX.md --------------------------------------------

# "name file points distinct tetrahedra digest" for each set of the index.
list_sets() {
    awk -F'|' '
        /^\| [a-zA-Z0-9_]+\.xyz/ {
            gsub(/ /, "", $2); gsub(/ /, "", $3); gsub(/ /, "", $4)
            gsub(/ /, "", $5)
            name = $2; sub(/\.xyz.*/, "", name)
            order[++n] = name; file[name] = $2; points[name] = $3
            distinct[name] = $4; tetrahedra[name] = $5
        }
        /^[0-9a-f]+ [ ]*[a-zA-Z0-9_]+$/ {
            split($0, part, / +/); digest[part[2]] = part[1]
        }
        END {
            for (i = 1; i <= n; i++) {
                s = order[i]
                print s, file[s], points[s], distinct[s], tetrahedra[s], \
                    digest[s]
            }
        }' "$INCODE_DATA/INDEX.md"
}

# A failed run may say more than its last line; the stat of a run by its name.
stat_of() { jq -r ".$2" "$1"; }
