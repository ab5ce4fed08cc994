// green_blur.frag - one direction of a Gaussian over (distance, 1) and (0, 0): weights add up in the
// second number, so only texels that see the body are averaged. Beyond the map there is nothing.

layout(location = 0) out vec2 o_entry;

uniform sampler2DArray u_source;
uniform int u_layer, u_level;
uniform int u_axis;   // 0: along x
uniform float u_rate; // 1 / (2 sigma^2), in texels of the level; 0: no blur
uniform int u_reach;  // texels on either side

void main()
{
    ivec2 here = ivec2(gl_FragCoord.xy), size = textureSize(u_source, u_level).xy;
    vec2 sum = vec2(0.0);
    for (int k = -u_reach; k <= u_reach; k++) {
        ivec2 at = here + (u_axis == 0 ? ivec2(k, 0) : ivec2(0, k));
        if (all(greaterThanEqual(at, ivec2(0))) && all(lessThan(at, size)))
            sum += exp(-u_rate * float(k * k)) *
                   texelFetch(u_source, ivec3(at, u_layer), u_level).rg;
    }
    o_entry = sum;
}
