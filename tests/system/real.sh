#!/usr/bin/env bash
# Surfaces, scans, CAD, stretched grids: the digest of their index on one node
# and, where it takes some seconds and no minutes, the same bytes on 8.
. tests/system/lib.sh
# shellcheck disable=SC2034
INCODE_DATA=$INCODE_REAL folder=INCODE_REAL
need_data real

# The memory of one node, and those of 8.
memories() { # SET
    case $1 in
        buildings_crop) echo 64M ;;
        terrain | torus | bullet) echo 4M 512K ;;
        axial_stage | globe_terrain | sphere_fsaverage5) echo 4M 4M ;;
        *) echo 4M ;;
    esac
}

while read -r set file points _ _ digest; do
    if [ -n "$(no_set "$file" "$points")" ]; then
        skip "real/$set" "$(no_set "$file" "$points")"
        continue
    fi
    read -r one eight < <(memories "$set")
    triangulates "real/$set one node" "$set" "$INCODE_DATA/$file" "$digest" \
        --strategy sequential --nodes 1 --memory "$one"
    [ -z "$eight" ] ||
        triangulates "real/$set 8 nodes" "$set" "$INCODE_DATA/$file" \
            "$digest" --strategy spatial --nodes 8 --memory "$eight"
    rm -f "$scratch/first.$set.npy"
done < <(list_sets)
