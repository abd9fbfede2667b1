# shellcheck shell=bash
# Shared by the scripts of tests/: where things are, and how a result is told.
# Each script sources it from the top of the project.  A test ends in exactly
# one of pass, fail and skip; each prints a line that tests/run counts.

set -u
export LC_ALL=C
BUILD=${BUILD:-build}
INCODE=${INCODE:-$BUILD/incode}
TOOL=${TOOL:-$BUILD/tests/points}
INCODE_DATA=${INCODE_DATA:-../shared/data}
INCODE_REAL=${INCODE_REAL:-../shared/real}
export BUILD INCODE_DATA INCODE_REAL
scratch=$(mktemp -d "${TMPDIR:-/tmp}/incode-test.XXXXXX") || exit 1
trap 'rm -rf "$scratch"' EXIT
trap 'exit 130' INT TERM

# Results go to the script's own output, also from within a redirection: in
# `succeeds NAME COMMAND > FILE` the file gets what the command prints, alone.
exec {results_to}>&1
pass() { printf 'PASS %s\n' "$1" >&"$results_to"; }
fail() { printf 'FAIL %s: %s\n' "$1" "$2" >&"$results_to"; }
skip() { printf 'SKIP %s: %s\n' "$1" "$2" >&"$results_to"; }

# check NAME WHY COMMAND...: passes where the command succeeds.
check() {
    local name=$1 why=$2
    shift 2
    if "$@"; then pass "$name"; else fail "$name" "$why"; fi
}

# exits NAME STATUS COMMAND...: passes where the command ends with this status.
# What it prints on standard error goes to $scratch/errors.  A command whose
# standard error is wanted elsewhere is followed by status=$?, which a check may
# then judge.  No argument may hold $? itself (tests/lint refuses it): behind a
# $(...) in the same command, it is the status of that.
exits() {
    local name=$1 wanted=$2 status
    shift 2
    "$@" 2> "$scratch/errors"
    status=$?
    check "$name" "exit $status, not $wanted: $(last "$scratch/errors")" \
        [ $status = "$wanted" ]
}
succeeds() { exits "$1" 0 "${@:2}"; } # NAME COMMAND...

# The last line of a file, for a failure's reason.
last() { tail -n 1 "$1" 2>/dev/null | tr -d '\r' | cut -c 1-300; }

# --- the real sets: data/INDEX.md; real/INDEX.md for what is hard -------------

# has_data NAME: whether there is an index of real sets; one in which none is
# found is a failure.
has_data() {
    if [ ! -r "$INCODE_DATA/INDEX.md" ]; then
        skip "$1" "there is no $INCODE_DATA/INDEX.md;\
 ${folder:-INCODE_DATA} names its folder"
    elif [ -z "$(list_sets)" ]; then
        fail "$1" "no set is found in $INCODE_DATA/INDEX.md: another layout"
    else
        return 0
    fi
    return 1
}

# need_data NAME: ends the script where there are no real sets.
need_data() { has_data "$1" || exit 0; }

# --- emulated boards ----------------------------------------------------------

# need_boards NAME BOARD: ends the script where there is no emulator or image.
need_boards() {
    local emulator
    emulator=$(sed -n 's/^#define BOARD_EMULATOR "\(.*\)"$/\1/p' \
        "boards/$2/facts.h")
    if ! command -v "$emulator" > /dev/null; then
        skip "$1" "$emulator is not there: make deps"
        exit 0
    fi
    if [ ! -r "$BUILD/firmware/$2.img" ]; then
        skip "$1" "there is no $BUILD/firmware/$2.img: make firmware"
        exit 0
    fi
}

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

# The figure of a run's statistics.  One that is missing is like no other, missing
# or not.
stat_of() { # FILE FIGURE
    local value
    value=$(jq -r ".$2" "$1")
    case $value in
        '' | null) echo "no $2 ($BASHPID $RANDOM)" ;;
        *) echo "$value" ;;
    esac
}

# The program, or a command, ended where it would hang.  clock: after so long that
# no machine is too slow for it.
hang=${SECONDS_MAX:-900}
within() { timeout -k 5 "$hang" "$@"; }
incode() { within "$INCODE" "$@"; }

# The script's program has options for faults from now on: system/testing.c.
with_faults() { INCODE=$INCODE-testing; }

# await COMMAND...: waits until it succeeds.  clock: false after ten minutes, when
# no machine is too slow for it; or where all awaits of the script have tried
# AWAIT_TRIES times together (tests/planted).
await() {
    local end=$((SECONDS + 600))
    until "$@"; do
        [ $SECONDS -lt $end ] && [ "${AWAIT_TRIES:=1000000000}" -gt 0 ] ||
            return 1
        AWAIT_TRIES=$((AWAIT_TRIES - 1))
        sleep 0.01
    done
}

# lets_look PID: who comes to the cube that it has looks on, and does not get in:
# one of its open files is the meeting place of host/watch/look.h.
lets_look() {
    local places
    places=$(awk '/@incode-look-/ { print "socket:[" $7 "]" }' /proc/net/unix)
    [ -n "$places" ] && readlink "/proc/$1/fd/"* 2> /dev/null |
        grep -qFx "$places"
}

# What needs no waiting is told long before a node's patience is over.  clock: with
# this patience, however slow the machine is.
# shellcheck disable=SC2034
patient='--patience 900' soon=600

# amid STEPS [OPTION...]: `slowed SECONDS OPTION...` of the script begins a run,
# $host, whose host reads slowly for so long, and STEPS are taken, which are true
# where it was at work still.  clock: on a machine that holds this script up, again
# with a longer run.
# shellcheck disable=SC2154
amid() {
    local steps=$1 seconds
    shift
    for seconds in ${at_first:-} 3 10 30 100 300; do
        slowed "$seconds" "$@"
        eval "$steps" && kill -0 "$host" 2> /dev/null && return
        wait "$host"
    done
    return 1
}

# Whether $host's --progress on $scratch/errors shows tetrahedra: all nodes are at
# work.  Or whether it has ended.
shows_work() {
    grep -q 'triangulating *[1-9]' "$scratch/errors" ||
        ! kill -0 "$host" 2> /dev/null
}

# Whether there are pseudo-terminals here; if not, NAME is skipped.
has_terminals() {
    grep -q ' /dev/pts devpts ' /proc/mounts && return
    skip "$1" 'there are no pseudo-terminals here: no /dev/pts'
    return 1
}

# Takes ports $base .. $base + 499 of this machine, in which nobody listens; no
# other script takes them before all that was started here has ended.
take_ports() {
    local lock port taken
    for base in $(seq 10000 500 29500 | shuf); do
        { exec {lock}>> "/tmp/incode-test-ports.$base"; } 2> /dev/null ||
            continue
        taken=$(cat /proc/net/tcp /proc/net/tcp6 2> /dev/null |
            sed -n 's/^ *[0-9]*: [0-9A-F]*:\([0-9A-F]*\) .*/\1/p' |
            while read -r port; do
                [ $((16#$port / 500 * 500)) = "$base" ] && echo "$port"
            done)
        [ -z "$taken" ] && flock -n "$lock" && return
        exec {lock}>&-
    done
    fail "$(basename "$0" .sh)" 'no range of ports is free'
    exit 1
}

# --- runs ----------------------------------------------------------------------

# Whether a run stopped because its memory is below what its index states.
needs_memory() { grep -q 'needs at least' "$1"; }

# triangulates NAME SET FILE DIGEST [OPTION...]: the run's digest is the one
# given, and its output the same, byte for byte, as that of SET's first run
# here.  `grid` and `naive`, which state what memory they need, get as much.
triangulates() {
    local name=$1 set=$2 file=$3 digest=$4 out=$scratch/out.npy
    local stats=$scratch/stats.json errors=$scratch/errors found status
    local first=$scratch/first.$set.npy
    shift 4
    rm -f "$out" "$stats"
    incode run "$file" -q --stats "$stats" -o "$out" "$@" 2> "$errors"
    status=$?
    if [ $status = 2 ] && needs_memory "$errors" &&
        [[ " $* " =~ ' --index '(grid|naive)' ' ]]; then
        local need
        need=$(sed -n 's/.*needs at least \([0-9]*[KMG]*\).*/\1/p' "$errors")
        incode run "$file" -q --stats "$stats" -o "$out" "$@" \
            --memory "$need" 2> "$errors"
        status=$?
    fi
    if [ $status != 0 ]; then
        fail "$name" "exit $status: $(last "$errors")"
        return
    fi
    found=$(stat_of "$stats" digest)
    if [ "$found" != "sha256:$digest" ]; then
        fail "$name" "digest $found, not $digest"
    elif [ "$(stat_of "$stats" checks_failed)" != 0 ]; then
        fail "$name" "right only when done again: $(last "$errors")"
    elif [ ! -f "$first" ]; then
        mv "$out" "$first"
        pass "$name"
    else
        check "$name" "the output differs from the set's first" \
            cmp -s "$first" "$out"
    fi
}

# refuses NAME STATUS PATTERN COMMAND...: the command ends with that status and
# one line on standard error, `incode: WHERE: WHAT; WHAT TO DO NEXT` as the
# pattern has it, and leaves nothing in the directory $scratch/left.
refuses() {
    local name=$1 expected=$2 pattern=$3 errors=$scratch/errors status
    shift 3
    rm -rf "$scratch/left"
    mkdir "$scratch/left"
    "$@" > "$scratch/output" 2> "$errors"
    status=$?
    if [ $status != "$expected" ]; then
        fail "$name" "exit $status, not $expected: $(last "$errors")"
    elif [ "$(wc -l < "$errors")" != 1 ]; then
        fail "$name" "$(wc -l < "$errors") lines, not one: $(last "$errors")"
    elif ! grep -qE "^incode: ..*: ..*; " "$errors"; then
        fail "$name" "not WHERE: WHAT; NEXT: $(last "$errors")"
    elif ! grep -qE -e "$pattern" "$errors"; then
        fail "$name" "no '$pattern' in: $(last "$errors")"
    elif [ -n "$(ls -A "$scratch/left")" ]; then
        fail "$name" "it left $(ls -A "$scratch/left" | tr '\n' ' ')"
    else
        pass "$name"
    fi
}

# fault_table FILE: of what a simulation said, its table of the kinds of fault
# without the heading: the name, strikes, and seeds in which it struck.
fault_table() { sed '1,/^fault /d' "$1"; }

# no_set FILE POINTS: why a set of the index is not used here, or nothing.
no_set() {
    if [ ! -r "$INCODE_DATA/$1" ]; then
        echo "there is no $INCODE_DATA/$1"
    elif [ "$2" -gt "${POINTS_MAX:-1000000000}" ]; then
        echo "$2 points; ${POINTS_WHY:-} no more than $POINTS_MAX"
    fi
}
