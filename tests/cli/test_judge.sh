#!/usr/bin/env bash
# diaphan compare INPUT -o FOLDER and diaphan fit: what they write, what they refuse.
. "$(dirname "$0")/lib.sh"

quick="--resolution 32x20 --spp 4 --directions 64 --size-mm 10 --threads 2"
"$diaphan" compare box.obj -o out $quick --methods lambert,shsss --lights back --json >stdout 2>stderr
code=$?
if [ $code = 3 ]; then
    echo "skipped: $(cat stderr)"
    exit 77
fi
[ $code = 0 ] || fail "compare: exit code $code: $(cat stderr)"
cmp stdout out/metrics.json || fail "stdout is not metrics.json"
field '.reference.spp == 4 and .reference.noise_psnr > 0 and .reference.seed == 1 and .width == 32 and .size_mm == 10'
field '.triangles == 12 and (.renderer | length) > 0 and .lights == [{name: "back", azimuth: 180, elevation: 20}]'
field '[.results[] | [.method, .variant, .fitted]] == [["lambert", null, false], ["lambert", null, true],
    ["shsss", "6 bands", false], ["shsss", "6 bands", true], ["shsss", "2 bands", false], ["shsss", "2 bands", true]]'
field 'all(.results[]; .light == "back" and .material == "wax" and .rmse > 0 and .flip > 0 and .flip < 1 and .ssim <= 1 and .psnr > 0
    and .noise.psnr > 0 and .passes == 1 and .milliseconds > 0)'
field '[.results[] | .bytes_per_vertex] == [0, 0, 36, 36, 4, 4]'
field '[.results[] | select(.fitted) | .training.after < .training.before] | all'
field '.results[1].parameters.gain | length == 3'
field '.results[3].parameters | (.sigma | length == 3) and (.back | length == 3)'
field '.results[0].store == null and .results[2].store == "snorm8" and .results[4].bands == 2'

field '.materials[0].all_lights | .lights == 24 and .spp == 32 and .noise > 0 and .view_averaged_rmse == null'
field 'all(.results[]; .rmse_all_lights > 0 and .rmse_view_averaged == null and .rmse_all_lights_view_averaged == null)'

# beside the response: the truth averaged over views, shsss with the bytes of its forms
expect 0 compare box.obj -o out $quick --methods shsss,response --noise 1 --lights back
grep -q 'distance of the average from the picture' stdout || fail "no views in the table"
jq -e '.materials[0] | .lights[0].view_averaged_rmse >= 0 and .lights[0].view_averaged_noise > 0 and .all_lights.view_averaged_rmse >= 0' out/metrics.json >/dev/null || fail "no distance of the truths"
jq -e 'all(.results[]; .rmse_view_averaged > 0 and .rmse_all_lights > 0 and .rmse_all_lights_view_averaged > 0)' out/metrics.json >/dev/null || fail "not scored against both"
jq -e '[.results[] | select(.fitted | not) | [.method, .bands, .shown]] == [["shsss", 6, true], ["shsss", 2, true], ["shsss", 4, false], ["shsss", 3, false],
    ["response", 6, true], ["response", 4, true], ["response", 3, true]]' out/metrics.json >/dev/null || fail "rows: $(jq -c '[.results[] | [.method, .bands]]' out/metrics.json)"
grep -q 'distance of the average' out/report.html || fail "no views in the report"

# several materials, a study; another light; the table for people; the folder may exist
expect 0 compare box.obj -o out $quick --methods lambert --lights front --material marble --material skin1 --spp 2
grep -q 'noise of the reference' stdout || fail "no noise in the table"
jq -e '[.results[].material] | unique == ["marble", "skin1"]' out/metrics.json >/dev/null || fail "materials"
expect 0 compare box.obj -o out $quick --methods shsss --lights front --study --spp 2
grep -q 'paper, exp, sphere, 3 bands, fitted' stdout || fail "no study in the table"
jq -e '[.results[] | select(.shown | not)] | length == 2 * 32' out/metrics.json >/dev/null || fail "rows of the study"
expect 0 compare box.obj -o out $quick --methods green --lights side --boundary dielectric --json
field '.light_angle == 5 and .reference.boundary == "dielectric"'
expect 5 compare box.obj -o out $quick --methods lambert --lights back --max-flip 0.01 -q
grep -q 'lambert in wax, back: FLIP .* is above 0.01' stderr || fail "which row? $(cat stderr)"

# one sample: nothing is known of the noise
expect 0 compare box.obj -o out $quick --methods lambert --lights back --spp 1 --json
field '.reference.noise_psnr == null and all(.results[]; .warning | test("not known"))'

# Ctrl-C keeps the samples so far
"$diaphan" compare box.obj -o stopped $quick --methods lambert --lights back --spp 16000000 --json >stdout 2>stderr &
tracer=$!
sleep 2
kill -INT $tracer
wait $tracer
code=$?
[ $code = 0 ] || fail "interrupted: exit code $code: $(cat stderr)"
field '.reference.spp > 0 and .reference.spp < 16000000'
grep -q 'stopped after' stderr || fail "says nothing of the samples: $(cat stderr)"

# in another phase it ends the work and leaves nothing
"$diaphan" compare box.obj -o cancelled --directions 65536 --methods prt --lights back -q >stdout 2>stderr &
baker=$!
sleep 1
kill -INT $baker
wait $baker
code=$?
[ $code = 130 ] || fail "cancelled: exit code $code: $(cat stderr)"
[ ! -e cancelled ] || fail "cancelled, and a folder all the same"

refuse 1 "'below' is none of front, side, back" compare box.obj -o no --lights below
refuse 1 "twice" compare box.obj -o no --lights back,back
refuse 1 "none of lambert" compare box.obj -o no --methods gold
refuse 1 "a quantity" compare box.obj -o no --methods thickness
refuse 1 "unknown material" compare box.obj -o no --material gold
touch file
refuse 4 "file" compare box.obj -o file $quick
refuse 4 "does not exist" compare box.obj -o nowhere/folder $quick
mkdir -p taken/report.html
refuse 4 "report.html: is a folder" compare box.obj -o taken
[ ! -e no ] || fail "a folder in spite of a refusal"
refuse 2 "missing.obj" compare missing.obj -o other
# before the work, which would take minutes: a camera that looks past the object, pictures that no memory holds
refuse 1 "does not see the object" compare box.obj -o other --camera 0,15,900000
refuse 1 "does not see the object" fit box.obj -o no.json --camera 0,15,900000
refuse 2 "the pictures take .* GB" compare box.obj -o other --resolution 32768x32768
printf 'v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n' >nan.obj
refuse 2 "nan.obj:2" compare nan.obj -o other
refuse 2 "nan.obj:2" fit nan.obj -o no.json
[ ! -e other ] || fail "a folder in spite of a refusal"

# a fitted material is one that render takes
expect 0 fit box.obj --size-mm 10 --directions 64 --spp 2 -o fitted.json --json
field '.method == "shsss" and .material == "wax" and .after < .before and (.sigma | length == 3)'
jq -e '.formula == "g" and .curve == "exp" and .scattering == [1.6, 1.5, 1.3]' fitted.json >/dev/null || fail "$(cat fitted.json)"
expect 0 render box.obj --size-mm 10 --material fitted.json --resolution 16x10 -o box.png -q
expect 0 fit box.obj --size-mm 10 --formula paper --method green --spp 2 -o paper.json -q
jq -e '.formula == "paper" and .back == [0, 0, 0]' paper.json >/dev/null || fail "$(cat paper.json)"
refuse 1 "nothing to fit" fit box.obj --method prt -o no.json
refuse 1 "nothing to fit" fit box.obj --method reference -o no.json
refuse 4 "does not exist" fit box.obj -o nowhere/x.json
[ ! -e no.json ] || fail "a file after all"
finish
