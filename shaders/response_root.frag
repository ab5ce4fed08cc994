// response_root.frag - the same, of sums that are square roots.
#define DPH_ROOT
#include "response.frag"
