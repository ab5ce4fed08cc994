// green_probe.vert - the thickness of the first depth map at the vertices, to be read back.
#include "frame.glsl"
#include "green.glsl"

layout(location = 0) in vec3 a_position;

uniform mat4 u_clip;
uniform mat4 u_place;
uniform mat3 u_normal;

out float v_thickness;

void main()
{
    gl_Position = u_clip * vec4(a_position, 1.0);
    v_thickness = green_thickness(0, (u_place * vec4(a_position, 1.0)).xyz + u_eye);
}
