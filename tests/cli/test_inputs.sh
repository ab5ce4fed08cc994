#!/usr/bin/env bash
# Bad inputs, by every command that reads one: exit code 2, one line with the file and the place, nothing written.
. "$(dirname "$0")/lib.sh"

printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9001\n' >index.obj
printf 'v 0 0 nan\n' >nan.obj
printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n' >zero.obj
printf 'glTF\002\000\000\000' >short.glb
printf '{"asset": {"version": "2.0"}, "meshes": [' >broken.gltf
printf 'ply\nformat ascii 1.0\nelement vertex 99999999999999\nend_header\n' >huge.ply
printf 'solid x\nfacet normal 0 0 1\nouter loop\nvertex 1 2\n' >short.stl
printf '' >empty.obj
mkdir folder.obj

for command in bake render; do
    for file in index.obj nan.obj zero.obj short.glb broken.gltf huge.ply short.stl folder.obj missing.obj; do
        output=out.glb
        [ $command = render ] && output=out.png
        refuse 2 "$file" $command "$file" -o $output
        [ ! -e $output ] || { fail "$command $file wrote something"; rm -f $output; }
    done
done
for file in index.obj nan.obj short.glb broken.gltf huge.ply short.stl missing.obj; do
    refuse 2 "$file" info "$file"
    refuse 2 "$file" info "$file" --json
done
refuse 2 'index\.obj:4: .*9001' bake index.obj -o out.glb
refuse 2 'nan\.obj:1: ' bake nan.obj -o out.glb
echo '{"scattering": [1, 2' >material.json
refuse 2 'material\.json' bake box.obj -o out.glb --material material.json
[ ! -e out.glb ] || fail "a bad material file left an output"
finish
