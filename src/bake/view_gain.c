/* What a direction of sight sees over the average of all.
 *
 * A response is an average over views, a picture is one view. How the two differ has much in common
 * over a body: light goes on in the direction in which it flows, so that more of it is seen against
 * the light and less with the light in the back (l.v); what is lit from in front looks different
 * from the side than from above (n.l, n.v); and where it is dim the light has gone a long way and
 * has forgotten more of where it came from (p). So the gain, the quotient of the two, is a
 * polynomial of these. It is linear in the normal and goes with the root that a vertex knows: a
 * frame's light and eye make four numbers and a vector of it, and a vertex has a dot product and
 * two multiply-adds to do. The fit minimises, over positions x, views v and lights l,
 *
 *     integral of (gain p - L)^2,     gain = sum_i g_i t_i,
 *
 * L being the radiance that v sees, hence
 *
 *     sum_j (integral t_i t_j p^2) g_j = integral t_i p L.
 *
 * A pull of a thousandth of each diagonal towards gain 1 keeps what a body leaves open (one without
 * light, or all of it flat) from running away. Solved by Cholesky's method. */
#include "bake/view_gain.h"

#include <math.h>

enum { N = DPH_VIEW_TERMS };

#define PI 3.14159265358979323846
#define PULL 1e-3
#define MOST 4

struct dph_view_gain dph_view_even(void)
{
    return (struct dph_view_gain){{1}};
}

void dph_view_terms(double normal_light, double normal_eye, double light_eye, double value,
                    double term[N])
{
    double s = sqrt(PI * fmax(value, 0)), power = 1;
    for (int k = 0; k < N; k += 5, power *= light_eye) {
        term[k] = power;
        term[k + 1] = power * normal_light;
        term[k + 2] = power * normal_eye;
        term[k + 3] = power * s;
        term[k + 4] = power * s * s;
    }
}

double dph_view_gain(const struct dph_view_gain *gain, double normal_light, double normal_eye,
                     double light_eye, double value)
{
    double term[N], sum = 0;
    dph_view_terms(normal_light, normal_eye, light_eye, value, term);
    for (int k = 0; k < N; k++)
        sum += (double)gain->term[k] * term[k];
    return fmin(fmax(sum, 0), MOST);
}

void dph_view_constants(const struct dph_response *response, const double to_light[3],
                        const double to_eye[3], struct dph_view_constants *constants)
{
    double c = 0, sum[5] = {0}, power = 1, scale = sqrt(PI * (double)response->ramp.top);
    for (int i = 0; i < 3; i++)
        c += to_light[i] * to_eye[i];
    for (int k = 0; k < N; k++) {
        power = k == 5 || k == 10 ? power * c : power;
        sum[k % 5] += power * (double)response->view.term[k];
    }
    constants->even = (float)sum[0];
    for (int i = 0; i < 3; i++)
        constants->normal[i] = (float)(sum[1] * to_light[i] + sum[2] * to_eye[i]);
    constants->root = (float)(sum[3] * scale);
    constants->value = (float)(sum[4] * scale * scale);
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
    double factor[N][N], x[N];
    struct dph_view_gain gain;
    if (!(matrix[0] > 0))
        return dph_view_even();
    /* for gain - 1, whose matrix is the same */
    for (int i = 0; i < N; i++) {
        for (int j = 0; j <= i; j++) {
            double sum = matrix[i * (i + 1) / 2 + j] * (i == j ? 1 + PULL : 1);
            for (int k = 0; k < j; k++)
                sum -= factor[i][k] * factor[j][k];
            factor[i][j] = i == j ? sqrt(fmax(sum, 1e-12 * matrix[0])) : sum / factor[j][j];
        }
        x[i] = equations->right[i] - matrix[i * (i + 1) / 2];
        for (int k = 0; k < i; k++)
            x[i] -= factor[i][k] * x[k];
        x[i] /= factor[i][i];
    }
    for (int i = N - 1; i >= 0; i--) {
        for (int k = i + 1; k < N; k++)
            x[i] -= factor[k][i] * x[k];
        x[i] /= factor[i][i];
        gain.term[i] = (float)(x[i] + (i == 0));
    }
    return gain;
}
