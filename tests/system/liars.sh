#!/usr/bin/env bash
# A node of the cube lies (tests/system/liar): about what it has found, about a
# page that it sends to another node, or about what it lends, in each strategy in
# which it can.  The result is right, or the run ends with 5, names that node and
# leaves no output.  And it floods the host, which stays small.
# LIARS=wide: more seeds, rates and points, and real sets, for make test-full.
. tests/system/lib.sh
wide=${LIARS:-}
lying=$scratch/incode-node
host_peak_max=100000000 # bytes of a host that is flooded,
memory_max_kb=1000000   # and of its address space, threads and all

cp "$BUILD/tests/incode-node-liar" "$lying" || exit 1

# points NAME FILE: from now on the runs are of these.
points() {
    set=$1 points=$2
    incode run "$points" -q --nodes 1 --stats "$scratch/right.json" \
        2> "$scratch/errors" || fail "liars/$set" "$(last "$scratch/errors")"
    digest=$(stat_of "$scratch/right.json" digest)
}

# run_with ORDERS OPTION...: $status, $lies and $said of a run in which a node
# lies as ordered (liar.c).
run_with() {
    echo "$1" > "$lying.lie"
    shift
    rm -f "$lying.told" "$scratch/stats.json" "$scratch/out.npy"
    (
        ulimit -v "${limit:-unlimited}"
        incode run "$points" -q --node-program "$lying" \
            --stats "$scratch/stats.json" -o "$scratch/out.npy" "$@"
    ) 2> "$scratch/errors"
    status=$?
    lies=$(awk '{ n += $2 } END { print n + 0 }' "$lying.told" 2> /dev/null)
    lies=${lies:-0} said=$(last "$scratch/errors")
}

# wrong NODE: why what that run said was wrong, or nothing.
wrong() {
    local found
    case $status in
        0)
            found=$(stat_of "$scratch/stats.json" digest)
            [ "$found" = "$digest" ] || echo "a wrong result: $found"
            [ -s "$scratch/out.npy" ] || echo 'no output'
            ;;
        5)
            grep -qE "node $1([^0-9]|\$)" "$scratch/errors" ||
                echo "node $1 is not named: $said"
            [ ! -e "$scratch/out.npy" ] || echo 'it left an output'
            ;;
        *) echo "exit $status: $said" ;;
    esac
    grep -E '^incode: node [0-9]+.*; it is excluded' "$scratch/errors" |
        grep -vE "^incode: node $1([^0-9]|\$)" |
        sed 's/^/a node that does not lie is blamed: /'
}

# lies NODE WAY ONE-IN OPTION...: with --verify and without; one lie at least is
# told in the two, unless they are to be few.
lies() {
    local node=$1 way=$2 one_in=$3 name verify seed told=0 why
    shift 3
    for seed in 1 ${wide:+2 3}; do
        for verify in '' --verify; do
            name="liars/$set, $* $verify, node $node: $way, 1 in $one_in"
            name="$name${wide:+, seed $seed}"
            # shellcheck disable=SC2086
            run_with "$node $way $one_in $seed" --strategy "$@" $verify
            why=$(wrong "$node" | head -n 1)
            told=$((told + lies))
            check "$name" "$why ($lies lies)" [ -z "$why" ]
        done
    done
    [ "$few" = few ] || check "liars/$set, $*, node $node: $way is told" \
        'no lie was told' [ "$told" -gt 0 ]
}

# Who can lie, about what: NODE WAYS OPTIONS.  Node 0 is the worker, or a
# manager; the results of a builder are answers to it.
found='drop exchange repeat invent'
cases="
0 $found        : sequential --nodes 4
2 page          : sequential --nodes 4 --memory 512K
1 $found        : spatial --nodes 4 --build faces
3 $found        : spatial --nodes 8 --build points
0 $found loan   : master-slaves --nodes 4
2 $found        : master-slaves --nodes 8
0 $found loan   : linda --nodes 4
3 $found        : linda --nodes 8
1 $found        : linda --linda spatial --nodes 4
0 $found loan   : hybrid --nodes 4 --cluster 2
5 $found        : hybrid --nodes 8 --cluster 4
1 $found loan : exchange --nodes 4
6 $found loan : exchange --nodes 8"

# all ONE-IN [few]: pages are few, and so are the faces of the hull, about which
# builders invent.
all() {
    local node ways options way one_in
    few=${2:-}
    while read -r node ways; do
        options=${ways#*: } ways=${ways%%:*}
        for way in $ways; do
            one_in=$1
            [ "$way" = page ] && one_in=1
            [ "$way" = invent ] && one_in=$((($1 + 4) / 5))
            # shellcheck disable=SC2086
            lies "$node" "$way" "$one_in" $options
        done
    done < <(echo "$cases" | grep .)
}

# floods WAY OPTION...: the host's memory has a bound, and node 1 is named.
floods() {
    local way=$1 peak=0 why limit=$memory_max_kb
    shift
    run_with "1 $way 20 1" --strategy "$@"
    why=$(wrong 1 | head -n 1)
    check "liars/$way, $*" "$why ($lies lies)" [ -z "$why" ]
    check "liars/$way, $*: it came" "$lies lies" [ "$lies" -gt 1000 ]
    check "liars/$way, $*: node 1 is named" "$said" \
        grep -qE 'node 1([^0-9]|$)' "$scratch/errors"
    [ $status = 0 ] && peak=$(stat_of "$scratch/stats.json" host_peak_bytes)
    check "liars/$way, $*: the host stays small" "$peak bytes" \
        [ "$peak" -lt $host_peak_max ]
}

incode gen uniform 2000 --seed 3 -o "$scratch/uniform.npy" 2> /dev/null
points uniform "$scratch/uniform.npy"
all 40
for way in flood spill-flood; do
    floods $way spatial --nodes 4 --build faces
    floods $way linda --linda spatial --nodes 4 --build points
    floods $way exchange --nodes 4
done

# Where not all pages go to all nodes, those of an exchange send them.
incode gen uniform 12000 --seed 3 -o "$scratch/larger.npy" 2> /dev/null
points larger "$scratch/larger.npy"
few=
lies 1 page 1 exchange --nodes 4 --memory 640K
[ -n "$wide" ] || exit 0

all 3
all 300 few
need_data liars
while read -r name file count _ tetrahedra _; do
    if [ "$tetrahedra" != 0 ] && [ "$count" -ge 1000 ] &&
        [ "$count" -le 5000 ] && [ -r "$INCODE_DATA/$file" ]; then
        points "$name" "$INCODE_DATA/$file"
        all 40
    fi
done < <(list_sets)
