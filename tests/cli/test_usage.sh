#!/usr/bin/env bash
# Wrong usage: exit code 1, one line that names the option, nothing written.
. "$(dirname "$0")/lib.sh"

refuse 1 "too few arguments" bake -o x.glb
refuse 1 "what is 'b.obj' for" bake box.obj b.obj -o x.glb
refuse 1 "-o is missing" bake box.obj
refuse 1 "--output needs a value" bake box.obj -o
refuse 1 "a baked file is a .glb" bake box.obj -o x.obj
refuse 1 "--bands: 0 is out of range, 1 to 8" bake box.obj -o x.glb --bands 0
refuse 1 "--bands: 9 is out of range, 1 to 8" bake box.obj -o x.glb --bands=9
refuse 1 "--bands: 'six' is no whole number" bake box.obj -o x.glb --bands six
refuse 1 "--bands: '6.5' is no whole number" bake box.obj -o x.glb --bands 6.5
refuse 1 "--bands: 99999999999999999999 is out of range" bake box.obj -o x.glb --bands 99999999999999999999
refuse 1 "--directions: 15 is out of range, 16 to 65536" bake box.obj -o x.glb --directions 15
refuse 1 "--threads: 0 is out of range" bake box.obj -o x.glb --threads 0
refuse 1 "--thickness: 'outside' is none of inside, first, farthest" bake box.obj -o x.glb --thickness outside
refuse 1 "--fit: 'x' is none of sphere, weighted" bake box.obj -o x.glb --fit x
refuse 1 "--store: 'half' is none of float, snorm16, snorm8" bake box.obj -o x.glb --store half
refuse 1 "--size-mm: " bake box.obj -o x.glb --size-mm 0
refuse 1 "--size-mm: 'nan' is no number" bake box.obj -o x.glb --size-mm nan
refuse 1 "--size-mm: " bake box.obj -o x.glb --size-mm 1e99
refuse 1 "--quiet takes no value" bake box.obj -o x.glb --quiet=1
refuse 1 "--light is no option of this command" bake box.obj -o x.glb --light 1,2
refuse 1 "unknown option -x" bake box.obj -x
refuse 1 "wax" bake box.obj -o x.glb --material adamantium
refuse 1 "--method: 'raytrace' is none of lambert" render box.obj -o x.png --method raytrace
refuse 1 "--method: 'referenz' is none of" render box.obj -o x.png --method referenz
refuse 1 "--light: wants AZ,EL" render box.obj -o x.png --light 12
refuse 1 "--light: " render box.obj -o x.png --light 0,91
refuse 1 "--light: " render box.obj -o x.png --light 0,0,1,-1,1
refuse 1 "--light: more than" render box.obj -o x.png $(printf -- '--light %d,0 ' $(seq 17))
refuse 1 "--camera: wants" render box.obj -o x.png --camera 0,0,0
refuse 1 "--resolution: wants" render box.obj -o x.png --resolution 640
refuse 1 "--resolution: wants" render box.obj -o x.png --resolution 640x0
refuse 1 "--resolution: wants" render box.obj -o x.png --resolution 640x480x3
refuse 1 "--background: wants R,G,B" render box.obj -o x.png --background 1,1
refuse 1 "--fov: 180 is out of range" render box.obj -o x.png --fov 180
refuse 1 "--use-bands: 7 is out of range" render box.obj -o x.png --use-bands 7
refuse 1 "--use-bands: 'some' is no whole number" render box.obj -o x.png --use-bands some
refuse 1 ".png or .exr" render box.obj -o x.jpg
refuse 1 ".glb, .obj, .ply or .stl" candle -o candle.fbx
refuse 1 "there are: bake, draw" bench cook
refuse 1 "--scale: wants" bench bake --scale 1000,x
refuse 1 "too few arguments" info
[ "$(ls)" = "$(printf 'box.obj\nstderr\nstdout')" ] || fail "something was written: $(ls)"

# both ways to give a value, and -- before names that begin with a dash
cp box.obj ./-box.obj
expect 0 info --json -- -box.obj
field '.triangles == 12'
finish
