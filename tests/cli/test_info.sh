#!/usr/bin/env bash
# diaphan info: counts against what is known of a box, of open surfaces and of the shared models.
. "$(dirname "$0")/lib.sh"

expect 0 info box.obj --json
field '.triangles == 12 and .positions == 8 and .boundary_edges == 0 and .nonmanifold_edges == 0 and .closed == true'
field '.bounds == [[0,0,0],[1,2,3]] and .baked == null and .vertices >= 8'
expect 0 info box.obj
grep -q closed stdout || fail "no word of closedness: $(cat stdout)"

grep -v 'f 5 6 7 8' box.obj >open.obj
expect 0 info open.obj --json
field '.triangles == 10 and .boundary_edges == 4 and .closed == false'
sed 's/f 5 6 7 8/f 8 7 6 5/' box.obj >flipped.obj
expect 0 info flipped.obj --json
field '.closed == false and .flipped_edges == 4'
(cat box.obj; echo f 5 6 7) >tripled.obj
expect 0 info tripled.obj --json
field '.closed == false and .nonmanifold_edges >= 2'

expect 0 bake box.obj -o box.glb -q --bands 4 --store snorm16 --directions 64 --fit sphere --thickness farthest --size-mm 6
expect 0 info box.glb --json
field '.triangles == 12 and .positions == 8 and .closed'
field '.baked | .bands == 4 and .store == "snorm16" and .definition == "farthest" and .fit == "sphere" and .directions == 64'
field '.baked | .bytes_per_vertex == 32 and .bytes_per_vertex_gpu == 32 and (.scale | length) == 4'
field '.baked.mm_per_unit == 2'
expect 0 info box.glb -v
grep -q '4 bands' stdout || fail "no word of the baked data: $(cat stdout)"

# what the table of the shared models says
known() { # file, triangles, vertices, closed, boundary edges
    [ -f "$data/models/$1" ] || { echo "skipped: no $1"; return; }
    expect 0 info "$data/models/$1" --json
    field ".triangles == $2 and .closed == $4 and .boundary_edges == $5"
    case $1 in *.gl*) field ".vertices == $3" ;; esac # the other formats' vertices are split where faces meet in a crease
}
known bunny_scan_open.obj 69451 35947 false 223
known bunny_closed_lr.obj 6598 3301 true 0
known lucy_100k.ply 99970 49987 true 0
known spot.obj 23062 11533 true 0
known bun_zipper.ply 69451 35947 false 223
known Suzanne/Suzanne.gltf 3936 11808 false 84
known CesiumMilkTruck.glb 3624 4823 false 8
known Fox.glb 576 1728 true 0
known NegativeScaleTest.glb 7724 3958 false 88
known Avocado/Avocado.gltf 682 406 false 38
known AvocadoQuantized/Avocado.gltf 682 406 false 38
finish
