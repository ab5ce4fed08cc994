/* Gathering over the octree (see octree.c), eight children, eight samples and eight columns at a
 * time. Compiled with AVX2 and without; equal to the bit.
 *
 * From the root down, a group is taken as one sample where its extent^2 is below `solid_angle`
 * times the squared distance of its centre; else its children are looked at. The extent is the
 * larger of area and longest side squared, so a group's own box is far behind the point when it
 * passes, and no test whether the point is inside is needed. What is taken is listed; for a full
 * list the kernel's values follow, for all channels from one walk, and then the sums of the
 * rows.
 *
 * A sample stands for a disc of its area. Far away K A is its integral. Nearby (area > .05 r^2,
 * within eight radii) K may fall steeply over it, most of all where samples are sparser than the
 * mean free path, and the disc is integrated: seen from the point, its part at distance rho is
 * an arc of the share f(rho) of a circle, and the integral of 2 pi rho K from rho outwards is
 * known, say F:
 *
 *   integral = F(0) - F(a - r) if r < a, plus the sum over rings of  f (F(rho) - F(rho'))
 *   f = acos((rho^2 + r^2 - a^2) / (2 rho r)) / pi
 *
 *   dipole  F = a'/2 sum of z exp(-s d) / d        exp  F = 2 pi l exp(-rho / l)        gauss  F = 2 pi l^2 exp(-rho^2 / (2 l^2))
 *
 * The seven rings' areas do not add up to the disc exactly; the result is scaled by what is
 * missing. */
#include "bake/octree_kernel.h"

#include "core/simd.h"

#include <math.h>
#ifdef __AVX2__
#include <immintrin.h>
#endif

enum { LIST = 1024, STACK = 512 };

static const float near_share = 0.05f;

/* What was taken, near samples and others. */
struct list {
    int far, near;
    float r2[LIST], area[LIST], near_r2[LIST], near_area[LIST];
    const float *row[LIST], *near_row[LIST];
    float weight[3][LIST];
};

/* One channel's kernel in single precision. */
struct channel {
    float at, beyond;      /* factors of K and of F                                                */
    float rate, z[2], z2[2];
    float total;           /* F(0)                                                                 */
};

static inline dph_f8 sqrt8(dph_f8 x)
{
#ifdef __AVX2__
    return (dph_f8)_mm256_sqrt_ps((__m256)x);
#else
    for (int i = 0; i < 8; i++)
        x[i] = sqrtf(x[i]);
    return x;
#endif
}

/* exp(-x) for x >= 0, beyond 80 as at 80. */
static inline dph_f8 decay(dph_f8 x)
{
    return dph_f8_exp(-dph_f8_min(x, dph_f8_set(80)));
}

/* K at squared distances. */
static inline dph_f8 kernel_at(enum dph_kernel_kind kind, const struct channel *c, dph_f8 r2)
{
    if (kind == DPH_KERNEL_GAUSS)
        return c->at * decay(r2 * c->rate);
    if (kind == DPH_KERNEL_EXP) {
        dph_f8 r = sqrt8(r2);
        return c->at * decay(r * c->rate) / r;
    }
    dph_f8 sum = dph_f8_set(0);
    for (int i = 0; i < 2; i++) {
        dph_f8 d2 = r2 + c->z2[i], d = sqrt8(d2), path = d * c->rate;
        sum += c->z[i] * (path + 1) * decay(path) / (d2 * d);
    }
    return c->at * sum;
}

/* F at squared distances. */
static inline dph_f8 kernel_beyond(enum dph_kernel_kind kind, const struct channel *c, dph_f8 r2)
{
    if (kind == DPH_KERNEL_GAUSS)
        return c->beyond * decay(r2 * c->rate);
    if (kind == DPH_KERNEL_EXP)
        return c->beyond * decay(sqrt8(r2) * c->rate);
    dph_f8 sum = dph_f8_set(0);
    for (int i = 0; i < 2; i++) {
        dph_f8 d = sqrt8(r2 + c->z2[i]);
        sum += c->z[i] * decay(d * c->rate) / d;
    }
    return c->beyond * sum;
}

static void set_channel(const struct dph_gather *gather, int i, struct channel *c)
{
    const double pi = 3.14159265358979323846;
    const struct dph_dipole *dipole = &gather->dipole[i];
    double length = gather->length[i];
    switch (gather->kind) {
    case DPH_KERNEL_DIPOLE:
        *c = (struct channel){.at = (float)(dipole->albedo / (4 * pi)), .beyond = (float)(dipole->albedo / 2),
                              .rate = (float)dipole->transport,
                              .z = {(float)dipole->real, (float)dipole->image}};
        c->z2[0] = c->z[0] * c->z[0];
        c->z2[1] = c->z[1] * c->z[1];
        break;
    case DPH_KERNEL_EXP:
        *c = (struct channel){.at = 1, .beyond = (float)(2 * pi * length), .rate = (float)(1 / length)};
        break;
    case DPH_KERNEL_GAUSS:
        *c = (struct channel){.at = 1, .beyond = (float)(2 * pi * length * length),
                              .rate = (float)(1 / (2 * length * length))};
        break;
    }
    c->total = kernel_beyond(gather->kind, c, dph_f8_set(0))[0];
}

/* acos over pi by Hastings' polynomial (Abramowitz and Stegun, 4.4.45), to 2e-5; the argument is
 * cut to [-1, 1]. */
static inline dph_f8 arc_share(dph_f8 x)
{
    x = dph_f8_min(dph_f8_max(x, dph_f8_set(-1)), dph_f8_set(1));
    dph_f8 a = (dph_f8)((dph_i8)x & 0x7fffffff);
    dph_f8 p = dph_f8_set(-0.0187293f);
    p = p * a + 0.0742610f;
    p = p * a - 0.2121144f;
    p = p * a + 1.5707288f;
    dph_f8 share = sqrt8(1 - a) * p * 0.318309886f;
    return dph_f8_select(x < 0, 1 - share, share);
}

/* Integrals over a disc of this area at distance r, by channel. */
static void disc(const struct dph_gather *gather, const struct channel *channel, float r2, float area,
                 float weight[3])
{
    const dph_f8 steps = {0, 1 / 7.0f, 2 / 7.0f, 3 / 7.0f, 4 / 7.0f, 5 / 7.0f, 6 / 7.0f, 1};
    float r = sqrtf(r2), a = sqrtf(area * 0.318309886f);
    if (r < 1e-4f * a) {
        dph_f8 edge = dph_f8_set(a * a);
        for (int c = 0; c < gather->channels; c++)
            weight[c] = channel[c].total - kernel_beyond(gather->kind, &channel[c], edge)[0];
        return;
    }
    float inner = fabsf(a - r), width = a + r - inner;
    dph_f8 rho = inner + width * steps;
    dph_f8 outer = __builtin_shufflevector(rho, rho, 1, 2, 3, 4, 5, 6, 7, 7);
    dph_f8 middle = 0.5f * (rho + outer);
    dph_f8 share = arc_share((middle * middle + (r2 - a * a)) / (2 * r * middle));
    dph_f8 ring = share * (outer * outer - rho * rho); /* the last one is empty */
    float covered = r < a ? inner * inner : 0;
    for (int i = 0; i < 7; i++)
        covered += ring[i];
    for (int c = 0; c < gather->channels; c++) {
        dph_f8 beyond = kernel_beyond(gather->kind, &channel[c], rho * rho);
        dph_f8 next = __builtin_shufflevector(beyond, beyond, 1, 2, 3, 4, 5, 6, 7, 7);
        dph_f8 part = share * (beyond - next);
        float sum = r < a ? channel[c].total - beyond[0] : 0;
        for (int i = 0; i < 7; i++)
            sum += part[i];
        weight[c] = sum * (a * a / covered);
    }
}

/* Whether a row's normal makes an acute angle with the point's. */
static inline bool faces(const float *row, const float *normal)
{
    return row[0] * normal[0] + row[1] * normal[1] + row[2] * normal[2] > 0;
}

/* Adds what is listed to the sums and empties the list. */
static void flush(const struct dph_gather *gather, const struct channel *channel, struct list *list,
                  const float *normal, size_t stride, float *out)
{
    int channels = gather->channels, count = list->far;
    for (int i = count; i & 7; i++) /* the last eight are worked out whole */
        list->r2[i] = 1, list->area[i] = 0;
    for (int i = 0; i < count; i += 8) {
        dph_f8 r2 = dph_f8_load(list->r2 + i), area = dph_f8_load(list->area + i);
        for (int c = 0; c < channels; c++)
            dph_f8_store(list->weight[c] + i, area * kernel_at(gather->kind, &channel[c], r2));
    }
    for (int pass = 0; pass < 2; pass++) {
        const float **row = pass ? list->near_row : list->row;
        if (pass) {
            count = list->near;
            for (int i = 0; i < count; i++) {
                float weight[3];
                disc(gather, channel, list->near_r2[i], list->near_area[i], weight);
                for (int c = 0; c < channels; c++)
                    list->weight[c][i] = weight[c];
            }
        }
        for (int i = 0; gather->same_side && i < count; i++)
            for (int c = 0; c < channels && !faces(row[i], normal); c++)
                list->weight[c][i] = 0;
        for (size_t k = 0; k < stride; k += 8) {
            dph_f8 sum[3];
            for (int c = 0; c < channels; c++)
                sum[c] = dph_f8_load(out + (size_t)c * stride + k);
            if (channels == 3)
                for (int i = 0; i < count; i++) {
                    dph_f8 v = dph_f8_load(row[i] + k);
                    sum[0] += v * list->weight[0][i];
                    sum[1] += v * list->weight[1][i];
                    sum[2] += v * list->weight[2][i];
                }
            else
                for (int c = 0; c < channels; c++)
                    for (int i = 0; i < count; i++)
                        sum[c] += dph_f8_load(row[i] + k) * list->weight[c][i];
            for (int c = 0; c < channels; c++)
                dph_f8_store(out + (size_t)c * stride + k, sum[c]);
        }
    }
    list->far = list->near = 0;
}

static void gather(const struct dph_octree *tree, const struct dph_gather *gather, const float point[3],
                   const float *normal, float *out)
{
    struct list list;
    struct channel channel[3];
    int32_t stack[STACK];
    size_t stride = tree->stride;
    float reach2 = (float)(gather->reach * gather->reach), limit = (float)gather->solid_angle;
    for (int c = 0; c < gather->channels; c++)
        set_channel(gather, c, &channel[c]);
    memset(out, 0, (size_t)gather->channels * stride * sizeof *out);
    list.far = list.near = 0;
    int depth = 0;
    stack[depth++] = 0;
    while (depth) {
        const struct dph_octree_block *block = &tree->block[stack[--depth]];
        dph_f8 x = dph_f8_load(block->x) - point[0], y = dph_f8_load(block->y) - point[1];
        dph_f8 z = dph_f8_load(block->z) - point[2], r2 = x * x + y * y + z * z;
        dph_i8 far = dph_f8_load(block->size) < limit * r2, out_of_reach = r2 > reach2;
        dph_i8 near = dph_f8_load(block->area) > near_share * r2;
        for (int i = 0; i < 8; i++) {
            int32_t child = block->child[i];
            if (child == -2)
                continue;
            if (child >= 0 && !far[i]) {
                stack[depth++] = child;
                continue;
            }
            if (out_of_reach[i])
                continue;
            const float *row = child < 0 ? tree->row + block->row[i] * stride : tree->mean + (size_t)child * stride;
            if (child < 0 && near[i]) {
                list.near_r2[list.near] = r2[i];
                list.near_area[list.near] = block->area[i];
                list.near_row[list.near++] = row;
            } else {
                list.r2[list.far] = r2[i];
                list.area[list.far] = block->area[i];
                list.row[list.far++] = row;
            }
        }
        if (list.far > LIST - 16 || list.near > LIST - 16)
            flush(gather, channel, &list, normal, stride, out);
    }
    flush(gather, channel, &list, normal, stride, out);
}

const struct dph_octree_kernel DPH_KERNEL(dph_octree_kernel) = {.gather = gather};
