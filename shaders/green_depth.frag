// green_depth.frag - distance from the light, linear, computed here: it is not linear across a
// triangle. The second number says that there is a surface.

in vec3 v_point;

layout(location = 0) out vec2 o_entry;

uniform vec4 u_from; // as GreenMap.from

void main()
{
    float way = u_from.w > 0.0 ? distance(u_from.xyz, v_point) : 2.0 - dot(u_from.xyz, v_point);
    o_entry = vec2(way, 1.0);
}
