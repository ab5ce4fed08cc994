#!/usr/bin/env bash
# compare of two pictures: figures, the error map, tolerances, refusals.
. "$(dirname "$0")/lib.sh"

# pictures without a GL context: three pixels of grey in the simplest of the formats
hdr() { # FILE WIDTH HEIGHT OCTAL: every pixel has this mantissa in red, green and blue and exponent 128: value / 256
    { printf '#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n' "$3" "$2"
      for _ in $(seq $(($2 * $3))); do printf "\\$4\\$4\\$4\\200"; done; } >"$1"
}
hdr half.hdr 3 2 200
hdr dark.hdr 3 2 100
hdr wide.hdr 4 2 200

expect 0 compare half.hdr half.hdr --json
field '.psnr == null and .ssim == 1 and .flip == 0 and .rmse == 0 and .width == 3 and .height == 2'
field 'keys == ["flip","height","psnr","rmse","ssim","width"]'
expect 0 compare half.hdr half.hdr --min-psnr 100 --max-flip 0
grep -q '^psnr *infinite' stdout || fail "equal pictures: $(cat stdout)"

# Radiance decodes a mantissa m to (m + 0.5) / 256 or m / 256: 0.5 and 0.25, encoded 0.735 and 0.537
expect 0 compare half.hdr dark.hdr --json
field '(.rmse - 0.1984 | fabs) < 0.003 and (.psnr - 14.05 | fabs) < 0.1 and .ssim < 1 and .flip > 0.05 and .flip < 1'
cp stdout once
expect 0 compare dark.hdr half.hdr --json --threads 1
jq -es '([.[0], .[1]] | map([.psnr, .rmse, .flip]) | unique | length) == 1' once stdout >/dev/null ||
    fail "not symmetric: $(cat once stdout)"
expect 0 compare half.hdr dark.hdr
grep -qE '^psnr +14\.[0-9]+ dB$' stdout || fail "no psnr in: $(cat stdout)"
for figure in ssim flip rmse; do
    grep -qE "^$figure +0\.[0-9]+$" stdout || fail "no $figure in: $(cat stdout)"
done
grep -qE '^size +3 x 2$' stdout || fail "no size in: $(cat stdout)"
expect 0 compare half.hdr dark.hdr -q
[ ! -s stdout ] || fail "-q still talks"

# tolerances: the figures are printed and the map is written all the same
expect 5 compare half.hdr dark.hdr --max-flip 0.01 -o map.png --json
field '.flip > 0.01'
[ "$(cat stderr)" != "" ] && [ "$(wc -l <stderr)" = 1 ] || fail "no line about the tolerance: $(cat stderr)"
[ -s map.png ] || fail "no map"
expect 5 compare half.hdr dark.hdr --min-psnr 14.5
grep -q 'PSNR .* below 14.5' stderr || fail "which tolerance? $(cat stderr)"
expect 5 compare half.hdr dark.hdr --min-psnr 30 --max-flip 0
[ "$(wc -l <stderr)" = 1 ] || fail "two tolerances, one line: $(cat stderr)"
expect 0 compare half.hdr dark.hdr --min-psnr 10 --max-flip 1

# a map is a picture of the same size; of equal pictures it is black (magma's: 0, 0, 4)
expect 0 compare half.hdr half.hdr -o black.png
expect 0 compare black.png black.png --json
field '.width == 3 and .height == 2'
expect 0 compare black.png map.png --json
field '.rmse > 0.01'

refuse 2 "half.hdr has 3 x 2 pixels, wide.hdr has 4 x 2" compare half.hdr wide.hdr -o never.png
refuse 2 "missing.png" compare missing.png half.hdr
refuse 2 "box.obj: byte 0: neither a PNG" compare half.hdr box.obj
head -c 40 map.png >cut.png
refuse 2 "cut.png" compare cut.png half.hdr
refuse 1 "too few arguments" compare
refuse 1 "what is 'dark.hdr' for" compare half.hdr half.hdr dark.hdr
refuse 1 "beside which other picture" compare half.hdr
refuse 1 "-o FOLDER is missing" compare box.obj
refuse 1 "the error map is a .png" compare half.hdr dark.hdr -o map.jpg
refuse 1 "--max-flip: 2 is out of range" compare half.hdr dark.hdr --max-flip 2
refuse 1 "--min-psnr: 'x' is no number" compare half.hdr dark.hdr --min-psnr x
refuse 4 "does not exist" compare half.hdr dark.hdr -o nowhere/map.png
[ ! -e never.png ] && [ ! -e folder ] && [ ! -e map.jpg ] || fail "something was written: $(ls)"

# the pair that FLIP's authors' tool was run on
if [ -f "$data/flip/tree-ref.png" ]; then
    expect 0 compare "$data/flip/tree-ref.png" "$data/flip/tree-test.png" --json -o tree.png
    field '(.flip - 0.133285 | fabs) < 1e-4 and .width == 640 and .height == 960'
    expect 0 compare tree.png "$data/flip/tree-comparison-cli.png" --json
    field '.psnr > 40'
else
    echo "skipped in part: $data/flip is absent"
fi
finish
