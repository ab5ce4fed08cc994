/* The dipole: H. W. Jensen, S. Marschner, M. Levoy, P. Hanrahan, "A practical model for
 * subsurface light transport", SIGGRAPH 2001.
 *
 * Light that enters a half space is replaced by a point source one mean free path below the
 * surface, and the boundary by an image source above it, so that the diffuse flux vanishes at
 * the extrapolated boundary. With the reduced extinction st' = ss' + sa, a' = ss' / st', s =
 * sqrt(3 sa st'):
 *
 *   zr = 1 / st',   zv = zr (1 + 4/3 A),   A = (1 + Fdr) / (1 - Fdr)
 *   Rd(r) = a' / (4 pi) sum over z in {zr, zv} of  z (s d + 1) exp(-s d) / d^3,   d^2 = r^2 + z^2
 *
 * zv counts upwards here, hence the sum. Since d/dd (exp(-s d) / d) = -(s d + 1) exp(-s d) /
 * d^2, the integral of Rd from r to infinity over rings is a' / 2 sum of z exp(-s d) / d, and
 * over the whole plane a' / 2 (exp(-s zr) + exp(-s zv)). */
#include "bake/dipole.h"

#include <math.h>

#define PI 3.14159265358979323846

double dph_fresnel_diffuse(double ior)
{
    if (!(ior > 1))
        return 0;
    return -1.440 / (ior * ior) + 0.710 / ior + 0.668 + 0.0636 * ior;
}

double dph_fresnel_transmittance(double ior, double mu)
{
    if (!(ior > 1))
        return 1;
    if (!(mu > 0))
        return 0;
    double inside = sqrt(1 - (1 - mu * mu) / (ior * ior));
    double s = (mu - ior * inside) / (mu + ior * inside), p = (ior * mu - inside) / (ior * mu + inside);
    return 1 - (s * s + p * p) / 2;
}

void dph_dipole_init(struct dph_dipole *dipole, double scattering, double absorption, double ior)
{
    double extinction = scattering + absorption, diffuse = dph_fresnel_diffuse(ior);
    *dipole = (struct dph_dipole){.real = 1, .image = 1};
    if (!(scattering > 0))
        return;
    dipole->albedo = scattering / extinction;
    dipole->transport = sqrt(3 * absorption * extinction);
    dipole->real = 1 / extinction;
    dipole->image = dipole->real * (1 + 4 / 3. * (1 + diffuse) / (1 - diffuse));
}

static double source_at(double transport, double z, double r)
{
    double d = sqrt(r * r + z * z);
    return z * (transport * d + 1) * exp(-transport * d) / (d * d * d);
}

double dph_dipole_at(const struct dph_dipole *dipole, double r)
{
    return dipole->albedo / (4 * PI) *
           (source_at(dipole->transport, dipole->real, r) + source_at(dipole->transport, dipole->image, r));
}

static double source_beyond(double transport, double z, double r)
{
    double d = sqrt(r * r + z * z);
    return z / d * exp(-transport * d);
}

double dph_dipole_total(const struct dph_dipole *dipole)
{
    return dipole->albedo / 2 *
           (exp(-dipole->transport * dipole->real) + exp(-dipole->transport * dipole->image));
}

double dph_dipole_disc(const struct dph_dipole *dipole, double radius)
{
    return dph_dipole_total(dipole) - dipole->albedo / 2 *
           (source_beyond(dipole->transport, dipole->real, radius) +
            source_beyond(dipole->transport, dipole->image, radius));
}
