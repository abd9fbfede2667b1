# shellcheck shell=bash
# Boards in an emulator, for tests: a script sources this behind
# tests/system/lib.sh.

said_there=${scratch:?}/console

# fact BOARD NAME: what its board.mk says of it.
fact() {
    MAKEFLAGS='' flash=${flash:-} make -s -f "boards/$1/board.mk" \
        --eval "print: ; @echo '\$($2)'" print
}

# make_flash BOARD: $flash, if it is not there: a chip is what the emulator
# makes of a file, a card is made here.
make_flash() {
    case $(fact "$1" emulator) in
        *if=sd,*)
            [ -s "$flash" ] || "$BUILD/tests/chip" "$flash" card - > /dev/null
            ;;
    esac
}

# begin BOARD IMAGE: starts it; its console is read and written by the two
# numbers of `wire`, as ${wire[0]} and ${wire[1]}.  $flash: a file, which
# need not be there.  clock: half an hour at most, for one that is left behind.
begin() {
    local command
    command=$(fact "$1" emulator)
    make_flash "$1"
    # shellcheck disable=SC2086
    coproc wire { exec timeout -k 1 1800 $command -kernel "$2" -display none \
        -nic none -monitor none -serial stdio 2> /dev/null; }
}
finish() { # as one who pulls the plug
    # shellcheck disable=SC2154
    local pid=$wire_PID
    kill "$pid" 2> /dev/null
    wait "$pid" 2> /dev/null
}

# hear PATTERN: reads lines of the console until one is like it, or clock: none
# comes for five minutes: $line.  What it has read is in $said_there.
hear() {
    : > "$said_there"
    while IFS= read -r -t 300 -u "${wire[0]}" line; do
        line=$(printf '%s' "$line" | tr -d '\0\r\377')
        printf '%s\n' "$line" >> "$said_there"
        # shellcheck disable=SC2053
        [[ $line = $1 ]] && return
    done
    return 1
}
