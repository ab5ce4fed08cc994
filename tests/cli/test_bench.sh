#!/usr/bin/env bash
# diaphan bench bake: every row that the contract names, with figures that can be.
. "$(dirname "$0")/lib.sh"

expect 0 bench bake box.obj --seconds 0.01 --directions 64 --threads 2 --json
field '(.cpu | length) > 0 and (.results | length) == 8'
field '[.results[] | .model, .engine, .thickness] | all(length > 0)'
field '[.results[] | .pairs_per_second, .seconds] | all(. > 0)'
field '.results | map(select(.engine == "sweep" and .thickness == "inside" and .threads == 2)) | length == 1'
field '.results | map(select(.engine == "embree" and .thickness == "first" and .threads == 1)) | length == 1'
field '[.results[] | .triangles == 12 and .positions == 8 and .directions == 64] | all'
expect 0 bench bake box.obj --seconds 0.01 --directions 64
grep -q ratio stdout || fail "no ratio in the table"
expect 0 bench bake --scale 1000,4000 --directions 64 --json
field '.results | length == 2 and all(.[]; .peak_bytes > 0 and .seconds > 0)'
field '.results[1].triangles / .results[0].triangles | . > 3.5 and . < 4.5'
refuse 2 missing.obj bench bake missing.obj
finish
