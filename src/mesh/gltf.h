/* mesh/gltf.h - what the glTF files share: document, buffers, views, accessors.
 * Tier 1, private.
 *
 * glTF 2.0 (ISO/IEC 12113). A document owns the parsed JSON and every buffer. It is filled by
 * dph_gltf_document_create and only read afterwards, except for the cache of decompressed views,
 * which is emptied when the reader is done. Functions that take `place` put it into their messages
 * after the file's path: "model.glb: meshes[3].primitives[0].attributes.POSITION: ...". */
#ifndef DPH_MESH_GLTF_H
#define DPH_MESH_GLTF_H

#include "mesh/readers.h"

#include <jansson.h>

/* Where the bytes of a buffer were. */
enum dph_gltf_source { DPH_GLTF_NOTHING = 0, DPH_GLTF_BIN, DPH_GLTF_DATA_URI, DPH_GLTF_EXTERNAL };

struct dph_gltf_buffer {
    enum dph_gltf_source source;
    const unsigned char *data; /* Nullable: could not be had, `problem` says why                 */
    size_t size;               /* byteLength                                                    */
    unsigned char *owned;      /* Nullable: to be freed                                         */
    char *problem;             /* Nullable                                                      */
};

/* One triangle primitive: rows first .. first + count - 1 of its body. */
struct dph_gltf_part {
    size_t body, mesh, primitive;
    size_t first, count;
};

struct dph_document {
    char *path;                 /* for messages; external files are beside it; "": there are none */
    json_t *root;
    struct dph_file file;       /* the GLB itself; empty for .gltf                                */
    size_t chunks_at;           /* where chunks beyond JSON and BIN begin in `file`               */
    size_t chunks_size;
    size_t nbuffer;
    struct dph_gltf_buffer *buffer;
    size_t total;               /* bytes of all buffers                                           */
    size_t nview;
    unsigned char **decoded;    /* (nview) decompressed views, NULL where there is none yet       */
    size_t npart;
    struct dph_gltf_part *part; /* in the order of bodies and rows                                */
};

/* gltf_json.c */
#define DPH_GLTF_REQUIRED ((size_t)-1)

/* Fails with "path: place: ...". `place` may be empty. */
bool dph_gltf_fail(const struct dph_document *doc, const char *place, enum dph_code code,
                   struct dph_error *err, const char *format, ...)
    __attribute__((format(printf, 5, 6)));
/* Members of an object, checked. A missing one is `fallback`, or an error where that is
 * DPH_GLTF_REQUIRED; values are at most `limit`. */
bool dph_gltf_size(const struct dph_document *doc, const json_t *object, const char *key,
                   const char *place, size_t fallback, size_t limit, size_t *value,
                   struct dph_error *err);
/* NULL where the member is missing. */
bool dph_gltf_array(const struct dph_document *doc, const json_t *object, const char *key,
                    const char *place, json_t **array, struct dph_error *err);
bool dph_gltf_object(const struct dph_document *doc, const json_t *object, const char *key,
                     const char *place, json_t **value, struct dph_error *err);
/* `count` finite numbers; an absent member leaves `value` as it is and sets *found (Nullable) to
 * false. */
bool dph_gltf_numbers(const struct dph_document *doc, const json_t *object, const char *key,
                      const char *place, size_t count, double *value, bool *found,
                      struct dph_error *err);
/* The same of parts of the file that nothing has checked: SIZE_MAX where it is no count, 0 where it
 * is missing. */
size_t dph_gltf_unchecked(const json_t *object, const char *key);
/* Element `i` of a root array, which must be an object; `place` names who refers to it. */
bool dph_gltf_element(const struct dph_document *doc, const char *array, size_t i,
                      const char *place, json_t **element, struct dph_error *err);
/* The extension object under either name (the second Nullable), NULL where there is none. */
json_t *dph_gltf_extension(const json_t *object, const char *name, const char *other);

/* Writes compact JSON; member order is kept and numbers read back as they were. `sink` returns
 * false to stop. */
typedef bool dph_gltf_sink(void *user, const char *text, size_t size);
bool dph_gltf_dump(json_t *json, dph_gltf_sink *sink, void *user);
/* The number with the fewest digits that reads back as this float. */
double dph_gltf_shortest(float value);

/* gltf_document.c */
/* Parses `file` (and empties it where its memory is kept), loads all buffers. */
struct dph_document *dph_gltf_document_create(struct dph_file *file, const char *path,
                                              struct dph_error *err);
/* Decodes the payload of a data: URI. False: malformed (or no memory), without a message. */
bool dph_gltf_data_uri(const char *uri, unsigned char **data, size_t *size);
/* Loads the external file that a relative URI names. */
bool dph_gltf_external(const struct dph_document *doc, const char *uri, struct dph_file *file,
                       struct dph_error *err);

struct dph_gltf_view {
    const unsigned char *data;
    size_t size;
    size_t stride; /* 0: tightly packed */
};
bool dph_gltf_view(struct dph_document *doc, size_t i, const char *place,
                   struct dph_gltf_view *view, struct dph_error *err);
/* Frees decompressed views. */
void dph_gltf_forget_views(struct dph_document *doc);

/* gltf_meshopt.c: decompresses a view described by EXT_meshopt_compression into `size` bytes. */
bool dph_gltf_meshopt(const struct dph_document *doc, const json_t *extension, size_t size,
                      const char *place, unsigned char **out, struct dph_error *err);

/* gltf_accessor.c */
enum dph_gltf_component {
    DPH_GLTF_BYTE = 5120,
    DPH_GLTF_UBYTE = 5121,
    DPH_GLTF_SHORT = 5122,
    DPH_GLTF_USHORT = 5123,
    DPH_GLTF_UINT = 5125,
    DPH_GLTF_FLOAT = 5126,
};

/* A checked accessor: all of its elements can be read. */
struct dph_gltf_accessor {
    size_t count;
    int components;                    /* 1 to 4; matrices are refused                            */
    enum dph_gltf_component type;
    bool normalized;
    const unsigned char *data;         /* Nullable: zeros                                         */
    size_t stride;
    size_t sparse;                     /* replaced elements                                       */
    enum dph_gltf_component sparse_type;
    const unsigned char *sparse_index; /* strictly increasing, each < count                       */
    const unsigned char *sparse_value;
};
size_t dph_gltf_component_size(enum dph_gltf_component type);
const char *dph_gltf_component_name(enum dph_gltf_component type);
bool dph_gltf_accessor(struct dph_document *doc, size_t i, const char *place,
                       struct dph_gltf_accessor *accessor, struct dph_error *err);
/* The accessor that member `key` of `object` names; *found (Nullable) is false where there is none,
 * without it the member is required. */
bool dph_gltf_accessor_at(struct dph_document *doc, const json_t *object, const char *key,
                          const char *place, bool *found, struct dph_gltf_accessor *accessor,
                          struct dph_error *err);
/* All elements as floats, after normalization, `components` a row. False: one is not finite. */
bool dph_gltf_floats(const struct dph_document *doc, const struct dph_gltf_accessor *accessor,
                     const char *place, float *out /* (count x components) */,
                     struct dph_error *err);
/* Scalars of an unsigned type. */
void dph_gltf_uints(const struct dph_gltf_accessor *accessor, uint32_t *out /* (count) */);
/* The stored bytes, element e going to out + e * stride. */
void dph_gltf_raw(const struct dph_gltf_accessor *accessor, unsigned char *out, size_t stride);

/* gltf_nodes.c: instances of the default scene. `body_of` (nmesh): body of a mesh, SIZE_MAX where
 * it has none. */
bool dph_gltf_read_nodes(struct dph_scene *scene, struct dph_document *doc, const size_t *body_of,
                         size_t nmesh, struct dph_error *err);

/* gltf_thickness.c: the baked attributes of a body, parts first .. last - 1; leaves `thickness`
 * NULL where there are none. *mm_per_unit is set where the file says it. */
bool dph_gltf_read_thickness(struct dph_document *doc, struct dph_body *body, size_t first,
                             size_t last, double *mm_per_unit, struct dph_error *err);
/* Attribute names are matched without regard to case, because some tools change it. Returns the
 * name as the file has it, NULL: absent. */
const char *dph_gltf_attribute_name(json_t *attributes, const char *name);
const char *dph_gltf_thickness_name(json_t *attributes, int i);
/* What descriptions of all kinds begin with: the version, and the basis of 1 to `most` bands. */
bool dph_gltf_read_version(const struct dph_document *doc, const json_t *d, const char *place,
                           struct dph_error *err);
bool dph_gltf_read_basis(const struct dph_document *doc, const json_t *d, const char *place,
                         int most, int *bands, struct dph_error *err);
/* What all descriptions of thickness say, into `t` (all but nvert, store and data); `scaled`: with one scale a
 * band. */
bool dph_gltf_read_description(const struct dph_document *doc, const json_t *d, const char *place,
                               bool scaled, struct dph_thickness *t, double *mm_per_unit,
                               struct dph_error *err);

/* Makes rows as they were read proper: zeroes what is beyond bands * bands, takes scales other than 1
 * into float rows, and -128 for -127. */
void dph_gltf_tidy_rows(struct dph_thickness *t);

/* gltf_cpca.c: the same for thickness stored as clustered principal components. */
bool dph_gltf_read_cpca(struct dph_document *doc, struct dph_body *body, size_t first, size_t last,
                        double *mm_per_unit, struct dph_error *err);
json_t *dph_gltf_primitive(const struct dph_document *doc, const struct dph_gltf_part *part);
/* Opens an attribute of a primitive, which must be there; the message's place is left in `place`. */
bool dph_gltf_open_attribute(struct dph_document *doc, const struct dph_gltf_part *part,
                             const char *name, int components, struct dph_gltf_accessor *a,
                             char place[120], struct dph_error *err);
/* Counts of clusters and vectors, and the number of the view of their table. */
bool dph_gltf_read_counts(const struct dph_document *doc, const json_t *d, const char *place,
                          int *clusters, int *vectors, size_t *view, struct dph_error *err);
/* Means and vectors of n numbers each, into *table, which the caller frees also after a failure. */
bool dph_gltf_read_table(struct dph_document *doc, size_t view, int clusters, int vectors, int n,
                         const char *place, float **table, struct dph_error *err);
/* Weights of a part, from the attributes `prefix`0, `prefix`1 and so on: rows of vectors rounded up
 * to 4. */
bool dph_gltf_read_weights(struct dph_document *doc, const struct dph_gltf_part *part,
                           const char *prefix, int vectors, int8_t *out, struct dph_error *err);
/* Numbers of clusters of a part. */
bool dph_gltf_read_clusters(struct dph_document *doc, const struct dph_gltf_part *part,
                            const char *name, int clusters, uint16_t *out, struct dph_error *err);

/* gltf_output.c: a GLB being made. The binary chunk is a list of pieces that are written as they
 * are asked for, so that nothing is copied. */
struct dph_gltf_piece {
    enum { DPH_GLTF_BYTES = 0, DPH_GLTF_ROWS, DPH_GLTF_SHORTS } kind;
    const void *data;                     /* bytes, or the uint32_t of DPH_GLTF_SHORTS            */
    void *owned;                          /* Nullable: freed with the piece                       */
    const struct dph_thickness *thickness;
    size_t first, count;                  /* rows of `thickness`, or numbers                      */
    size_t offset, size;
};

struct dph_gltf_output {
    json_t *root;
    size_t size;             /* of the binary chunk so far                                        */
    size_t npiece, capacity;
    struct dph_gltf_piece *piece;
    bool memory;             /* an allocation failed; looked at once, at the end                  */
};

/* Appends at a multiple of `align`; returns where. */
size_t dph_gltf_put_bytes(struct dph_gltf_output *out, const void *data, size_t size, size_t align,
                          void *owned);
/* uint32_t as unsigned 16-bit numbers. */
size_t dph_gltf_put_shorts(struct dph_gltf_output *out, const uint32_t *data, size_t count);
/* Rows first .. first + count - 1 of stored thickness, as components / 4 planes of four. */
size_t dph_gltf_put_rows(struct dph_gltf_output *out, const struct dph_thickness *thickness,
                         size_t first, size_t count);
/* gltf_cpca.c: numbers of clusters, 4 bytes apart, in the type that file-format.md names. */
size_t dph_gltf_put_clusters(struct dph_gltf_output *out, const uint16_t *cluster, size_t count);
/* Setting members; a failure (also a NULL value) is remembered in out->memory. */
void dph_gltf_set(struct dph_gltf_output *out, json_t *object, const char *key, json_t *value);
void dph_gltf_append(struct dph_gltf_output *out, json_t *array, json_t *value);
/* Replaces a member (an element) by a shallow copy of it that may be changed, made where it is
 * missing. */
json_t *dph_gltf_own_array(struct dph_gltf_output *out, json_t *object, const char *key);
json_t *dph_gltf_own_object(struct dph_gltf_output *out, json_t *object, const char *key);
json_t *dph_gltf_own_element(struct dph_gltf_output *out, json_t *array, size_t i);
/* Writes the file; `chunks` are appended as they are. */
bool dph_gltf_emit(const struct dph_gltf_output *out, const char *path, const void *chunks,
                   size_t chunks_size, struct dph_error *err);
void dph_gltf_output_finish(struct dph_gltf_output *out);

/* gltf_embed.c: brings the buffers and images of a document into the binary chunk, first of all
 * pieces. `keep`: bytes of the first buffer that are kept. Afterwards buffer 0 is the binary chunk;
 * dph_gltf_close_buffer gives it its size. */
bool dph_gltf_embed(struct dph_gltf_output *out, const struct dph_document *doc, size_t keep,
                    struct dph_error *err);
void dph_gltf_close_buffer(struct dph_gltf_output *out);

struct dph_gltf_slots;

/* gltf_attributes.c: what the writers of vertex data share. Rows of a body that one primitive
 * draws, and where its attributes are. */
struct dph_gltf_strand {
    json_t *primitive;
    const json_t *position; /* number of its accessor; Nullable                                   */
    size_t first, count;
    size_t accessor;        /* the first of its own in a list of the writer's                     */
};
/* How far back a primitive looks for one with its vertices: they come side by side, and all pairs
 * of many thousand would take long. */
#define DPH_GLTF_TWIN_REACH 256
json_t *dph_gltf_number(size_t value);
json_t *dph_gltf_make_view(struct dph_gltf_output *out, size_t offset, size_t size, size_t stride,
                           int target);
json_t *dph_gltf_make_accessor(struct dph_gltf_output *out, size_t view_number, size_t offset,
                               int type, size_t count, const char *shape);
/* Sets extras.diaphan.KEY, or removes it where `d` is NULL. What was at home in extras already
 * stays there; extras that are no object move into a member called "extras", a member "diaphan"
 * that is no object into one called "value". */
void dph_gltf_set_description(struct dph_gltf_output *out, json_t *primitive, const char *key,
                              json_t *d);
/* Draco would give the vertices another order than the one that the new data are in; the plain copy
 * that was read stays. */
void dph_gltf_drop_draco(struct dph_gltf_output *out, json_t *primitive);

struct dph_rivals_origin;

/* gltf_rivals.c: what the other methods store, of a body, parts first .. last - 1; `rivals` stays
 * NULL where there is nothing. */
bool dph_gltf_read_rivals(struct dph_document *doc, struct dph_body *body, size_t first, size_t last,
                          double *mm_per_unit, struct dph_error *err);
/* Whether so many rows are in proportion to the file: DPH_ERROR_LIMIT. */
bool dph_gltf_check_rows(const struct dph_document *doc, size_t nvert, size_t row,
                         const char *place, struct dph_error *err);
/* Material and size that a description says it was baked for. */
bool dph_gltf_read_origin(const struct dph_document *doc, const json_t *d, const char *place,
                          struct dph_rivals_origin *origin, struct dph_error *err);
/* gltf_response.c: the response that description `d`, at `where`, belongs to. */
bool dph_gltf_read_response(struct dph_document *doc, struct dph_body *body, const json_t *d,
                            const char *where, size_t first, size_t last, struct dph_error *err);
/* gltf_rivals_write.c: the same into the body's primitives; what they had is replaced. False: out
 * of memory. */
bool dph_gltf_add_rivals(struct dph_gltf_output *out, struct dph_gltf_slots *slots,
                         const struct dph_rivals *rivals, struct dph_gltf_strand *strand,
                         size_t nstrand);

/* One product of the other methods: attributes of one stride, each a plane of its own, and a table
 * that none of them uses. */
struct dph_gltf_product {
    const struct dph_rivals *rivals;
    const char *key;              /* in extras.diaphan                                            */
    const char *prefix, *last;    /* names: prefix and a number; Nullable: of the last plane       */
    bool single;                  /* one plane, whose name is the prefix                           */
    const char *shape;            /* of all planes but one that is named `last`                   */
    int type, last_type;
    size_t planes, stride;
    const float *table;           /* Nullable                                                     */
    size_t table_size;            /* in bytes                                                     */
    /* Writes the planes of rows first .. first + count - 1, one after the other, over zeros. */
    void (*fill)(const struct dph_gltf_product *product, size_t first, size_t count,
                 unsigned char *out);
    /* The object that stands under `key`; `table`: number of the table's view. */
    json_t *(*describe)(struct dph_gltf_output *out, const struct dph_gltf_product *product,
                        size_t table);
};
/* False: out of memory. */
bool dph_gltf_add_product(struct dph_gltf_output *out, struct dph_gltf_slots *slots,
                          const struct dph_gltf_product *product, struct dph_gltf_strand *strand,
                          size_t nstrand);
/* Sets "material" and "mm_per_unit" of a description. */
void dph_gltf_describe_origin(struct dph_gltf_output *out, json_t *d,
                              const struct dph_rivals_origin *origin);
/* gltf_response_write.c: the response. */
bool dph_gltf_add_response(struct dph_gltf_output *out, struct dph_gltf_slots *slots,
                           const struct dph_rivals *rivals, struct dph_gltf_strand *strand,
                           size_t nstrand);

/* Whether an attribute (in any case) is one of theirs. */
bool dph_gltf_is_rivals_name(const char *name);

/* gltf_reuse.c: accessors and views that an earlier bake left and the next one replaces. */
struct dph_gltf_slots {
    size_t naccessor, nview;  /* left to take                                                     */
    size_t *accessor, *view;  /* ascending                                                        */
    size_t keep;              /* bytes of the first buffer without the old thickness              */
};
/* Finds those of the bodies that have thickness, and of those that have other methods' data, now.
 */
bool dph_gltf_find_slots(const struct dph_scene *scene, struct dph_gltf_slots *slots,
                         struct dph_error *err);
void dph_gltf_slots_finish(struct dph_gltf_slots *slots);
/* Puts `value` into a free slot or at the end of the array of that name; returns its index. */
size_t dph_gltf_place(struct dph_gltf_output *out, const char *array, size_t *slot, size_t *nslot,
                      json_t *value);
/* Gets rid of slots that were not taken: at the end of the array they go, elsewhere a copy of the
 * last element takes their place. */
void dph_gltf_fill_slots(struct dph_gltf_output *out, const char *array, const size_t *slot,
                         size_t nslot);
/* "_THICKNESS_SH_" or "_THICKNESS_CPCA_" and a digit, or "_THICKNESS_CLUSTER", in any case. */
bool dph_gltf_is_thickness_name(const char *name);

#endif
