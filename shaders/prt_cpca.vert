// prt_cpca.vert - radiance at the vertices from compressed transfer vectors: the cluster's mean and
// vectors have met the light on the CPU already (Sloan, Hall, Hart, Snyder 2003), and a vertex adds
// them up by its weights, three channels at once.
#include "frame.glsl"

layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
// weights as signed bytes, four a word, the first in the lowest bits; then the cluster's number
layout(location = 2) in uvec4 a_word[(DPH_WEIGHTS + 4) / 4];

uniform mat4 u_clip;
uniform mat4 u_place;
uniform mat3 u_normal;

uniform samplerBuffer u_table; // a cluster: radiance of the mean, then of 4 DPH_WEIGHTS vectors

centroid out vec3 v_position;
centroid out vec3 v_normal;
centroid out vec3 v_radiance;

void main()
{
    vec4 position = vec4(a_position, 1.0);
    gl_Position = u_clip * position;
    v_position = (u_place * position).xyz;
    v_normal = dph_unit(u_normal * a_normal);
    int at = int(a_word[DPH_WEIGHTS / 4][DPH_WEIGHTS % 4]) * (1 + 4 * DPH_WEIGHTS);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < DPH_WEIGHTS; i++) {
        int word = int(a_word[i / 4][i % 4]);
        vec4 weight = vec4(ivec4(word << 24, word << 16, word << 8, word) >> 24);
        for (int k = 0; k < 4; k++)
            sum += weight[k] * texelFetch(u_table, at + 1 + 4 * i + k).rgb;
    }
    v_radiance = texelFetch(u_table, at).rgb + sum / 127.0;
}
