/* What a direction of sight sees over the average of all.
 *
 * A response is an average over views, a picture is one view. How the two differ has much in common
 * over a body: light goes on in the direction in which it flows, so that more of it is seen against
 * the light and less with the light in the back; of a thin part an eye sees the more the longer its
 * way through it is; and where it is dim the light has gone a long way and has forgotten more of
 * where it came from. What a vertex knows of this are the first two bands of its root: the mean, and
 * the direction from which it gets most light, which is the normal on a thick body and the lesser the
 * thinner it is, and the root for the light itself. So the gain, the quotient of the two, is a
 * polynomial of second degree of these, with coefficients of second degree in the cosine between
 * light and eye, which a frame knows. The fit minimises, over positions x, views v and lights l,
 *
 *     integral of (gain p - L)^2,     gain = sum_i g_i t_i,
 *
 * L being the radiance that v sees, hence
 *
 *     sum_j (integral t_i t_j p^2) g_j = integral t_i p L.
 *
 * A pull of a thousandth of each diagonal towards gain 1 keeps what a body leaves open (one without
 * light, or all of it flat) from running away. */
#include "bake/view_gain.h"

#include "core/cholesky.h"

#include <diaphan/sh.h>

#include <assert.h>
#include <math.h>

enum { N = DPH_VIEW_TERMS, EACH = N / 3 };

#define PI 3.14159265358979323846
#define PULL 1e-3
#define MOST 4

struct dph_view_gain dph_view_even(void)
{
    return (struct dph_view_gain){{1}};
}

bool dph_view_applies(const struct dph_response *response)
{
    return response->form == DPH_RESPONSE_ROOT && response->channel[0] &&
           response->channel[0]->store != DPH_STORE_CPCA;
}

void dph_view_terms(double light_eye, const double q[4], double term[N])
{
    double power = 1;
    for (int k = 0; k < 3; k++, power *= light_eye) {
        *term++ = power;
        for (int i = 0; i < 4; i++)
            *term++ = power * q[i];
        for (int i = 0; i < 4; i++)
            for (int j = i; j < 4; j++)
                *term++ = power * q[i] * q[j];
    }
}

void dph_view_arguments(const double first[4], const double to_light[3], const double to_eye[3],
                        double value, double q[4])
{
    double y[2][4];
    dph_sh_eval(2, to_eye, y[0]);
    dph_sh_eval(2, to_light, y[1]);
    q[0] = first[0] * y[0][0];
    q[1] = q[2] = 0;
    for (int i = 1; i < 4; i++) {
        q[1] += first[i] * y[0][i];
        q[2] += first[i] * y[1][i];
    }
    q[3] = sqrt(fmax(value, 0));
    for (int i = 0; i < 4; i++)
        q[i] *= sqrt(PI);
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

double dph_response_view(const struct dph_response *response, size_t vertex,
                         const double to_light[3], const double to_eye[3])
{
    float row[DPH_MAX_BANDS * DPH_MAX_BANDS];
    double first[4] = {0}, q[4], term[N], sum = 0;
    assert(dph_view_applies(response) && vertex < response->nvert);
    dph_thickness_row(response->channel[0], vertex, row);
    for (int i = 0; i < 4 && i < response->bands * response->bands; i++)
        first[i] = (double)row[i];
    dph_view_arguments(first, to_light, to_eye, dph_response_value(response, vertex, to_light), q);
    dph_view_terms(dot(to_light, to_eye), q, term);
    for (int k = 0; k < N; k++)
        sum += (double)response->view.term[k] * term[k];
    return fmin(fmax(sum, 0), MOST);
}

void dph_view_constants(const struct dph_response *response, const double to_light[3],
                        const double to_eye[3], struct dph_view_constants *constants)
{
    double sum[EACH] = {0}, power = 1, c = dot(to_light, to_eye), y[2][4];
    const float *scale = response->channel[0]->scale;
    assert(dph_view_applies(response));
    dph_sh_eval(2, to_eye, y[0]);
    dph_sh_eval(2, to_light, y[1]);
    constants->mean = (float)(sqrt(PI) * y[0][0] * (double)scale[0]);
    for (int i = 0; i < 3; i++) {
        double factor = response->bands > 1 ? sqrt(PI) * (double)scale[1] : 0;
        constants->eye[i] = (float)(factor * y[0][1 + i]);
        constants->light[i] = (float)(factor * y[1][1 + i]);
    }
    for (int k = 0; k < N; k++) {
        power *= k && k % EACH == 0 ? c : 1;
        sum[k % EACH] += power * (double)response->view.term[k];
    }
    /* of u in the place of q_3 */
    double unit = sqrt(PI * (double)response->ramp.top);
    const double by[4] = {1, 1, 1, unit};
    constants->even = (float)sum[0];
    for (int i = 0, k = 5; i < 4; i++) {
        constants->linear[i] = (float)(sum[1 + i] * by[i]);
        for (int j = i; j < 4; j++, k++) {
            float *to = i == j   ? &constants->square[i]
                        : i == 0 ? &constants->mixed[j - 1]
                                 : &constants->cross[i + j - 3];
            *to = (float)(sum[k] * by[i] * by[j]);
        }
    }
}

void dph_view_add(struct dph_view_equations *sum, const struct dph_view_equations *more)
{
    for (int k = 0; k < N * (N + 1) / 2; k++)
        sum->matrix[k] += more->matrix[k];
    for (int k = 0; k < N; k++)
        sum->right[k] += more->right[k];
}

struct dph_view_gain dph_view_solve(const struct dph_view_equations *equations)
{
    const double *matrix = equations->matrix;
    double factor[N * (N + 1) / 2], x[N];
    struct dph_view_gain gain;
    if (!(matrix[0] > 0))
        return dph_view_even();
    /* for gain - 1, whose matrix is the same */
    for (int i = 0, k = 0; i < N; i++) {
        x[i] = equations->right[i] - matrix[i * (i + 1) / 2];
        for (int j = 0; j <= i; j++, k++)
            factor[k] = matrix[k] * (i == j ? 1 + PULL : 1);
    }
    dph_cholesky_solve(N, factor, x); /* what no position has a share in is left even */
    for (int i = 0; i < N; i++)
        gain.term[i] = (float)(x[i] + (i == 0));
    return gain;
}
