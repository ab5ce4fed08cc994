/* What the processor can do. */
#include "core/simd.h"

bool dph_cpu_has_avx2(void)
{
#ifdef DPH_HAVE_AVX2
    __builtin_cpu_init();
    return __builtin_cpu_supports("avx2");
#else
    return false;
#endif
}
