#!/bin/sh
# Draws the pictures of the README. Arguments: the tool, the folder for the results.
set -eu
diaphan=$1 out=$2
mkdir -p "$out"
"$diaphan" render /usr/share/glmark2/models/bunny.obj -o "$out/bunny.png" --material skin2 --size-mm 45 --light 165,25,9,9,9 \
    --camera 10,12,2.6 --resolution 800x560 --samples 16
