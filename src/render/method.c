/* The table of drawing methods. A new method is a file of its own and a line here. */
#include "render/draw.h"

#include <string.h>

static const struct dph_method *const methods[] = {
    &dph_method_lambert, &dph_method_shsss,    &dph_method_green, &dph_method_green_gauss,
    &dph_method_prt,     &dph_method_prt_cpca, &dph_method_patro, &dph_method_response,
    &dph_method_thickness,
};

const struct dph_method *dph_method_at(size_t i)
{
    return i < sizeof methods / sizeof *methods ? methods[i] : NULL;
}

const struct dph_method *dph_method_find(const char *name)
{
    const struct dph_method *method;
    for (size_t i = 0; (method = dph_method_at(i)); i++)
        if (!strcmp(method->name, name))
            return method;
    return NULL;
}
