#!/bin/sh
# Draws the pictures of the README. Arguments: the tool, the folder for the results.
set -eu
diaphan=$1 out=$2
mkdir -p "$out"
"$diaphan" render /usr/share/glmark2/models/bunny.obj -o "$out/bunny.png" --material wax --size-mm 80 --light 160,30,9,9,9 \
    --camera 10,12,2.6 --resolution 800x560 --samples 16
