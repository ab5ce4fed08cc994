// prt_cpca.vert - radiance at the vertices from compressed transfer vectors: the cluster's mean and
// vectors have met the light on the CPU already (Sloan, Hall, Hart, Snyder 2003), and a vertex adds
// them up by its weights, three channels at once.
#include "frame.glsl"

layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
layout(location = 2) in uint a_cluster;
layout(location = 3) in vec4 a_weight0;
layout(location = 4) in vec4 a_weight1;
layout(location = 5) in vec4 a_weight2;
layout(location = 6) in vec4 a_weight3;
layout(location = 7) in vec4 a_weight4;
layout(location = 8) in vec4 a_weight5;
layout(location = 9) in vec4 a_weight6;
layout(location = 10) in vec4 a_weight7;
layout(location = 11) in vec4 a_weight8;

uniform mat4 u_clip;
uniform mat4 u_place;
uniform mat3 u_normal;

uniform samplerBuffer u_table; // a cluster: radiance of the mean, then of 4 u_vectors vectors
uniform int u_vectors;         // vec4 of weights in use

centroid out vec3 v_position;
centroid out vec3 v_normal;
centroid out vec3 v_radiance;

void main()
{
    vec4 position = vec4(a_position, 1.0);
    gl_Position = u_clip * position;
    v_position = (u_place * position).xyz;
    v_normal = dph_unit(u_normal * a_normal);
    vec4 weight[9] = vec4[9](a_weight0, a_weight1, a_weight2, a_weight3, a_weight4, a_weight5,
                             a_weight6, a_weight7, a_weight8);
    int at = int(a_cluster) * (1 + 4 * u_vectors);
    vec3 sum = texelFetch(u_table, at).rgb;
    for (int i = 0; i < u_vectors; i++)
        for (int k = 0; k < 4; k++)
            sum += weight[i][k] * texelFetch(u_table, at + 1 + 4 * i + k).rgb;
    v_radiance = sum;
}
