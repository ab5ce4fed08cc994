#!/usr/bin/env bash
# diaphan render --method reference: needs no driver, repeats itself for any number of threads, keeps its samples on Ctrl-C.
. "$(dirname "$0")/lib.sh"

export __EGL_VENDOR_LIBRARY_DIRS=/nonexistent __EGL_VENDOR_LIBRARY_FILENAMES=/nonexistent/x.json
traced="render box.obj --method reference --resolution 40x30 --size-mm 10"
expect 0 $traced -o one.exr --spp 4 --seed 3 --threads 1 --json
field '.method == "reference" and .boundary == "matched" and .spp == 4 and .seed == 3 and .paths == 4800 and .lost == 0 and .capped == 0'
expect 0 $traced -o two.exr --spp 4 --seed 3 --threads 3 -q
cmp one.exr two.exr || fail "the number of threads changes the picture"
different() {
    expect 0 $traced -o other.exr --spp 4 --seed 3 -q "$@"
    cmp -s one.exr other.exr && fail "$* changes nothing"
}
different --seed 4
different --spp 5
different --boundary dielectric
different --view-averaged
different --light-angle 20
different --light 10,20
different --material skin1
different --env one.exr
different --background 1,1,1
expect 1 $traced -o other.exr --point-light 1,2,3
expect 1 $traced -o other.exr --boundary rough
refuse 1 "matched boundary only" $traced -o other.png --view-averaged --boundary dielectric
expect 1 $traced -o other.exr --spp 0
expect 2 $traced -o other.exr --env missing.exr

# variance beside the picture, for whoever asks: names in the header's list, 18 bytes apart from the name
for channel in A B G R variance.B variance.G variance.R; do
    grep -qaF "$channel" one.exr || fail "one.exr has no channel $channel"
done
expect 0 compare one.exr two.exr --json
field '.rmse == 0'
if command -v exrheader >exrheader.path; then
    exrheader one.exr | tr '\n' ' ' >header
    grep -q 'variance.B, 32-bit floating-point.*variance.G, 32-bit.*variance.R, 32-bit' header || fail "exrheader: $(cat header)"
fi

"$diaphan" $traced -o stopped.png --spp 16000000 >stdout 2>stderr &
tracer=$!
sleep 1
kill -INT $tracer
wait $tracer
code=$?
[ $code = 0 ] || fail "interrupted: exit code $code: $(cat stderr)"
grep -q 'stopped after [1-9][0-9]* of 16000000 samples' stderr || fail "says nothing of the samples: $(cat stderr)"
[ -s stopped.png ] || fail "interrupted: no picture"
finish
