/* Bakes a box of 10 x 20 x 30 from plain arrays and prints how thick it is along its diagonal, seen from one corner. */
#include <diaphan/diaphan.h>
#include <stdio.h>

int main(void)
{
    const float position[8][3] = {{0, 0, 0},  {10, 0, 0},  {10, 20, 0},  {0, 20, 0},
                                  {0, 0, 30}, {10, 0, 30}, {10, 20, 30}, {0, 20, 30}};
    const uint32_t index[12][3] = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}, {0, 1, 5}, {0, 5, 4},
                                   {3, 7, 6}, {3, 6, 2}, {0, 4, 7}, {0, 7, 3}, {1, 2, 6}, {1, 6, 5}};
    struct dph_bake_input box = {&position[0][0], 0, 8, &index[0][0], 12};
    struct dph_bake_params params = dph_bake_defaults();
    params.fit = DPH_FIT_SPHERE;
    float coefficient[8 * DPH_MAX_BANDS * DPH_MAX_BANDS];
    struct dph_error err;
    if (!dph_bake(&box, &params, coefficient, NULL, &err))
        return fprintf(stderr, "%s\n", err.message), 1;

    const double diagonal[3] = {0.26726124, 0.53452248, 0.80178373};
    double value[DPH_MAX_BANDS * DPH_MAX_BANDS], thickness = 0;
    dph_sh_eval(params.bands, diagonal, value);
    for (int i = 0; i < params.bands * params.bands; i++)
        thickness += (double)coefficient[i] * value[i]; /* row 0: the corner at the origin */
    printf("thickness along the diagonal: %.1f (exactly: 37.4)\n", thickness);
    return 0;
}
