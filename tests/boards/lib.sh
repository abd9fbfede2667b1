# shellcheck shell=bash
# Boards in an emulator, for tests: a script sources this behind
# tests/system/lib.sh.

said_there=${scratch:?}/console

# The folders of bare boards.
# shellcheck disable=SC2034
mapfile -t bare_boards < <(printf '%s\n' boards/*/board.mk | cut -d / -f 2)

# fact BOARD NAME: what its board.mk says of it, or its facts.h (BOARD_NAME).
fact() {
    case $2 in
        BOARD_*)
            sed -n "s/^#define $2 //p" "boards/$1/facts.h" | tr -d '"'
            ;;
        *)
            MAKEFLAGS='' make -s -f "boards/$1/board.mk" \
                --eval "print: ; @echo '\$($2)'" print
            ;;
    esac
}
has_card() { [ "$(fact "$1" BOARD_FLASH)" = HOST_FLASH_CARD ]; } # BOARD

# make_flash BOARD: $flash, if it is not there: a chip is what the emulator
# makes of a file, a card is made here.
make_flash() {
    if has_card "$1" && [ ! -s "${flash:?}" ]; then
        "$BUILD/tests/chip" "$flash" card - > /dev/null
    fi
}

# command_of BOARD IMAGE: $command, which starts it there with its console as
# standard input and output, and $flash as its flash.
command_of() {
    local machine flash_words=()
    machine=$(fact "$1" BOARD_MACHINE)
    case $(fact "$1" BOARD_FLASH) in
        HOST_FLASH_CHIP)
            machine=$machine,memory-backend=ram
            flash_words=(-object "memory-backend-file,id=ram,size=16M,share=on,\
mem-path=$flash")
            ;;
        HOST_FLASH_CARD) flash_words=(-drive "if=sd,format=raw,file=$flash") ;;
    esac
    command=("$(fact "$1" BOARD_EMULATOR)" -M "$machine" "${flash_words[@]}"
        "$(fact "$1" BOARD_PROGRAM_OPTION)" "$2" -display none -nic none
        -monitor none -serial stdio)
}

# begin BOARD IMAGE: starts it; its console is read and written by the two
# numbers of `wire`, as ${wire[0]} and ${wire[1]}.  $flash: a file, which
# need not be there.  clock: half an hour at most, for one that is left behind.
begin() {
    local command
    make_flash "$1"
    command_of "$1" "$2"
    coproc wire { exec timeout -k 1 1800 "${command[@]}" 2> /dev/null; }
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
