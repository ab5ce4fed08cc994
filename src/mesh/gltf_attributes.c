/* glTF: what the writers of vertex data share: views and accessors as JSON, and the place in a
 * primitive's extras where data are described. */
#include "mesh/gltf.h"

json_t *dph_gltf_number(size_t value)
{
    return json_integer((json_int_t)value);
}

json_t *dph_gltf_make_view(struct dph_gltf_output *out, size_t offset, size_t size, size_t stride,
                           int target)
{
    json_t *object = json_object();
    dph_gltf_set(out, object, "buffer", json_integer(0));
    dph_gltf_set(out, object, "byteOffset", dph_gltf_number(offset));
    dph_gltf_set(out, object, "byteLength", dph_gltf_number(size));
    if (stride)
        dph_gltf_set(out, object, "byteStride", dph_gltf_number(stride));
    if (target)
        dph_gltf_set(out, object, "target", json_integer(target));
    return object;
}

json_t *dph_gltf_make_accessor(struct dph_gltf_output *out, size_t view_number, size_t offset,
                               int type, size_t count, const char *shape)
{
    json_t *object = json_object();
    dph_gltf_set(out, object, "bufferView", dph_gltf_number(view_number));
    if (offset)
        dph_gltf_set(out, object, "byteOffset", dph_gltf_number(offset));
    dph_gltf_set(out, object, "componentType", json_integer(type));
    if (type == DPH_GLTF_BYTE || type == DPH_GLTF_SHORT)
        dph_gltf_set(out, object, "normalized", json_true());
    dph_gltf_set(out, object, "count", dph_gltf_number(count));
    dph_gltf_set(out, object, "type", json_string(shape));
    return object;
}

void dph_gltf_set_description(struct dph_gltf_output *out, json_t *primitive, const char *key,
                              json_t *d)
{
    json_t *old = json_object_get(primitive, "extras");
    if (!d && !json_object_get(json_object_get(old, "diaphan"), key))
        return;
    json_incref(old);
    json_t *extras = dph_gltf_own_object(out, primitive, "extras");
    if (old && !json_is_object(old))
        dph_gltf_set(out, extras, "extras", json_incref(old));
    json_decref(old);
    old = json_incref(json_object_get(extras, "diaphan"));
    json_t *diaphan = dph_gltf_own_object(out, extras, "diaphan");
    if (old && !json_is_object(old))
        dph_gltf_set(out, diaphan, "value", json_incref(old));
    json_decref(old);
    if (d)
        dph_gltf_set(out, diaphan, key, d);
    else
        json_object_del(diaphan, key);
}

void dph_gltf_drop_draco(struct dph_gltf_output *out, json_t *primitive)
{
    if (!dph_gltf_extension(primitive, "KHR_draco_mesh_compression", NULL))
        return;
    json_t *extensions = dph_gltf_own_object(out, primitive, "extensions");
    json_object_del(extensions, "KHR_draco_mesh_compression");
    if (!json_object_size(extensions))
        json_object_del(primitive, "extensions");
}
