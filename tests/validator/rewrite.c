/* rewrite INPUT OUTPUT.glb BANDS STORE - loads, adds fabricated thickness and saves, for the validator's test. */
#include "fabricate.h"

#include <stdio.h>
#include <string.h>

int main(int argc, char **argv)
{
    if (argc != 5)
        return 1;
    struct dph_error err = {0};
    struct dph_scene *scene = dph_scene_load(argv[1], &err);
    enum dph_store store = !strcmp(argv[4], "float")     ? DPH_STORE_FLOAT
                           : !strcmp(argv[4], "snorm16") ? DPH_STORE_SNORM16
                           : !strcmp(argv[4], "cpca")    ? DPH_STORE_CPCA : DPH_STORE_SNORM8;
    int bands = atoi(argv[3]);
    bool ok = scene && (!bands || fabricate_thickness(scene, bands, store)) &&
              dph_scene_save(scene, argv[2], &err);
    dph_scene_destroy(scene);
    if (!ok)
        fprintf(stderr, "%s\n", err.message);
    return ok ? 0 : err.code == DPH_ERROR_UNSUPPORTED ? 3 : 2;
}
