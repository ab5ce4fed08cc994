/* bake/dipole.h - light that leaves a medium at a distance from where it entered.      Tier 2, private. */
#ifndef DPH_BAKE_DIPOLE_H
#define DPH_BAKE_DIPOLE_H

/* The dipole of one channel; lengths in any unit, coefficients in 1 / unit. */
struct dph_dipole {
    double albedo;    /* a' = ss' / (ss' + sa); 0: nothing comes back                              */
    double transport; /* effective transport coefficient, sqrt(3 sa st')                          */
    double real, image; /* depth of the real source, height of the image source (positive)        */
};

/* `scattering` is reduced; `ior` >= 1, the medium's index over that outside. */
void dph_dipole_init(struct dph_dipole *dipole, double scattering, double absorption, double ior);

/* Diffuse reflectance Rd at distance r: flux that leaves per area and entering flux, 1 / unit^2. */
double dph_dipole_at(const struct dph_dipole *dipole, double r);

/* The integral of Rd over the disc of this radius, and over the whole plane. */
double dph_dipole_disc(const struct dph_dipole *dipole, double radius);
double dph_dipole_total(const struct dph_dipole *dipole);

/* Fresnel's transmittance for unpolarised light, from outside at the cosine `mu` >= 0; 1 for ior 1. */
double dph_fresnel_transmittance(double ior, double mu);

/* Mean reflectance inside for even light, by Egan and Hilgeman's fit; 0 for ior 1. */
double dph_fresnel_diffuse(double ior);

#endif
