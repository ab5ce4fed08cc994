// thickness.frag - the thickness towards the first light, in grey.
#include "surface.glsl"

uniform float u_gain; // grey per millimetre

void main()
{
    o_color = vec4(vec3(max(surface_thickness(0), 0.0) * u_gain), 1.0);
}
