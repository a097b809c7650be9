/* Hierarchy files with changed bytes and correct checksums: each is refused, or gives a tree that every call
 * can use. The same changes in every run. */
#include "mend.h"

#include "../shapes.h"

#include <dirent.h>
#include <unistd.h>

static const char *const path = "test_mutate.fct";
enum { MOST_BYTES = 1 << 16 };

typedef struct bytes {
    uint8_t *data;
    size_t size;
} bytes;

static bytes read_file(const char *name) {
    FILE *file = fopen(name, "rb");
    assert_non_null(file);
    bytes out = {malloc(MOST_BYTES), 0};
    out.size = fread(out.data, 1, MOST_BYTES, file);
    assert_true(out.size < MOST_BYTES);
    fclose(file);
    return out;
}

/* The file of a small tree: with colours, materials, several roots or vertices at one place. */
static bytes make_file(const fct_env *env, int kind) {
    fct_mesh mesh = kind == 0   ? make_sphere(env, 4)
                    : kind == 1 ? make_soup(env, 20, true)
                    : kind == 2 ? make_book(env, 9)
                                : make_grid(env, 5);
    if (kind == 0) {
        mesh.colors = fct_allocate_zero(env, mesh.vertex_count, 3 * sizeof *mesh.colors);
        mesh.materials = fct_allocate(env, mesh.face_count, sizeof *mesh.materials);
        mesh.material_count = 2;
        for (uint32_t f = 0; f < mesh.face_count; ++f) mesh.materials[f] = f % 3 == 0;
    }
    fct_tree_def def = fct_tree_def_default();
    def.root_count = kind == 3 ? 4 : 1;
    fct_tree *tree;
    assert_int_equal(fct_tree_build(env, &mesh, &def, NULL, &tree), FCT_OK);
    assert_int_equal(fct_tree_save(env, tree, path), FCT_OK);
    fct_tree_destroy(tree);
    fct_mesh_release(env, &mesh);
    bytes out = read_file(path);
    assert_true(out.size > sizeof(fct_format_header));
    unlink(path);
    return out;
}

static size_t below(uint32_t *state, size_t limit) {
    return (size_t)(shape_random(state) * (double)limit);
}

/* Numbers near limits, as an id, a count or a float. */
static uint32_t odd_number(uint32_t *state, const bytes *file) {
    const fct_format_header *h = (const void *)file->data;
    const uint32_t numbers[] = {0,
                                1,
                                2,
                                FCT_NONE,
                                FCT_NONE - 1,
                                0x7FFFFFFF,
                                0x80000000,
                                0x7FC00000, /* NaN */
                                0x7F800000,
                                0xFF800000,
                                0x7F7FFFFF,
                                h->face_count,
                                h->face_count - 1,
                                h->vertex_count,
                                h->node_count,
                                h->node_count + h->face_count,
                                h->node_count + h->face_count - 1,
                                h->root_count};
    return numbers[below(state, sizeof numbers / sizeof *numbers)];
}

/* Changes one place of the header or of the sections. */
static void change_bytes(uint32_t *state, const bytes *file, uint8_t *data) {
    const size_t head = sizeof(fct_format_header);
    size_t from = 0, to = file->size;
    if (below(state, 4) == 0)
        to = head;
    else
        from = head;
    size_t at = from + below(state, to - from), word = at / 4 * 4, other = from + below(state, to - from);
    uint32_t number = odd_number(state, file);
    switch (below(state, 5)) {
    case 0:
        data[at] ^= (uint8_t)(1u << below(state, 8));
        break;
    case 1:
        data[at] = (uint8_t)below(state, 256);
        break;
    case 2:
        memcpy(data + word, &number, 4);
        break;
    case 3: /* a small step of a number */
        memcpy(&number, data + word, 4);
        number += below(state, 2) ? 1 : FCT_NONE;
        memcpy(data + word, &number, 4);
        break;
    default: /* a word of another place */
        memmove(data + word, data + other / 4 * 4, 4);
    }
}

static void changed_files_are_refused_or_usable(void **state) {
    (void)state;
    enum { CHANGES = SANITIZED ? 1500 : 5000 };
    fct_env env = fct_env_default();
    uint32_t random = 1;
    for (int kind = 0; kind < 4; ++kind) {
        bytes file = make_file(&env, kind);
        uint32_t outcomes[MEND_OUTCOMES] = {0};
        for (int i = 0; i < CHANGES; ++i) {
            fuzz_limit limit;
            fct_env fuzzing = fuzz_env(&limit, file.size);
            uint8_t *data = malloc(file.size);
            memcpy(data, file.data, file.size);
            for (size_t n = i ? 1 + below(&random, 3) : 0; n > 0; --n) change_bytes(&random, &file, data);
            size_t size = below(&random, 50) ? file.size : below(&random, file.size);
            mend_outcome outcome = mend_try(&fuzzing, data, i ? size : file.size);
            if (i == 0) assert_int_equal(outcome, MEND_VERIFIED); /* no change */
            fuzz_end();
            ++outcomes[outcome];
            free(data);
        }
        printf("    %u refused, %u opened, %u sound, %u verified\n", outcomes[MEND_REFUSED],
               outcomes[MEND_OPENED], outcomes[MEND_SOUND], outcomes[MEND_VERIFIED]);
        for (int k = 0; k < MEND_OUTCOMES; ++k) assert_true(outcomes[k] > CHANGES / 100);
        free(file.data);
    }
}

/* Seeds of an older version would be refused before any of their content is read. */
static void seeds_of_the_fuzzer_are_trees(void **state) {
    (void)state;
    DIR *folder = opendir(FACETREE_SEEDS "/tree");
    uint32_t count = 0;
    assert_non_null(folder);
    for (struct dirent *entry; (entry = readdir(folder)) != NULL;) {
        char name[1024];
        fuzz_limit limit;
        if (entry->d_name[0] == '.') continue;
        snprintf(name, sizeof name, "%s/tree/%s", FACETREE_SEEDS, entry->d_name);
        bytes seed = read_file(name);
        fct_env env = fuzz_env(&limit, seed.size);
        assert_int_equal(mend_try(&env, seed.data, seed.size), MEND_VERIFIED);
        fuzz_end();
        free(seed.data);
        ++count;
    }
    closedir(folder);
    assert_true(count >= 3);
}

/* A change behind the header fails at a checksum, if it is not corrected. */
static void checksums_find_changes(void **state) {
    (void)state;
    fct_env env = fct_env_default();
    recorder r = {0};
    fct_env recording = recorder_env(&r);
    bytes file = make_file(&env, 0);
    fct_tree *tree;
    ++file.data[file.size - 64]; /* the last section */
    assert_int_equal(fct_tree_parse(&recording, "input", file.data, file.size, &tree), FCT_OK);
    assert_int_equal(fct_tree_verify(&recording, tree), FCT_ERROR_DATA);
    assert_non_null(strstr(r.text, "checksum"));
    fct_tree_destroy(tree);
    free(file.data);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(changed_files_are_refused_or_usable),
        cmocka_unit_test(checksums_find_changes),
        cmocka_unit_test(seeds_of_the_fuzzer_are_trees),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
