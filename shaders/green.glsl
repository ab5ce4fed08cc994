// green.glsl - thickness from depth maps: the distance of a point from the light less that at which
// its ray of light entered.
//
// Points are relative to the scene's centre and in units of its radius. A map holds, at every texel
// that sees the body, (distance of the first surface, 1), elsewhere (0, 0): sums of texels keep
// their weights, and the quotient never mixes in what is not there.

struct GreenMap {
    mat4 clip; // to the map's clip space
    vec4 from; // point and spot lights: where they stand, 1; distant lights: direction to them, 0
};

uniform GreenMap u_green[DPH_LIGHTS];
uniform sampler2DArray u_map; // a layer a light
uniform float u_bias;         // shorter ways count as none
uniform float u_millimetres;  // of one radius
uniform vec3 u_eye;           // the camera, relative to the scene's centre

float green_distance(vec4 from, vec3 point)
{
    return from.w > 0.0 ? distance(from.xyz, point) : 2.0 - dot(from.xyz, point);
}

// In mm, not negative; 0 outside the map and where nothing was seen.
float green_thickness(int i, vec3 point)
{
    vec4 q = u_green[i].clip * vec4(point, 1.0);
    if (q.w <= 0.0 || any(greaterThan(abs(q.xy), vec2(q.w))))
        return 0.0;
    vec2 entry = textureLod(u_map, vec3(0.5 * q.xy / q.w + 0.5, float(i)), 0.0).rg;
    if (entry.g <= 0.0)
        return 0.0;
    float way = green_distance(u_green[i].from, point) - entry.r / entry.g - u_bias;
    return max(way, 0.0) * u_millimetres;
}
