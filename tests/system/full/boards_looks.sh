#!/usr/bin/env bash
# What looks at the links are held to, on everything that is hard.
exec bash tests/system/boards_looks.sh all
