#!/usr/bin/env bash
# The Python package, by the tests of tests/python: it equals scipy on points in
# general position, and the digests of real sets; every kind of array; errors,
# interrupts, threads, memory; find_simplex by exact integers; files; the examples
# of its page.
. tests/system/lib.sh
python=${PYTHON:-/usr/bin/python3}
if [ ! -e "$BUILD/python/incode/__init__.py" ]; then
    skip python "there is no $BUILD/python/incode: make python"
    exit 0
fi
if has_data python/digest; then
    while read -r set file points _ tetrahedra digest; do
        [ -r "$INCODE_DATA/$file" ] && [ "$points" -le "${POINTS_MAX:-50000}" ] &&
            echo "$set $(realpath "$INCODE_DATA/$file") $points $tetrahedra $digest"
    done < <(list_sets) > "$scratch/sets"
    [ -s "$scratch/sets" ] || fail python/digest 'no set of the index is there'
    export INCODE_SETS=$scratch/sets
fi
: > "$scratch/results"
PYTHONPATH=$(realpath "$BUILD/python") INCODE_PROGRAM=$(realpath -s "$INCODE") \
    INCODE_RESULTS=$scratch/results PYTHONDONTWRITEBYTECODE=1 \
    within "$python" -m pytest -q -p no:cacheprovider --tb=short \
    --basetemp "$scratch/pytest" tests/python > "$scratch/said" 2>&1
status=$?
cat "$scratch/results"
check 'python/all tests' "exit $status: $(grep -m 1 Error "$scratch/said")" \
    [ $status = 0 ]
[ $status = 0 ] || tail -n 100 "$scratch/said"
