#!/usr/bin/env bash
# diaphan bake: figures, the same bytes for any number of threads, thickness that is right, warnings.
. "$(dirname "$0")/lib.sh"

expect 0 bake box.obj -o box.glb --json
[ ! -s stderr ] || fail "talk on stderr: $(cat stderr)"
field '.triangles == 12 and .positions == 8 and .bands == 6 and .directions == 1024 and .thickness == "inside"'
field '.fit == "weighted" and .store == "snorm8" and .bytes_per_vertex == 36 and .bytes_per_vertex_gpu == 36'
field '.table_bytes == 0 and .untrusted == 0 and .threads >= 1 and .vertices >= 8'
field '[.seconds | .load, .sweep, .project, .store, .save, .total] | all(. >= 0)'
field '.seconds | .total >= .sweep + .project'
expect 0 bake box.obj -o box.glb --json --bands 3 --store float
field '.bytes_per_vertex == 36 and .bytes_per_vertex_gpu == 48'
expect 0 bake box.obj -o box.glb -q
[ ! -s stdout ] && [ ! -s stderr ] || fail "-q is not quiet"

expect 0 candle -o candle.glb --json
field '.triangles == 59704 and .vertices == 179112'
for fit in sphere weighted; do
    for threads in 1 2 8; do
        expect 0 bake candle.glb -o "candle-$threads.glb" --threads "$threads" --directions 128 --fit "$fit" --json
        field ".threads == $threads and .untrusted < 1e-5 and .positions < 30500"
    done
    cmp candle-1.glb candle-2.glb || fail "1 and 2 threads differ ($fit)"
    cmp candle-1.glb candle-8.glb || fail "1 and 8 threads differ ($fit)"
done

# baking again, from the baked file, replaces what is there and changes nothing else
expect 0 bake candle-1.glb -o again.glb --directions 128 --fit weighted -q
cmp candle-1.glb again.glb || fail "baking a baked file again gives other bytes"
# in place
expect 0 bake again.glb -o again.glb --directions 128 --fit weighted -q
cmp candle-1.glb again.glb || fail "baking in place gives other bytes"

# the weighted fit depends on size and material, the plain one does not
expect 0 bake box.obj -o a.glb -q --material skin1 --size-mm 200
expect 0 bake box.obj -o b.glb -q --material skin1 --size-mm 2
cmp -s a.glb b.glb && fail "the size makes no difference to the weighted fit"

# a candle with every tenth face missing: the samples do not add up, and the user hears of it
expect 0 candle -o candle.obj -q
awk '!/^f/ || ++n % 10' candle.obj >open.obj
expect 0 bake open.obj -o open.glb --directions 64 --json
field '.untrusted > 0.01'
grep -qE '^diaphan bake: warning: .*boundary edges.*close the holes' stderr || fail "no warning: $(cat stderr)"
expect 0 bake open.obj -o open.glb --directions 64 -q
[ ! -s stderr ] || fail "-q warns: $(cat stderr)"
NO_COLOR=1 expect 0 bake open.obj -o open.glb --directions 64
grep -q $'\033' stderr && fail "colour in a file"

# a box inside out is turned, with a warning, and gives the same thickness
awk '/^f/ {print $1, $5, $4, $3, $2; next} {print}' box.obj >inverted.obj
expect 0 bake inverted.obj -o inverted.glb --json
field '.untrusted == 0'
grep -q 'warning: ' stderr || fail "nothing is said of a body that is inside out"
finish
