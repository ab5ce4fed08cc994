/* Bakes a sphere of radius 10 from plain arrays and prints how thick it is at its top, straight
 * down. */
#include <diaphan/diaphan.h>
#include <math.h>
#include <stdio.h>

enum { RINGS = 48, SECTORS = 96 };
static float position[RINGS + 1][SECTORS]
                     [3]; /* equal points at the poles and nowhere else: they are welded */
static uint32_t index[RINGS * SECTORS * 2][3];
static float coefficient[(RINGS + 1) * SECTORS * DPH_MAX_BANDS * DPH_MAX_BANDS];

int main(void)
{
    for (int i = 0; i <= RINGS; i++)
        for (int j = 0; j < SECTORS; j++) {
            double theta = 3.14159265358979 * i / RINGS, phi = 6.28318530717959 * j / SECTORS;
            double r = i % RINGS ? 10 * sin(theta) : 0;
            position[i][j][0] = (float)(r * cos(phi));
            position[i][j][1] = (float)(r * sin(phi));
            position[i][j][2] = (float)(10 * cos(theta));
        }
    for (uint32_t i = 0, t = 0; i < RINGS; i++)
        for (uint32_t j = 0; j < SECTORS; j++) {
            uint32_t next = (j + 1) % SECTORS, a = i * SECTORS + j, b = i * SECTORS + next;
            const uint32_t quad[6] = {a, a + SECTORS, b, b, a + SECTORS, b + SECTORS};
            for (int k = 0; k < 6; k++)
                index[t + k / 3][k % 3] = quad[k];
            t += 2;
        }

    struct dph_bake_input sphere = {&position[0][0][0], 0, (RINGS + 1) * SECTORS, &index[0][0],
                                    RINGS * SECTORS * 2};
    struct dph_bake_params params = dph_bake_defaults();
    params.fit = DPH_FIT_SPHERE;
    struct dph_error err;
    if (!dph_bake(&sphere, &params, coefficient, NULL, &err))
        return fprintf(stderr, "%s\n", err.message), 1;

    const double down[3] = {0, 0, -1};
    double value[DPH_MAX_BANDS * DPH_MAX_BANDS], thickness = 0;
    dph_sh_eval(params.bands, down, value);
    for (int i = 0; i < params.bands * params.bands; i++)
        thickness += (double)coefficient[i] * value[i]; /* row 0: a vertex at the top */
    printf("thickness through the middle: %.2f (exactly 20, in six bands 19.38)\n", thickness);
    return 0;
}
