#!/bin/sh
# Makes docs/results/compare: bunny, candle, head and lucy in three materials and two sizes by every method beside the reference,
# and a page of tables and sentences about them. Figures are kept of both sizes, contact sheets of the smaller one; the HTML reports
# are too large for a repository, and the page says the commands that make them.
#
#     scripts/results.sh TOOL MODELS OUT [option of compare ...]
#
# MODELS is a folder with head.* and lucy.* (.obj, .ply, .glb or .stl):
#   lucy  Stanford's scan with 100,000 triangles, closed: Data/lucy.ply of github.com/pyvista/vtk-data. She stands along z in it,
#         and is turned here: a binary .ply that is tallest along z gets y for up. Other files are taken as they are
#   head  Lee Perry-Smith's, CC BY 3.0: samples/media/LPSHead/head.obj of github.com/NVIDIAGameWorks/FaceWorks
# The bunny is that of Debian's package glmark2-data unless MODELS has one; the candle is made here. Where a model is missing
# nothing is done. Less than an hour on two cores, and the time that the response takes to bake; `--spp 32 --noise 0.5` is quick, and
# a later option replaces an earlier one. What is finished stays where the rest is interrupted, and the page is made of
# folders by the last lines of this script.
set -eu
[ $# -ge 3 ] || { echo "usage: $0 TOOL MODELS OUT [option of compare ...]" >&2; exit 1; }
here=$(cd "$(dirname "$0")" && pwd)
tool=$(realpath "$1") models=$(realpath "$2") out=$3
shift 3
mkdir -p "$out"
out=$(realpath "$out")
work=$(mktemp -d)
running=
trap '[ -z "$running" ] || kill $running 2>/dev/null || :; rm -rf "$work"' EXIT
trap 'exit 130' INT TERM

# the models under names without folders, which is how reports call them
missing=
link_model() {
    for file in "$models/$1.obj" "$models/$1.ply" "$models/$1.glb" "$models/$1.stl" "$2"; do
        if [ -f "$file" ]; then
            ln -s "$file" "$work/$1.${file##*.}"
            return
        fi
    done
    missing="$missing $1"
}
link_model bunny /usr/share/glmark2/models/bunny.obj
link_model head ""
link_model lucy ""
if [ -n "$missing" ]; then
    echo "$0: missing in $models:$missing; where they come from is said at the top of the script" >&2
    exit 2
fi

# to the camera, y is up: (x, y, z) becomes (-x, z, y), which lets her face the camera
if [ -f "$work/lucy.ply" ]; then
    perl -e '
        local $/;
        binmode STDIN;
        binmode STDOUT;
        my $file = <STDIN>;
        my $float = "property float";
        if ($file =~ /\A(ply\s+format binary_little_endian .*?element vertex (\d+)\n$float x\n$float y\n$float z\nelement face.*?end_header\n)/s) {
            my ($start, $count) = (length $1, $2);
            my @xyz = unpack "f<" . 3 * $count, substr $file, $start, 12 * $count;
            my @size = map { my $axis = $_; my @sorted = sort { $a <=> $b } @xyz[map { 3 * $_ + $axis } 0 .. $count - 1];
                             $sorted[-1] - $sorted[0] } 0 .. 2;
            if ($size[2] > $size[1] && $size[2] > $size[0]) {
                substr($file, $start, 12 * $count) = pack "f<*", map { -$xyz[3 * $_], @xyz[3 * $_ + 2, 3 * $_ + 1] } 0 .. $count - 1;
            }
        }
        print $file' <"$work/lucy.ply" >"$work/turned"
    mv "$work/turned" "$work/lucy.ply"
fi
"$tool" candle -o "$work/candle.obj" -q

cd "$work"
# both sizes of a model at once: drawing by software keeps little more than one processor busy
for model in bunny candle head lucy; do
    file=$(ls $model.*)
    for size in 20 50; do
        folder=$model-${size}mm
        echo "$folder" >&2
        "$tool" compare "$file" -o $folder --material wax --material marble --material skin1 --size-mm $size \
            --resolution 160x100 --spp 256 -q "$@" &
        running="$running $!"
    done
    for process in $running; do
        wait "$process"
    done
    running=
    for size in 20 50; do
        folder=$model-${size}mm
        mkdir -p "$out/$folder"
        mv $folder/metrics.json "$out/$folder/"
        [ $size != 20 ] || mv $folder/comparison.png "$out/$folder/"
    done
done
cd "$out"
jq -n -r -f "$here/results.jq" bunny-20mm/metrics.json candle-20mm/metrics.json head-20mm/metrics.json lucy-20mm/metrics.json \
    bunny-50mm/metrics.json candle-50mm/metrics.json head-50mm/metrics.json lucy-50mm/metrics.json >"$work/README.md"
mv "$work/README.md" README.md
