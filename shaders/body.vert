// body.vert - the vertex stage of all methods: places a body and, where coefficients are bound,
// sums its thickness towards each light.
//
// Nine dot products a light (Tomaszewska, Stefanowski 2012, with the six partial sums of their
// listing drawn together).
#include "frame.glsl"

#if DPH_VECTORS > 0
// Rows of 32-bit words: the position's bits and word 0 of what is stored, the normal's and word 1,
// and the other words, four an attribute. The first eight bytes come with what is fetched anyway.
#ifdef DPH_CLUSTERED
#define WORDS (DPH_VECTORS + 1)
#else
#define WORDS (DPH_VECTORS * DPH_BYTES)
#endif
layout(location = 0) in uvec4 a_first;
layout(location = 1) in uvec4 a_second;
#define a_position uintBitsToFloat(a_first.xyz)
#define a_normal uintBitsToFloat(a_second.xyz)
#if WORDS > 2
layout(location = 2) in uvec4 a_word[(WORDS + 1) / 4];
#endif

uint word_at(int i)
{
#if WORDS > 2
    if (i > 1)
        return a_word[(i - 2) / 4][(i - 2) % 4];
#endif
    return i > 0 ? a_second.w : a_first.w;
}

// Four components: floats, or signed integers, four bytes or two shorts a word, the first in the
// lowest bits. What makes integers numbers up to 1 is in the light's values.
vec4 coefficient_at(int i)
{
#if DPH_BYTES == 4
    return uintBitsToFloat(
        uvec4(word_at(4 * i), word_at(4 * i + 1), word_at(4 * i + 2), word_at(4 * i + 3)));
#elif DPH_BYTES == 2
    int low = int(word_at(2 * i)), high = int(word_at(2 * i + 1));
    return vec4(ivec4(low << 16, low, high << 16, high) >> 16);
#else
    int word = int(word_at(i));
    return vec4(ivec4(word << 24, word << 16, word << 8, word) >> 24);
#endif
}
#else
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
#endif

#ifdef DPH_CLUSTERED
// Coefficients are weights of the vectors of a cluster; they sum to what it lacks to its mean. The
// last word is the cluster's number.
//
// u_table: a row a cluster, 1 + DPH_VECTORS texels a light: what the light makes of the mean (in x),
// and of four vectors each.
uniform sampler2D u_table;
uniform float u_weight; // what makes a weight of an integer
#endif

uniform mat4 u_clip;   // body to clip space
uniform mat4 u_place;  // body to positions relative to the camera
uniform mat3 u_normal; // inverse transpose of the placement, up to a positive factor

// centroid: at the edge of a triangle nothing is extrapolated beyond it, which would show as a
// fringe
centroid out vec3 v_position;
#if DPH_VECTORS > 0
// what is interpolated goes in fours: normal, and thickness towards the first light; towards others
centroid out vec4 v_surface;
#if DPH_LIGHTS > 1
centroid out vec4 v_more[(DPH_LIGHTS + 2) / 4];
#endif
#ifdef DPH_PROBE
out float v_thickness;
#endif
#else
centroid out vec3 v_normal;
#endif

void main()
{
    vec4 position = vec4(a_position, 1.0);
    gl_Position = u_clip * position;
    v_position = (u_place * position).xyz;
    vec3 normal = dph_unit(u_normal * a_normal);
#if DPH_VECTORS > 0
    vec4 coefficient[DPH_VECTORS];
    for (int i = 0; i < DPH_VECTORS; i++)
        coefficient[i] = coefficient_at(i);
    float thickness[DPH_LIGHTS];
    for (int i = 0; i < DPH_LIGHTS; i++) {
#ifdef DPH_CLUSTERED
        ivec2 at = ivec2(i * (1 + DPH_VECTORS), int(word_at(DPH_VECTORS)));
        vec4 value[DPH_VECTORS];
        for (int j = 0; j < DPH_VECTORS; j++)
            value[j] = texelFetch(u_table, at + ivec2(1 + j, 0), 0);
        thickness[i] =
            texelFetch(u_table, at, 0).x + u_weight * dph_thickness(coefficient, value);
#else
        thickness[i] = dph_thickness(coefficient, u_light[i].sh);
#endif
#ifdef DPH_VIEW
        thickness[i] = dph_response_seen(u_light[i].view, coefficient[0], thickness[i]);
#endif
    }
    v_surface = vec4(normal, thickness[0]);
#if DPH_LIGHTS > 1
    for (int i = 1; i < DPH_LIGHTS; i++)
        v_more[(i - 1) / 4][(i - 1) % 4] = thickness[i];
#endif
#ifdef DPH_PROBE
    v_thickness = thickness[0];
#endif
#else
    v_normal = normal;
#endif
}
