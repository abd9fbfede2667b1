#!/usr/bin/env bash
# Power that is lost at twenty moments of a transfer to two boards of each kind,
# and to four (tests/boards/power); SEED=N draws the same again.
for board in mps2-an500 mps2-an385 raspi3b icicle; do
    BOARD=$board CUTS=20 bash tests/boards/power
done
CUTS=20 NODES=4 bash tests/boards/power
