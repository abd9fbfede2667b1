#!/usr/bin/env bash
# The first hour with what takes longer: a wire that is given up after the 30 s of
# every cube file, an adapter that is pulled out during a run.
exec bash tests/system/first_hour.sh all
