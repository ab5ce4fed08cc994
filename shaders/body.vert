// body.vert - the vertex stage of all methods: places a body and, where coefficients are bound,
// sums its thickness towards each light.
//
// Nine dot products a light (Tomaszewska, Stefanowski 2012, with the six partial sums of their
// listing drawn together).
#include "frame.glsl"

layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
#if DPH_VECTORS > 0
layout(location = 2) in vec4 a_sh0;
#endif
#if DPH_VECTORS > 1
layout(location = 3) in vec4 a_sh1;
#endif
#if DPH_VECTORS > 2
layout(location = 4) in vec4 a_sh2;
#endif
#if DPH_VECTORS > 3
layout(location = 5) in vec4 a_sh3;
#endif
#if DPH_VECTORS > 4
layout(location = 6) in vec4 a_sh4;
#endif
#if DPH_VECTORS > 5
layout(location = 7) in vec4 a_sh5;
#endif
#if DPH_VECTORS > 6
layout(location = 8) in vec4 a_sh6;
#endif
#if DPH_VECTORS > 7
layout(location = 9) in vec4 a_sh7;
#endif
#if DPH_VECTORS > 8
layout(location = 10) in vec4 a_sh8;
#endif

#ifdef DPH_CLUSTERED
// coefficients are weights of the vectors of a cluster; they sum to what it lacks to its mean
layout(location = 11) in uint a_cluster;
// a row a cluster, 1 + DPH_VECTORS texels a light: what the light makes of the mean (in x), and of
// four vectors each
uniform sampler2D u_table;
#endif

uniform mat4 u_clip;   // body to clip space
uniform mat4 u_place;  // body to positions relative to the camera
uniform mat3 u_normal; // inverse transpose of the placement, up to a positive factor

// centroid: at the edge of a triangle nothing is extrapolated beyond it, which would show as a
// fringe
centroid out vec3 v_position;
centroid out vec3 v_normal;
#if DPH_VECTORS > 0
centroid out float v_thickness[DPH_LIGHTS];
#endif

void main()
{
    vec4 position = vec4(a_position, 1.0);
    gl_Position = u_clip * position;
    v_position = (u_place * position).xyz;
    v_normal = dph_unit(u_normal * a_normal);
#if DPH_VECTORS > 0
    vec4 coefficient[DPH_VECTORS];
    coefficient[0] = a_sh0;
#if DPH_VECTORS > 1
    coefficient[1] = a_sh1;
#endif
#if DPH_VECTORS > 2
    coefficient[2] = a_sh2;
#endif
#if DPH_VECTORS > 3
    coefficient[3] = a_sh3;
#endif
#if DPH_VECTORS > 4
    coefficient[4] = a_sh4;
#endif
#if DPH_VECTORS > 5
    coefficient[5] = a_sh5;
#endif
#if DPH_VECTORS > 6
    coefficient[6] = a_sh6;
#endif
#if DPH_VECTORS > 7
    coefficient[7] = a_sh7;
#endif
#if DPH_VECTORS > 8
    coefficient[8] = a_sh8;
#endif
    for (int i = 0; i < DPH_LIGHTS; i++) {
#ifdef DPH_CLUSTERED
        ivec2 at = ivec2(i * (1 + DPH_VECTORS), int(a_cluster));
        vec4 value[DPH_VECTORS];
        for (int j = 0; j < DPH_VECTORS; j++)
            value[j] = texelFetch(u_table, at + ivec2(1 + j, 0), 0);
        v_thickness[i] = texelFetch(u_table, at, 0).x + dph_thickness(coefficient, value);
#else
        v_thickness[i] = dph_thickness(coefficient, u_light[i].sh);
#endif
    }
#endif
}
