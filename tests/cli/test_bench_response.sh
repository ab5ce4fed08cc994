#!/usr/bin/env bash
# diaphan bench response: every field, the sizes that go with materials, and a noise that is what a better bake finds. No speed is asserted.
. "$(dirname "$0")/lib.sh"

# a ball with three ribs
awk 'BEGIN {
    n = 16; m = 24; pi = 3.14159265358979
    print "v 0 1 0"
    for (i = 1; i < n; i++)
        for (j = 0; j < m; j++) {
            t = pi * i / n; p = 2 * pi * j / m; r = 1 + .2 * sin(3 * p) * sin(t) * sin(t)
            printf "v %.6f %.6f %.6f\n", r * sin(t) * sin(p), r * cos(t), r * sin(t) * cos(p)
        }
    print "v 0 -1 0"
    for (j = 0; j < m; j++) {
        k = (j + 1) % m; last = 2 + (n - 2) * m
        print "f 1", 2 + j, 2 + k
        for (i = 0; i < n - 2; i++)
            print "f", 2 + i * m + j, 2 + (i + 1) * m + j, 2 + (i + 1) * m + k, 2 + i * m + k
        print "f", last + j, 2 + (n - 1) * m, last + k
    }
}' >ball.obj

expect 0 bench response ball.obj --material wax --size-mm 5 --noise 0.3 --threads 2 --check 8 --json
field '(.cpu | length) > 0 and (.commit | length) > 0 and .noise == 0.3 and .check == 8 and (.results | length) == 1'
field '.results[0] | .model == "ball.obj" and .triangles == 720 and .positions == 362 and .size_mm == 5 and .threads == 2'
field '.results[0] | (.material | ascii_downcase) == "wax" and .mm_per_unit > 2 and .mm_per_unit < 2.5 and .seconds > 0 and .cpu_seconds > 0 and .view_seconds > 0'
field '.results[0] | .noise_reached and .noise > 0 and .noise <= 0.3 and .noise < .noise_walks and .walks_per_position > 50'
field '.results[0] | .check_walks_per_position / .walks_per_position | . > 7 and . < 9'
field '.results[0] | .check_noise < .noise_walks and .check_seconds > 0'
# smoothing tells its noise with a tenth on top
field '.results[0] | .noise_found / .noise | . > 0.6 and . < 1.15'
jq '.results[0] | del(.seconds, .cpu_seconds, .view_seconds, .check_seconds, .threads)' stdout >two

# the same for any number of threads; other random numbers are others
expect 0 bench response ball.obj --material wax --size-mm 5 --noise 0.3 --threads 1 --check 8 --json
jq '.results[0] | del(.seconds, .cpu_seconds, .view_seconds, .check_seconds, .threads)' stdout | cmp -s - two || fail "1 and 2 threads differ"
expect 0 bench response ball.obj --material wax --size-mm 5 --noise 0.3 --seed 3 --json
field '.results[0] | (has("noise_found") | not) and (has("check_noise") | not)'
[ "$(jq .results[0].noise stdout)" != "$(jq .noise two)" ] || fail "--seed changes nothing"

# the materials that stand for all, in their sizes; several of one's own
expect 0 bench response box.obj --noise 1 --json
field '[.results[] | [(.material | ascii_downcase), .size_mm]] == [["wax", 20], ["marble", 50]]'
expect 0 bench response box.obj ball.obj --noise 1 --material marble --material skin1 --json
field '[.results[] | [.model, .size_mm]] == [["box.obj", 50], ["box.obj", 20], ["ball.obj", 50], ["ball.obj", 20]]'

expect 0 bench response box.obj --noise 1 --check 2
grep -q 'found/told' stdout || fail "no check in the table"
[ "$(grep -c '^box.obj ' stdout)" = 2 ] || fail "not two rows in the table"

refuse 2 missing.obj bench response missing.obj
refuse 1 adamantium bench response box.obj --json --material adamantium
refuse 1 'writes no files' bench response box.obj -o x
refuse 1 '--check: 1 is out of range' bench response box.obj --check 1
refuse 1 '--check' bench bake box.obj --check 4
finish
