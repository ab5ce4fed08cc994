// clustered.vert - body.vert for bodies whose coefficients are clustered principal components.
#define DPH_CLUSTERED
#include "body.vert"
