// green_depth.vert - a body as the light sees it. It is pushed outward, so that points at the rim find
// themselves in the map; the distance stays that of the point itself.

layout(location = 0) in vec3 a_position;
layout(location = 15) in vec4 a_outward;

uniform mat4 u_place;  // body to positions relative to the scene's centre
uniform mat3 u_normal;
uniform mat4 u_light;  // these to the map's clip space
uniform float u_grow;

out vec3 v_point;

void main()
{
    vec3 normal = u_normal * a_outward.xyz;
    normal *= inversesqrt(max(dot(normal, normal), 1e-30));
    v_point = (u_place * vec4(a_position, 1.0)).xyz;
    gl_Position = u_light * vec4(v_point + u_grow * normal, 1.0);
}
