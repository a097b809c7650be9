/* The log of contractions: a sort by keys leaves each contraction the surroundings that it had. */
#include "base/hash.h"
#include "levels.h"
#include "simplify/contract.h"
#include "simplify/log.h"
#include "simplify/simplifier.h"

static fct_env env;

/* Faces in terms of points, and per point how often it has moved. */
typedef struct replay {
    uint32_t face_count, *triangles, *moves;
} replay;

static replay begin_replay(const fct_simplifier *s) {
    replay r = {s->mesh->face_count, NULL, calloc(s->point_count, sizeof(uint32_t))};
    r.triangles = malloc(3 * (size_t)r.face_count * sizeof *r.triangles);
    for (uint32_t c = 0; c < 3 * r.face_count; ++c) r.triangles[c] = s->point_of[s->mesh->triangles[c]];
    return r;
}

/* Repeats a contraction. Returns a hash of the faces at both ends before it, and of the moves of their
 * points. */
static uint64_t repeat_record(replay *r, const fct_record *record) {
    uint64_t sum = 0;
    for (uint32_t f = 0; f < r->face_count; ++f) {
        uint32_t *t = r->triangles + 3 * (size_t)f;
        bool kept = false, gone = false;
        for (int k = 0; k < 3; ++k) kept |= t[k] == record->kept, gone |= t[k] == record->gone;
        if (!kept && !gone) continue;
        uint64_t face = f;
        for (int k = 0; k < 3; ++k) face = fct_hash(face ^ ((uint64_t)t[k] << 32 | r->moves[t[k]]));
        sum += face;
        for (int k = 0; k < 3; ++k)
            if (t[k] == record->gone) t[k] = record->kept;
        if (kept && (gone || record->body)) t[0] = t[1] = t[2] = FCT_NONE - 1;
    }
    ++r->moves[record->kept];
    return sum;
}

static void end_replay(replay *r) {
    free(r->triangles), free(r->moves);
}

static int compare_records(const void *a, const void *b) {
    const fct_record *const *x = a, *const *y = b;
    if ((*x)->key != (*y)->key) return (*x)->key < (*y)->key ? -1 : 1;
    return *x < *y ? -1 : *x > *y;
}

/* The contractions of a mesh to `faces` faces, in the order of the log and sorted by their keys. */
static void check_surroundings(const fct_mesh *mesh, uint32_t faces) {
    fct_simplify_def def = fct_simplify_def_default();
    def.target_faces = faces;
    fct_simplifier *s;
    fct_stop stop;
    assert_int_equal(fct_simplifier_build(&env, mesh, &def, &s), FCT_OK);
    assert_int_equal(fct_log_create(s), FCT_OK);
    assert_int_equal(fct_simplify_contract(s, &stop), FCT_OK);
    uint32_t count = s->log->count, later = 0;
    assert_in_range(s->live_faces, faces - 1, faces);
    const fct_record **sorted = malloc(count * sizeof *sorted);
    uint64_t *hashes = malloc(count * sizeof *hashes);
    replay first = begin_replay(s), second = begin_replay(s);
    for (uint32_t i = 0; i < count; ++i) {
        sorted[i] = &s->log->records[i];
        hashes[i] = repeat_record(&first, sorted[i]);
        later += i > 0 && sorted[i]->key < sorted[i - 1]->key;
    }
    assert_true(later > 2); /* blocks, or the sort has nothing to do */
    qsort(sorted, count, sizeof *sorted, compare_records);
    for (uint32_t i = 0; i < count; ++i) {
        uint64_t hash = repeat_record(&second, sorted[i]);
        assert_true(hash == hashes[sorted[i] - s->log->records]);
    }
    end_replay(&first), end_replay(&second);
    free(sorted), free(hashes);
    fct_simplifier_destroy(s);
}

static void sorted_contractions_have_the_same_surroundings(void **state) {
    (void)state;
    fct_mesh torus = make_torus(&env, 50, false, false), needles = make_needles(&env, 80);
    check_surroundings(&torus, 100);
    check_surroundings(&needles, 200);
    fct_mesh_release(&env, &torus);
    fct_mesh_release(&env, &needles);
}

int main(void) {
    env = fct_env_default();
    const struct CMUnitTest tests[] = {cmocka_unit_test(sorted_contractions_have_the_same_surroundings)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
