// patro.vert - body.vert for changed normals, whose lengths mean something.
#include "frame.glsl"

layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;

uniform mat4 u_clip;
uniform mat4 u_place;
uniform mat3 u_normal;

centroid out vec3 v_position;
centroid out vec3 v_normal;

void main()
{
    vec4 position = vec4(a_position, 1.0);
    gl_Position = u_clip * position;
    v_position = (u_place * position).xyz;
    v_normal = dph_unit(u_normal * a_normal) * length(a_normal);
}
