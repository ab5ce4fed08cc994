// material.glsl - the material that is drawn.
//
// Its numbers are constants of the program where it stays what it is, and DPH_MATERIAL are the
// arguments of DphMaterial's constructor: what they decide against is not compiled, and the rest
// costs no fetch of uniforms at every fragment, which on a software renderer takes longer than the
// formulas. A material that changes from frame to frame comes as uniforms.
#include "diaphan.glsl"

#ifdef DPH_MATERIAL
const DphMaterial u_material = DphMaterial(DPH_MATERIAL);
#else
uniform DphMaterial u_material;
#endif
