#!/usr/bin/env bash
# diaphan bench draw: every row of the matrix with every field of the contract, and figures that can be. No speed is asserted.
. "$(dirname "$0")/lib.sh"

refuse 1 'bake, draw' bench paint
refuse 1 'writes no files' bench bake -o somewhere
refuse 1 'lights' bench draw box.obj --lights 1,17
refuse 1 'lights' bench draw box.obj --lights 1,
refuse 1 'none of' bench draw box.obj --methods shsss,reference
refuse 2 missing.obj bench draw missing.obj

tiny="--seconds 0.01 --directions 64"
"$diaphan" bench draw box.obj $tiny --resolution 32x20 --json >stdout 2>stderr
code=$?
if [ $code = 3 ]; then
    echo "skipped: $(cat stderr)"
    [ "$failures" = 0 ] || exit 1
    exit 77
fi
[ $code = 0 ] || fail "exit code $code: $(cat stderr)"
field '(.renderer | length) > 0 and .model == "box.obj" and .vertices == 24 and .samples == 1'
# two arrangements, two cameras; 8 other methods, one in two settings, one in five forms, shsss with 6 numbers of bands in 3 types
field '[.results[] | select(.method != "shsss")] | length == 4 * 12'
field '[.results[] | select(.method == "response") | [.form, .bands]] | unique | length == 5'
field '[.results[] | select(.method == "response" and .bands == 4) | .bytes_per_vertex == 16 and .passes == 1] | all'
field '[.results[] | select(.method == "shsss" and .use_bands != "auto")] | length == 4 * 18'
field '[.results[] | select(.use_bands == "auto")] | length == 4'
field '[.results[] | [.width, .height]] | unique == [[32, 20]]'
field '[.results[] | [.indexed, .camera]] | unique | length == 4'
field '[.results[] | select(.method == "prt-cpca") | [.clusters, .vectors]] | unique | length == 2'
field '[.results[] | select(.method == "lambert") | .ratio_to_lambert == 1 and .bytes_per_vertex == 0 and .store == null] | all'
field '[.results[] | .ms_p05 > 0 and .ms_p05 <= .ms_median and .ms_median <= .ms_p95] | all'
field '[.results[] | .frames >= 24 and .cpu_ms > 0 and .fps > 0 and .ratio_to_lambert > 0 and .lights == 1] | all'
field '[.results[] | .clock == "gpu" or .clock == "finish"] | all'
field '[.results[] | has("bands") and has("store") and has("passes") and has("table_bytes")] | all'
field '[.results[] | select(.method == "shsss" and .bands == 6 and .store == "snorm8" and .use_bands == 6) | .bytes_per_vertex == 36 and .passes == 1] | all'
field '[.results[] | select(.method == "shsss" and .bands == 2 and .store == "float") | .bytes_per_vertex == 16] | all'
field '[.results[] | select(.method == "green") | .passes == 2 and .table_bytes > 0] | all'
field '[.results[] | select(.indexed | not) | .vertices == 36] | all'
field '[.results[] | select(.indexed) | .vertices == 24] | all'

expect 0 bench draw box.obj $tiny --methods shsss,green --use-bands 6 --lights 1,3 --resolution 16x16 --repeat-mesh 4 --json
field '[.results[] | .lights] | unique == [1, 3]'
field '[.results[] | .method] | unique == ["green", "lambert", "shsss"]'
field '[.results[] | .store] | unique == [null, "snorm8"]'
field '[.results[] | select(.method == "green" and .lights == 3) | .passes == 4] | all'
field '[.results[] | select(.indexed) | .vertices == 96] | all'

expect 0 bench draw box.obj $tiny --methods patro --resolution 16x16 --camera 0,15,3.5
grep -q 'given' stdout || fail 'the camera is not that of --camera'
grep -q 'x lambert' stdout || fail "no ratio in the table"

# the folder: two charts in two formats, a report that names the command, the figures
expect 0 bench draw box.obj $tiny --methods shsss,prt-cpca --resolution 24x15 -o out -q --json
cp stdout printed
for file in chart.svg chart.png lights.svg lights.png report.md results.json; do
    [ -s "out/$file" ] || fail "no $file"
done
cmp -s printed out/results.json || fail "results.json is not what is printed"
field '[.results[] | .lights] | unique == [1, 2, 4, 8, 16]'
field '[.results[] | select(.indexed | not) | .ratio_to_unshared_lambert == .ratio_to_lambert] | all'
grep -q 'diaphan bench draw box.obj .*-o out' out/report.md || fail "the report does not name the command"
grep -q 'commit ' out/report.md || fail "the report does not name the commit"
grep -qE '^\| shsss, 36 snorm8 \| 36 \| 0 \| 1 \| [0-9.]+ \([0-9.]+\) \|' out/report.md || fail "no row of 36 coefficients"
grep -q 'What coefficients cost' out/report.md || fail "no sentence about cost"
touch file
refuse 4 'no folder' bench draw box.obj $tiny -o file
finish
