#!/usr/bin/env bash
# diaphan render: pictures of the right size and content, from baked and unbaked files; no GL context is exit code 3.
. "$(dirname "$0")/lib.sh"

# no driver to be had
__EGL_VENDOR_LIBRARY_DIRS=/nonexistent __EGL_VENDOR_LIBRARY_FILENAMES=/nonexistent/x.json \
    "$diaphan" render box.obj -o none.png >stdout 2>stderr
code=$?
[ $code = 3 ] || fail "without a driver: exit code $code: $(cat stderr)"
[ "$(wc -l <stderr)" = 1 ] || fail "without a driver: not one line: $(cat stderr)"
[ ! -e none.png ] || fail "a picture without a driver"

"$diaphan" render box.obj -o box.png --resolution 64x48 >stdout 2>stderr
if [ $? = 3 ]; then
    echo "skipped: $(cat stderr)"
    [ "$failures" = 0 ] || exit 1
    exit 77
fi
size() { # file: width and height of a PNG
    od -An -tu1 -j16 -N8 "$1" | awk '{print $3 * 256 + $4 "x" $7 * 256 + $8}'
}
[ "$(head -c 8 box.png | od -An -tx1 | tr -d ' \n')" = 89504e470d0a1a0a ] || fail "no PNG"
[ "$(size box.png)" = 64x48 ] || fail "the picture is $(size box.png)"

small="--resolution 96x64"
expect 0 bake box.obj -o box.glb -q
expect 0 render box.glb -o baked.png $small --json
field '.method == "shsss" and .material == "wax" and .width == 96 and .height == 64 and .lights == 1 and (.renderer | length) > 0'
expect 0 render box.obj -o unbaked.png $small -q
cmp baked.png unbaked.png || fail "baked beforehand and in memory differ"
expect 0 render box.glb -o again.png $small -q
cmp baked.png again.png || fail "two runs differ"

for method in lambert shsss green green-gauss prt prt-cpca patro response thickness; do
    expect 0 render box.glb -o "$method.png" $small --method $method -q
done
cmp -s lambert.png shsss.png && fail "lambert and shsss draw the same"
# every option changes the picture
different() {
    expect 0 render box.glb -o other.png $small -q "$@"
    cmp -s baked.png other.png && fail "$* changes nothing"
}
different --light 30,30
different --light 150,30 --light 30,30
different --light 150,30,1,0,0
different --camera 40,15
different --camera 0,15,5
different --fov 50
different --exposure 1
different --background 0.1,0.2,0.3
different --material marble
different --size-mm 100
different --use-bands 2
different --use-bands auto --light 10,15
different --formula paper
different --ambient 0.2
different --rim 0.5
different --specular 0.5 --light 10,20
different --window hann
different --light-angle 40
different --point-light 2,2,-2
different --point-light 2,2,-2 --point-light 0,3,0,5,0,0
different --spot-light 3,3,-3,0,0,0,8
expect 0 render box.glb -o green.png $small -q --method green-gauss
different --method green-gauss
different --method green-gauss --map-size 16
cmp -s green.png other.png && fail "--map-size changes nothing"
different --method green-gauss --blur-mm 9
cmp -s green.png other.png && fail "--blur-mm changes nothing"
expect 0 render box.glb -o green.png $small --method green --light 10,20 --point-light 2,2,-2 --json
field '.passes == 3 and .table_bytes > 0 and .bytes_per_vertex > 0 and .lights == 2'
expect 1 render box.glb -o no.png --map-size 1000
expect 1 render box.glb -o no.png --point-light 1,2
expect 1 render box.glb -o no.png --spot-light 1,2,3,1,2,3,20
expect 1 render box.glb -o no.png --spot-light 1,2,3,0,0,0,90
expect 1 render box.glb -o no.png --light-angle 91
expect 1 render box.glb -o no.png --method prt --point-light 2,2,-2
grep -q 'point and spot lights; these can: .*shsss' stderr || fail "prt does not name the methods: $(cat stderr)"
expect 1 render box.glb -o no.png --env none.hdr
grep -q 'surroundings; these can: .*prt' stderr || fail "shsss does not name the methods: $(cat stderr)"
expect 2 render box.glb -o no.png --method prt --env none.hdr
[ ! -e no.png ] || fail "a picture from bad lights"
expect 0 render box.glb -o same.png $small -q --light 150,30
cmp baked.png same.png || fail "the default light is not 150,30"

expect 0 render box.glb -o box.exr $small -q
[ "$(head -c 4 box.exr | od -An -tx1 | tr -d ' \n')" = 762f3101 ] || fail "no EXR"
expect 0 render box.glb -o sky.exr $small -q --background 1,1,2
expect 0 render box.glb -o around.png $small --method prt --env sky.exr --json
field '.bytes_per_vertex > 400 and .passes == 1 and .seconds.transfer > 0 and .seconds.bake >= .seconds.transfer'
cmp -s around.png prt.png && fail "--env changes nothing"
expect 0 render box.glb -o other.png $small -q --method prt --env sky.exr --light 150,30
cmp -s around.png other.png && fail "a light beside --env changes nothing"
expect 0 render box.glb -o other.png $small --method prt-cpca --clusters 1 --vectors 24 --json
field '.bytes_per_vertex > 0 and .bytes_per_vertex <= 28 and .table_bytes > 0 and .seconds.clusters >= 0'
expect 0 bake box.obj -o eight.glb --bands 8 -q
expect 0 render eight.glb -o eight.png $small
grep -q '8 bands are stored, the first 6 are drawn' stderr || fail "nothing is said of 8 bands: $(cat stderr)"
expect 0 render eight.glb -o eight.png $small -q
[ ! -s stderr ] || fail "-q talks"
finish
