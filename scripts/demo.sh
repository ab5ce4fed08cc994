#!/bin/sh
# Bakes a scanned bunny and the candle and draws them with the light behind. Arguments: the tool, the folder for the results.
set -eu
diaphan=$1 out=$2
bunny=/usr/share/glmark2/models/bunny.obj
mkdir -p "$out"

if [ -f "$bunny" ]; then
    "$diaphan" bake "$bunny" -o "$out/bunny.glb" --material skin2 --size-mm 45
    "$diaphan" render "$out/bunny.glb" -o "$out/bunny.png" --material skin2 --light 165,25,9,9,9 --camera 10,12,2.8
fi
"$diaphan" candle -o "$out/candle-bare.glb" -q
"$diaphan" bake "$out/candle-bare.glb" -o "$out/candle.glb" --material wax --size-mm 48
"$diaphan" render "$out/candle.glb" -o "$out/candle.png" --material wax --light 165,38,9,9,9 --camera 0,20,3.4
rm "$out/candle-bare.glb"
