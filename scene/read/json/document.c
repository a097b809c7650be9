/* scene/read/json/document.c: names and their ids, tables of named values, vectors. */
#include "scene/read/json/document.h"

#include <string.h>

fct_result fct_document_set_id(fct_document *d, json_t *ids, const char *name, uint32_t id) {
    if (json_object_set_new(ids, name, json_integer(id))) return fct_fail_memory(d->json.env, "a name");
    return FCT_OK;
}

fct_result fct_document_get_id(fct_document *d, const char *what, json_t *ids, const json_t *value,
                               uint32_t *id) {
    const char *name;
    char clean[64];
    *id = 0;
    fct_result result = fct_json_string(&d->json, value, 4096, &name);
    if (result != FCT_OK) return result;
    json_t *found = json_object_get(ids, name);
    if (!found) return fct_json_fail(&d->json, "there is no %s \"%s\"", what, fct_json_clean(name, clean));
    *id = (uint32_t)json_integer_value(found);
    return FCT_OK;
}

static fct_result read_table_array(fct_document *d, json_t *array, json_t *ids, fct_document_reader *read) {
    for (size_t k = 0; k < json_array_size(array); ++k) {
        json_t *value = json_array_get(array, k);
        size_t before = fct_json_enter_index(&d->json, k);
        if (!json_is_object(value)) return fct_json_expected(&d->json, "an object with a name", value);
        const char *name = NULL;
        size_t inside = fct_json_enter(&d->json, "name");
        fct_result result = fct_json_string(&d->json, json_object_get(value, "name"), 64, &name);
        char clean[64];
        if (result == FCT_OK && json_object_get(ids, name))
            result = fct_json_fail(&d->json, "\"%s\" exists already", fct_json_clean(name, clean));
        if (result != FCT_OK) return result;
        fct_json_leave(&d->json, inside);
        result = read(d, name, value);
        if (result != FCT_OK) return result;
        fct_json_leave(&d->json, before);
    }
    return FCT_OK;
}

fct_result fct_document_read_table(fct_document *d, const char *key, json_t *ids, fct_document_reader *read) {
    json_t *table = json_object_get(d->root, key), *value;
    const char *name;
    fct_result result;
    size_t before = fct_json_enter(&d->json, key);
    if (json_is_array(table)) {
        result = read_table_array(d, table, ids, read);
        if (result == FCT_OK) fct_json_leave(&d->json, before);
        return result;
    }
    if (!json_is_object(table)) return fct_json_expected(&d->json, "an object or an array", table);
    json_object_foreach(table, name, value) {
        size_t inside = fct_json_enter(&d->json, name);
        if (!name[0] || strlen(name) > 63) return fct_json_fail(&d->json, "expected a name of 1 to 63 bytes");
        result = read(d, name, value);
        if (result != FCT_OK) return result;
        fct_json_leave(&d->json, inside);
    }
    fct_json_leave(&d->json, before);
    return FCT_OK;
}

fct_result fct_document_read_vector(fct_document *d, const json_t *object, const char *key, bool required,
                                    float out[3]) {
    const json_t *value = json_object_get(object, key);
    double numbers[3];
    if (!value && !required) return FCT_OK;
    size_t before = fct_json_enter(&d->json, key);
    fct_result result = fct_json_numbers(&d->json, value, 3, numbers);
    if (result != FCT_OK) return result;
    for (int c = 0; c < 3; ++c) out[c] = (float)numbers[c];
    fct_json_leave(&d->json, before);
    return FCT_OK;
}
