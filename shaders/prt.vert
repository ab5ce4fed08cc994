// prt.vert - radiance at the vertices: the dot product of a transfer vector with the light's
// coefficients, a channel each (Sloan, Kautz, Snyder 2002). The vectors are too long for attributes
// and lie in a buffer, a row a position.
#include "frame.glsl"

layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
layout(location = 2) in uint a_row;

uniform mat4 u_clip;
uniform mat4 u_place;
uniform mat3 u_normal;

uniform samplerBuffer u_transfer; // rows of 3 channels of u_texels vec4
uniform int u_texels;
uniform vec4 u_incoming[27];      // light in the body's space, in the same order

centroid out vec3 v_position;
centroid out vec3 v_normal;
centroid out vec3 v_radiance;

void main()
{
    vec4 position = vec4(a_position, 1.0);
    gl_Position = u_clip * position;
    v_position = (u_place * position).xyz;
    v_normal = dph_unit(u_normal * a_normal);
    int first = int(a_row) * 3 * u_texels;
    vec3 sum = vec3(0.0);
    for (int i = 0; i < u_texels; i++) {
        sum.r += dot(texelFetch(u_transfer, first + i), u_incoming[i]);
        sum.g += dot(texelFetch(u_transfer, first + u_texels + i), u_incoming[u_texels + i]);
        sum.b += dot(texelFetch(u_transfer, first + 2 * u_texels + i), u_incoming[2 * u_texels + i]);
    }
    v_radiance = sum;
}
