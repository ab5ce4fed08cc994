#!/bin/sh
# A mesh beyond single precision is refused with the file's name, and nothing is written.
set -eu
diaphan=$1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
printf 'v 0 0 0\nv 1e20 0 0\nv 0 1e20 0\nv 0 0 1e20\nf 1 3 2\nf 1 4 3\nf 1 2 4\nf 2 3 4\n' >"$folder/huge.obj"
code=0
"$diaphan" bake "$folder/huge.obj" -o "$folder/out.glb" 2>"$folder/message" || code=$?
[ "$code" -eq 2 ] || { echo "exit code $code"; exit 1; }
[ "$(wc -l <"$folder/message")" -eq 1 ] || { cat "$folder/message"; exit 1; }
grep -q "huge.obj: .*1e+20" "$folder/message" || { cat "$folder/message"; exit 1; }
[ ! -e "$folder/out.glb" ] || { echo "something was written"; exit 1; }
