#!/usr/bin/env bash
# bake --for: what the other methods need in the file; read back, drawn from, replaced, and told from what does not fit.
. "$(dirname "$0")/lib.sh"

few="--directions 64 --clusters 12 --vectors 6 --threads 2"
# a lumpy ball
awk 'BEGIN {
    n = 20; m = 32; pi = 3.14159265358979
    print "v 0 1 0"
    for (i = 1; i < n; i++)
        for (j = 0; j < m; j++) {
            t = pi * i / n; p = 2 * pi * j / m; r = 1 + .2 * sin(3 * p) * sin(t) * sin(t)
            print "v", r * sin(t) * sin(p), r * cos(t), r * sin(t) * cos(p)
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
expect 0 bake ball.obj -o all.glb --for shsss,prt-cpca,patro,prt $few --material wax --size-mm 25 --json
field '.bytes_per_vertex == 36 and .prt.bytes_per_vertex == 432 and .patro.bytes_per_vertex == 12'
field '.prt_cpca | .bytes_per_vertex == 7 and .bytes_per_vertex_gpu == 12 and .table_bytes == 12 * 7 * 108 * 4 and .relative_error > 0 and .relative_error < 0.3'
field '.seconds | .normals >= 0 and .transfer > 0 and .clusters > 0 and .sweep > 0'
expect 0 info all.glb --json
field '.baked.store == "snorm8" and (.prt | .bands == 6 and .directions == 64 and (.material | ascii_downcase) == "wax")'
field '.prt_cpca.clusters == 12 and .prt_cpca.vectors == 6 and .patro.bytes_per_vertex == 12'

# the same bytes for any number of threads
expect 0 bake ball.obj -o one.glb --for shsss,prt-cpca,patro,prt $few --threads 1 --material wax --size-mm 25 -q
cmp all.glb one.glb || fail "1 and 2 threads differ"
# and over itself
expect 0 bake all.glb -o over.glb --for shsss,prt-cpca,patro,prt $few --material wax --size-mm 25 -q
cmp all.glb over.glb || fail "the second bake is not the first"

# one product stays where another is baked; transfer vectors baked anew end their old compressed form
expect 0 bake all.glb -o some.glb --for patro -q
expect 0 info some.glb --json
field '.prt and .prt_cpca and .patro and .baked'
expect 0 bake all.glb -o some.glb --for prt $few -q
expect 0 info some.glb --json
field '.prt and .patro and (has("prt_cpca") | not)'

# alone; nothing for what needs nothing
expect 0 bake box.obj -o box.glb --for prt-cpca --directions 16 --json
field '.prt_cpca.bytes_per_vertex == 9 and (has("bytes_per_vertex") | not) and .vertices > 0'
expect 0 info box.glb --json
field '.baked == null and .prt_cpca and (has("prt") | not)'
for nothing in green lambert,green-gauss; do
    expect 0 bake box.obj -o plain.glb --for $nothing -q
    grep -q '"diaphan":' plain.glb && fail "--for $nothing has added something"
done
expect 0 bake box.obj -o box.glb --for thickness --directions 16 -q
expect 0 info box.glb --json
field '.baked.store == "snorm8"'

refuse 1 "'magic' is none of lambert, shsss" bake box.obj -o x.glb --for shsss,magic
refuse 1 "is none of" bake box.obj -o x.glb --for shsss,
[ -e x.glb ] && fail "x.glb was written"

# the response: what is stored, reported and told of the file
expect 0 bake box.obj -o response.glb --for response --noise .3 --bytes 16 --material marble --size-mm 20 --json
field '.response.form == "root" and .response.bands == 4 and .response.bytes_per_vertex == 16 and .response.table_bytes == 288'
field '.response.noise > 0 and .response.noise <= .3 and .response.noise_reached and .response.walks > 0 and .response.relative_error < .6'
field '.seconds.walks > 0 and (has("bands") | not)'
expect 0 info response.glb --json
field '.response.form == "root" and .response.material == "marble" and .response.bands == 4 and .response.noise <= .3'
expect 0 bake box.obj -o once.glb --for response --noise .3 --bytes 16 --material marble --size-mm 20 -q --threads 1
cmp response.glb once.glb || fail "the response depends on threads"
expect 0 bake response.glb -o more.glb --for response,shsss --noise .3 --response-form rgb --bands 3 --store snorm16 --directions 64 --json
field '.response.form == "rgb" and .response.bytes_per_vertex == 54 and .bytes_per_vertex == 18'
refuse 1 'none of 4, 9, 16, 36' bake box.obj -o x.glb --for response --bytes 12
refuse 1 'root, linear, rgb' bake box.obj -o x.glb --for response --response-form square

# the table
expect 0 info ball.obj --compression --for prt --directions 16 --json
field '.transfer.compression | length == 5 and .[0].bytes_per_vertex == 432 and .[0].error == 0 and .[4].clusters == 128'
field '.transfer.compression | .[4].error < .[3].error and .[3].error < .[2].error and .[4].bytes_per_vertex == 9 and .[1].bytes_per_vertex == 25'
expect 0 info ball.obj --compression --for prt --directions 16
grep -q 'cpca 64 x 8' stdout || fail "no table: $(cat stdout)"

# drawn from the file, or anew with the reason
small="--resolution 48x32 --samples 1 --light 150,30"
"$diaphan" render all.glb -o a.png --method lambert $small -q 2>/dev/null
if [ $? = 3 ]; then
    echo "no GL: drawing was left out"
    finish
fi
for method in prt prt-cpca patro; do
    expect 0 render all.glb -o a.exr --method $method $small --json
    field '.seconds.bake == 0'
    [ -s stderr ] && fail "$method: $(cat stderr)"
    expect 0 render ball.obj -o b.exr --method $method $small $few
    cmp a.exr b.exr || fail "$method: the file's data and those of memory differ"
    expect 0 render all.glb -o c.exr --method $method $small $few --material marble
    grep -q "warning: .*another material" stderr || fail "$method: no warning of the material: $(cat stderr)"
    expect 0 render all.glb -o c.exr --method $method $small $few --size-mm 50
    grep -q "warning: .*another size" stderr || fail "$method: no warning of the size: $(cat stderr)"
done
# the response likewise, to a noise of its own
few="--noise .3 --bytes 16 --material marble --size-mm 20"
expect 0 render response.glb -o a.exr --method response $small --material marble --size-mm 20 --json
field '.seconds.bake == 0 and .bytes_per_vertex == 16 and .passes == 1'
[ -s stderr ] && fail "response: $(cat stderr)"
expect 0 render box.obj -o b.exr --method response $small $few --json
field '.seconds.response > 0'
cmp a.exr b.exr || fail "response: the file's data and those of memory differ"
expect 0 render response.glb -o c.exr --method response $small --noise .5 --size-mm 20 --material wax
grep -q "warning: .*another material" stderr || fail "response: no warning of the material: $(cat stderr)"
expect 0 render response.glb -o c.exr --method response $small --noise .5 --size-mm 30 --material marble
grep -q "warning: .*another size" stderr || fail "response: no warning of the size: $(cat stderr)"
finish
