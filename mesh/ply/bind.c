/* mesh/ply/bind.c: see bind.h. */
#include "mesh/ply/bind.h"

#include <string.h>

#include "mesh/color.h"
#include "mesh/ply/value.h"

/* Groups of properties. A group counts if the element has all its properties. A later group replaces an
 * earlier one with the same destination. */
typedef struct group {
    fct_ply_kind kind;
    const char *names[3];
    size_t width;
    enum {
        POSITIONS,
        NORMALS,
        COLORS,
        TEXCOORDS,
        POLYGON_COLORS,
        IRRADIANCE,
        DIRECT,
        INDIRECT,
        ERROR
    } destination;
} group;

static const group groups[] = {
    {FCT_PLY_VERTICES, {"x", "y", "z"}, 3, POSITIONS},
    {FCT_PLY_VERTICES, {"nx", "ny", "nz"}, 3, NORMALS},
    {FCT_PLY_VERTICES, {"r", "g", "b"}, 3, COLORS},
    {FCT_PLY_VERTICES, {"diffuse_r", "diffuse_g", "diffuse_b"}, 3, COLORS},
    {FCT_PLY_VERTICES, {"diffuse_red", "diffuse_green", "diffuse_blue"}, 3, COLORS},
    {FCT_PLY_VERTICES, {"red", "green", "blue"}, 3, COLORS},
    {FCT_PLY_VERTICES, {"indirect_r", "indirect_g", "indirect_b"}, 3, COLORS},
    {FCT_PLY_VERTICES, {"direct_r", "direct_g", "direct_b"}, 3, COLORS},
    {FCT_PLY_VERTICES, {"irradiance_r", "irradiance_g", "irradiance_b"}, 3, COLORS},
    {FCT_PLY_VERTICES, {"radiosity_r", "radiosity_g", "radiosity_b"}, 3, COLORS},
    {FCT_PLY_VERTICES, {"irradiance_r", "irradiance_g", "irradiance_b"}, 3, IRRADIANCE},
    {FCT_PLY_VERTICES, {"direct_r", "direct_g", "direct_b"}, 3, DIRECT},
    {FCT_PLY_VERTICES, {"indirect_r", "indirect_g", "indirect_b"}, 3, INDIRECT},
    {FCT_PLY_VERTICES, {"error"}, 1, ERROR},
    {FCT_PLY_VERTICES, {"texture_u", "texture_v"}, 2, TEXCOORDS},
    {FCT_PLY_VERTICES, {"u", "v"}, 2, TEXCOORDS},
    {FCT_PLY_VERTICES, {"s", "t"}, 2, TEXCOORDS},
    {FCT_PLY_FACES, {"r", "g", "b"}, 3, POLYGON_COLORS},
    {FCT_PLY_FACES, {"diffuse_r", "diffuse_g", "diffuse_b"}, 3, POLYGON_COLORS},
    {FCT_PLY_FACES, {"diffuse_red", "diffuse_green", "diffuse_blue"}, 3, POLYGON_COLORS},
    {FCT_PLY_FACES, {"red", "green", "blue"}, 3, POLYGON_COLORS},
    {FCT_PLY_FACES, {"radiosity_r", "radiosity_g", "radiosity_b"}, 3, POLYGON_COLORS},
};

static bool has_name(const fct_ply_property *property, const char *name) {
    return fct_text_word_is(property->name, property->name_length, name);
}

static ptrdiff_t find_property(const fct_ply_property *properties, size_t count, bool list,
                               const char *name) {
    for (size_t i = 0; i < count; ++i)
        if ((properties[i].count_type != FCT_PLY_NONE) == list && has_name(properties + i, name))
            return (ptrdiff_t)i;
    return FCT_PLY_NOWHERE;
}

static ptrdiff_t find_either(const fct_ply_property *properties, size_t count, bool list, const char *a,
                             const char *b) {
    ptrdiff_t found = find_property(properties, count, list, a);
    return found != FCT_PLY_NOWHERE ? found : find_property(properties, count, list, b);
}

/* Whether the property is a light of a bake, which is linear, and not a colour of any scale. */
static bool is_light(const char *name) {
    static const char *const lights[] = {"radiosity_r", "irradiance_r", "direct_r", "indirect_r"};
    for (size_t i = 0; i < sizeof lights / sizeof *lights; ++i)
        if (!strcmp(name, lights[i])) return true;
    return false;
}

/* Appends the columns of the group, which are at the properties `found`. */
static void append_columns(const group *g, const ptrdiff_t *found, const fct_ply_property *properties,
                           const double *origin, float *array, fct_ply_target *out) {
    bool color = g->destination == COLORS || g->destination == POLYGON_COLORS;
    if (color) { /* replaces the earlier group */
        while (out->column_count && out->columns[out->column_count - 1].color) --out->column_count;
        out->any_scale = !is_light(g->names[0]);
    } else if (g->destination == TEXCOORDS) {
        while (out->column_count && out->columns[out->column_count - 1].stride == 2) --out->column_count;
    }
    for (size_t k = 0; k < g->width; ++k) {
        bool position = g->destination == POSITIONS;
        if (color && properties[found[k]].type < FCT_PLY_FLOAT) out->any_scale = false;
        if (position) out->positions[k] = found[k];
        out->columns[out->column_count++] = (fct_ply_column){.property = (size_t)found[k],
                                                             .to = array + k,
                                                             .stride = g->width,
                                                             .origin = position ? origin[k] : 0,
                                                             .color = color};
    }
}

/* Appends the columns of the group if the element has all of them. */
static fct_result bind_group(const fct_env *env, const group *g, const fct_ply_property *properties,
                             const fct_ply_element *element, const double *origin, float **array,
                             fct_ply_target *out) {
    ptrdiff_t found[3];
    for (size_t k = 0; k < g->width; ++k) {
        found[k] = find_property(properties, element->property_count, false, g->names[k]);
        if (found[k] == FCT_PLY_NOWHERE) return FCT_OK;
    }
    if (!*array) *array = fct_allocate(env, (size_t)element->count, g->width * sizeof(float));
    if (!*array) return fct_fail_memory(env, "a mesh");
    append_columns(g, found, properties, origin, *array, out);
    return FCT_OK;
}

fct_ply_kind fct_ply_kind_of(const fct_ply_element *element) {
    if (fct_text_word_is(element->name, element->name_length, "vertex")) return FCT_PLY_VERTICES;
    if (fct_text_word_is(element->name, element->name_length, "face")) return FCT_PLY_FACES;
    if (fct_text_word_is(element->name, element->name_length, "tristrips")) return FCT_PLY_STRIPS;
    return FCT_PLY_OTHER;
}

fct_result fct_ply_bind(const fct_text *t, const fct_ply_header *header, const fct_ply_element *element,
                        fct_soup *soup, float **vertex_texcoords, fct_ply_target *out) {
    const fct_ply_property *properties =
        element->property_count ? header->properties + element->first_property : NULL;
    size_t count = element->property_count;
    *out = (fct_ply_target){.kind = fct_ply_kind_of(element),
                            .positions = {FCT_PLY_NOWHERE, FCT_PLY_NOWHERE, FCT_PLY_NOWHERE},
                            .indices = FCT_PLY_NOWHERE,
                            .texcoords = FCT_PLY_NOWHERE,
                            .material = FCT_PLY_NOWHERE};
    float **arrays[] = {&soup->positions, &soup->normals,        &soup->colors,
                        vertex_texcoords, &soup->polygon_colors, &soup->irradiance,
                        &soup->direct,    &soup->indirect,       &soup->error};
    for (size_t i = 0; i < sizeof groups / sizeof *groups; ++i) {
        if (groups[i].kind != out->kind) continue;
        fct_result result = bind_group(t->env, groups + i, properties, element, soup->origin,
                                       arrays[groups[i].destination], out);
        if (result != FCT_OK) return result;
    }
    if (out->kind == FCT_PLY_VERTICES && !soup->positions)
        return fct_fail(t->env, FCT_ERROR_DATA, "%s: element vertex lacks one of the properties x, y and z",
                        t->name);
    if (out->kind != FCT_PLY_FACES && out->kind != FCT_PLY_STRIPS) return FCT_OK;
    out->indices = find_either(properties, count, true, "vertex_indices", "vertex_index");
    if (out->indices == FCT_PLY_NOWHERE && element->count)
        return fct_fail(t->env, FCT_ERROR_DATA, "%s: element %.*s has no list vertex_indices", t->name,
                        (int)element->name_length, element->name);
    if (out->kind == FCT_PLY_STRIPS) return FCT_OK;
    out->texcoords = find_property(properties, count, true, "texcoord");
    out->material = find_either(properties, count, false, "material_index", "material");
    if (out->material != FCT_PLY_NOWHERE) {
        soup->materials = fct_allocate(t->env, (size_t)element->count, sizeof(uint32_t));
        if (!soup->materials) return fct_fail_memory(t->env, "a mesh");
    }
    return FCT_OK;
}

/* Integers from 0 to 255 (65535 for ushort) are sRGB, floats are linear. An integer out of range becomes NaN,
 * as if the file had no number there. */
static float color_value(double value, fct_ply_type type) {
    if (type >= FCT_PLY_FLOAT) return (float)value;
    double top = type == FCT_PLY_UINT16 ? 65535 : 255;
    return value >= 0 && value <= top ? fct_linear_from_srgb(value / top) : NAN;
}

void fct_ply_fill_columns(const fct_ply_target *target, const fct_ply_property *properties,
                          const unsigned char *base, size_t size, const size_t *offsets, bool swap,
                          bool as_double, size_t begin, size_t end) {
    float bytes[256];
    bool any_color = false;
    for (size_t c = 0; c < target->column_count; ++c) any_color |= target->columns[c].color;
    if (any_color && end - begin > 256)
        for (int i = 0; i < 256; ++i) bytes[i] = fct_linear_from_srgb(i / 255.0);
    for (size_t c = 0; c < target->column_count; ++c) {
        fct_ply_column column = target->columns[c];
        fct_ply_type declared = properties[column.property].type;
        fct_ply_type type = as_double ? FCT_PLY_DOUBLE : declared;
        const unsigned char *from = base + offsets[column.property];
        if (column.color && type == FCT_PLY_UINT8 && end - begin > 256)
            for (size_t i = begin; i < end; ++i) column.to[i * column.stride] = bytes[from[i * size]];
        else if (column.color)
            for (size_t i = begin; i < end; ++i)
                column.to[i * column.stride] =
                    color_value(fct_ply_load(from + i * size, type, swap), declared);
        else if (type == FCT_PLY_FLOAT && column.origin == 0)
            for (size_t i = begin; i < end; ++i)
                column.to[i * column.stride] = (float)fct_ply_float(from + i * size, swap);
        else
            for (size_t i = begin; i < end; ++i)
                column.to[i * column.stride] =
                    (float)(fct_ply_load(from + i * size, type, swap) - column.origin);
    }
}

void fct_ply_extend(const fct_ply_target *target, const fct_ply_property *properties,
                    const unsigned char *base, size_t size, const size_t *offsets, bool swap, bool as_double,
                    size_t count, fct_extent *extent) {
    bool fine = as_double;
    fct_ply_type types[3];
    for (int k = 0; k < 3; ++k) {
        if (target->positions[k] == FCT_PLY_NOWHERE) return;
        fct_ply_type declared = properties[target->positions[k]].type;
        types[k] = as_double ? FCT_PLY_DOUBLE : declared;
        fine = fine || declared == FCT_PLY_DOUBLE || declared == FCT_PLY_INT32 || declared == FCT_PLY_UINT32;
    }
    for (size_t i = 0; fine && i < count && !extent->near; ++i) {
        double point[3];
        for (int k = 0; k < 3; ++k)
            point[k] = fct_ply_load(base + i * size + offsets[target->positions[k]], types[k], swap);
        fct_extent_add(extent, point);
    }
}
