/* The inner loop of a bounce (see visibility.c): one multiply-add of three interpolated rows for every position and direction that sees the body. */
#include "bake/visibility_kernel.h"

#include "core/simd.h"

#include <math.h>

/* Barycentric weights of the point q in the triangle a, b, c: ratios of areas, kept within the triangle against rounding. */
static void barycentric(const float q[3], float p[3][3], float weight[3])
{
    float e1[3], e2[3], to[3];
    for (int k = 0; k < 3; k++) {
        e1[k] = p[1][k] - p[0][k];
        e2[k] = p[2][k] - p[0][k];
        to[k] = q[k] - p[0][k];
    }
    float d11 = 0, d12 = 0, d22 = 0, t1 = 0, t2 = 0;
    for (int k = 0; k < 3; k++) {
        d11 += e1[k] * e1[k];
        d12 += e1[k] * e2[k];
        d22 += e2[k] * e2[k];
        t1 += to[k] * e1[k];
        t2 += to[k] * e2[k];
    }
    float det = d11 * d22 - d12 * d12;
    float b = det > 0 ? (d22 * t1 - d12 * t2) / det : 0, c = det > 0 ? (d11 * t2 - d12 * t1) / det : 0;
    b = b > 0 ? b < 1 ? b : 1 : 0;
    c = c > 0 ? c < 1 - b ? c : 1 - b : 0;
    weight[0] = 1 - b - c;
    weight[1] = b;
    weight[2] = c;
}

static void bounce(const struct dph_bounce *bounce, const float d[3], const float *distance,
                   const int32_t *near, size_t begin, size_t end)
{
    size_t stride = bounce->stride;
    for (size_t i = begin; i < end; i++) {
        float mu = bounce->nx[i] * d[0] + bounce->ny[i] * d[1] + bounce->nz[i] * d[2];
        /* the inside of a triangle sends nothing: the ray has begun in matter, or the mesh is open */
        if (!(mu > 0) || !(distance[i] > 0) || near[i] < 0)
            continue;
        float t = distance[i] / bounce->unit, p[3][3], w[3];
        const float q[3] = {bounce->x[i] + t * d[0], bounce->y[i] + t * d[1], bounce->z[i] + t * d[2]};
        const uint32_t *corner = bounce->corner + 3 * (size_t)near[i];
        for (int k = 0; k < 3; k++) {
            p[k][0] = bounce->x[corner[k]];
            p[k][1] = bounce->y[corner[k]];
            p[k][2] = bounce->z[corner[k]];
        }
        barycentric(q, p, w);
        dph_f8 wa = dph_f8_set(mu * bounce->weight * w[0]), wb = dph_f8_set(mu * bounce->weight * w[1]);
        dph_f8 wc = dph_f8_set(mu * bounce->weight * w[2]);
        const float *a = bounce->from + corner[0] * stride, *b = bounce->from + corner[1] * stride;
        const float *c = bounce->from + corner[2] * stride;
        float *out = bounce->out + i * stride;
        for (size_t k = 0; k < stride; k += 8)
            dph_f8_store(out + k, dph_f8_load(out + k) + wa * dph_f8_load(a + k) +
                                      wb * dph_f8_load(b + k) + wc * dph_f8_load(c + k));
    }
}

const struct dph_visibility_kernel DPH_KERNEL(dph_visibility_kernel) = {.bounce = bounce};
