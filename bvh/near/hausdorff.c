/* bvh/near/hausdorff.c: the largest distance of any point of one surface from the other, by branch and bound.
 *
 * The distances of the corners of a triangle are lower bounds of the largest distance on it. The distance
 * from one face of the other surface is a convex function, so on a triangle it is largest at a corner. So the
 * least over the corners' nearest faces of the largest distance of a corner from that face is an upper bound.
 * A triangle whose upper bound exceeds the largest known distance by more than the tolerance is halved along
 * its longest edge. O(V + F) queries, and those of the triangles that are halved.
 */
#include "base/parallel.h"
#include "bvh/near/nearest.h"
#include "bvh/near/triangle.h"

enum { CHUNK = 512 /* vertices or faces per task */ };

/* Of the diagonal of both models. The least tolerance, so that halving ends: three levels halve an edge, so
 * triangles are smaller than the tolerance after 75 levels, and a stack holds one triangle per level. */
#define LEAST_TOLERANCE 1e-7
enum { STACK = 128 };

typedef struct sample {
    v3 point;
    double distance;
    uint32_t place; /* of the nearest face of the other surface */
} sample;

typedef struct triangle {
    sample corner[3];
} triangle;

typedef struct hausdorff_job {
    const fct_bvh *from, *to;
    double relative, absolute, least;
    const uint32_t *used; /* vertices that faces use */
    sample *vertices;     /* per vertex */
    sample known;         /* the farthest vertex */
    sample *parts;        /* per chunk: the farthest point; its place is that of the face it lies on */
} hausdorff_job;

static sample measure_point(const fct_bvh *to, v3 point) {
    fct_near near = {.place = 0};
    fct_nearest_search(to, point, NULL, INFINITY, &near, NULL);
    return (sample){point, sqrt(near.distance2), near.place};
}

static void measure_vertices(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)chunk, (void)thread;
    const hausdorff_job *job = user;
    for (size_t i = begin; i < end; ++i) {
        const float *p = job->from->view.positions + 3 * (size_t)job->used[i];
        job->vertices[job->used[i]] = measure_point(job->to, v3_load(p));
    }
}

static double distance_from_face(const fct_bvh *to, uint32_t place, v3 point) {
    const uint32_t *t = to->view.triangles + 3 * (size_t)place;
    v3 p[3];
    double u, v;
    for (int c = 0; c < 3; ++c) p[c] = v3_load(to->view.positions + 3 * (size_t)t[c]);
    return v3_norm(v3_sub(fct_triangle_closest(point, p[0], p[1], p[2], &u, &v), point));
}

/* The largest distance of the corners from one face. */
static double bound_by_face(const fct_bvh *to, uint32_t place, const triangle *t) {
    double most = 0;
    for (int k = 0; k < 3; ++k) {
        const sample *corner = &t->corner[k];
        most = fct_max(most, corner->place == place ? corner->distance
                                                    : distance_from_face(to, place, corner->point));
    }
    return most;
}

/* Whether no point of the triangle is farther than `limit`, by the faces nearest to its corners and its
 * middle. *middle receives the middle if it was measured; else its distance stays. */
static bool stays_within(const fct_bvh *to, const triangle *t, double limit, sample *middle) {
    for (int i = 0; i < 3; ++i)
        if (bound_by_face(to, t->corner[i].place, t) <= limit) return true;
    v3 sum = v3_add(t->corner[0].point, v3_add(t->corner[1].point, t->corner[2].point));
    *middle = measure_point(to, v3_scale(sum, 1. / 3));
    return middle->distance <= limit && bound_by_face(to, middle->place, t) <= limit;
}

/* Replaces t by two halves; returns whether it is large enough. */
static bool halve_triangle(const hausdorff_job *job, const triangle *t, triangle halves[2]) {
    int longest = 0;
    double length2[3];
    for (int i = 0; i < 3; ++i) {
        length2[i] = v3_norm2(v3_sub(t->corner[(i + 1) % 3].point, t->corner[i].point));
        if (length2[i] > length2[longest]) longest = i;
    }
    if (!(length2[longest] > job->least * job->least)) return false;
    int a = longest, b = (longest + 1) % 3;
    v3 middle = v3_scale(v3_add(t->corner[a].point, t->corner[b].point), .5);
    halves[0] = halves[1] = *t;
    halves[0].corner[b] = halves[1].corner[a] = measure_point(job->to, middle);
    return true;
}

static double tolerance_of(const hausdorff_job *job, double distance) {
    return fct_max(job->relative * distance + job->absolute, job->least);
}

static void keep_farther(sample *best, const sample *s, uint32_t place) {
    if (s->distance > best->distance) *best = *s, best->place = place;
}

static void search_triangle(const hausdorff_job *job, const triangle *whole, uint32_t place, sample *best) {
    triangle stack[STACK];
    uint32_t height = 1;
    stack[0] = *whole;
    while (height) {
        triangle t = stack[--height];
        sample middle = {.distance = -1};
        for (int c = 0; c < 3; ++c) keep_farther(best, &t.corner[c], place);
        bool within = stays_within(job->to, &t, best->distance + tolerance_of(job, best->distance), &middle);
        keep_farther(best, &middle, place);
        if (within) continue;
        if (height + 2 <= STACK && halve_triangle(job, &t, stack + height)) height += 2;
    }
}

static void search_faces(void *user, size_t begin, size_t end, size_t chunk, uint32_t thread) {
    (void)thread;
    const hausdorff_job *job = user;
    sample best = job->known;
    for (size_t i = begin; i < end; ++i) {
        triangle t;
        for (int c = 0; c < 3; ++c) t.corner[c] = job->vertices[job->from->view.triangles[3 * i + (size_t)c]];
        search_triangle(job, &t, (uint32_t)i, &best);
    }
    job->parts[chunk] = best;
}

/* The farthest vertex, and a face that has it. */
static sample find_farthest_vertex(const hausdorff_job *job) {
    const fct_tree_view *view = &job->from->view;
    sample best = {.distance = -1};
    for (size_t i = 0; i < 3 * (size_t)view->face_count; ++i) {
        const sample *s = &job->vertices[view->triangles[i]];
        if (s->distance > best.distance) best = *s, best.place = (uint32_t)(i / 3);
    }
    return best;
}

/* Fills used with the vertices that faces use, and returns their number. */
static size_t list_used_vertices(const fct_tree_view *view, uint32_t *used) {
    for (uint32_t i = 0; i < view->vertex_count; ++i) used[i] = 0;
    for (size_t i = 0; i < 3 * (size_t)view->face_count; ++i) used[view->triangles[i]] = 1;
    size_t count = 0;
    for (uint32_t i = 0; i < view->vertex_count; ++i)
        if (used[i]) used[count++] = i;
    return count;
}

static fct_result search_one_way(const fct_env *env, hausdorff_job *job, sample *out) {
    const fct_tree_view *view = &job->from->view;
    uint32_t *used = fct_allocate(env, view->vertex_count, sizeof *used);
    job->vertices = fct_allocate(env, view->vertex_count, sizeof *job->vertices);
    job->parts = fct_allocate(env, fct_chunk_count(view->face_count, CHUNK), sizeof *job->parts);
    fct_result result = FCT_OK;
    if (!used || !job->vertices || !job->parts) {
        result = fct_fail_memory(env, "a comparison");
        goto done;
    }
    size_t count = list_used_vertices(view, used);
    job->used = used;
    result = fct_parallel_for_progress(env, "comparing", count, CHUNK, measure_vertices, job);
    if (result != FCT_OK) goto done;
    job->known = find_farthest_vertex(job);
    result = fct_parallel_for_progress(env, "comparing", view->face_count, CHUNK, search_faces, job);
    *out = job->known;
    for (size_t i = 0; i < fct_chunk_count(view->face_count, CHUNK) && result == FCT_OK; ++i)
        if (job->parts[i].distance > out->distance) *out = job->parts[i];
done:
    fct_release(env, used);
    fct_release(env, job->vertices);
    fct_release(env, job->parts);
    return result;
}

static double find_diagonal(const fct_bvh *bvh) {
    return v3_norm(v3_sub(v3_load(bvh->bounds.upper), v3_load(bvh->bounds.lower)));
}

fct_result fct_mesh_hausdorff(const fct_env *env, const fct_bvh *a, const fct_bvh *b, double relative,
                              double absolute, fct_hausdorff *out) {
    if (a->embree || b->embree)
        return fct_fail(env, FCT_ERROR_DATA, "expected two structures of the OBB backend");
    if (!(relative >= 0) || !(absolute >= 0))
        return fct_fail(env, FCT_ERROR_DATA, "tolerances %g and %g, expected 0 or more", relative, absolute);
    hausdorff_job job = {.relative = relative, .absolute = absolute};
    job.least = LEAST_TOLERANCE * fct_max(find_diagonal(a), find_diagonal(b));
    sample ends[2];
    fct_result result = FCT_OK;
    for (int k = 0; k < 2 && result == FCT_OK; ++k) {
        job.from = k ? b : a, job.to = k ? a : b;
        result = search_one_way(env, &job, &ends[k]);
    }
    if (result != FCT_OK) return result;
    *out = (fct_hausdorff){.distance_ab = ends[0].distance, .distance_ba = ends[1].distance};
    out->distance = fct_max(ends[0].distance, ends[1].distance);
    for (int k = 0; k < 2; ++k) {
        const fct_bvh *from = k ? b : a;
        double *point = k ? out->point_b : out->point_a;
        point[0] = ends[k].point.x, point[1] = ends[k].point.y, point[2] = ends[k].point.z;
        *(k ? &out->face_b : &out->face_a) = from->view.face_ids[ends[k].place];
    }
    return FCT_OK;
}
