/* tools/raycast/shots.c: see shots.h.
 *
 * A round shoots the next rays in chunks on all threads. A chunk writes its lines to a text of fixed size,
 * and stops before a ray whose lines do not fit. The texts are then written in order, up to the first chunk
 * that stopped. The next round begins at its ray, with smaller chunks. A ray with more hits than a text has
 * room for is shot alone, with memory for all its hits. So the lines do not depend on chunks or threads.
 */
#include "tools/raycast/shots.h"

#include <string.h>

#include "tools/kit/chunks.h"
#include "tools/kit/file.h"

enum {
    GRAIN = 256, /* rays per chunk at most */
    CHUNKS = 64, /* per round */
    LINE = 256,  /* bytes of the longest line: 3 numbers of 10 to 20 digits and 11 of at most 16 characters */
    HITS = 256,  /* of one ray, in a chunk */
    TEXT = HITS * LINE,
    CALM_ROUNDS = 8 /* without a chunk that stopped, before chunks become larger again */
};

typedef struct chunk_result {
    size_t done; /* rays */
    size_t hits, rays_hit, length;
} chunk_result;

typedef struct round_state {
    const raycast_question *question;
    bool writes;
    size_t first;         /* ray of the round */
    char *texts;          /* CHUNKS x TEXT; NULL if nothing is written */
    chunk_result *chunks; /* CHUNKS */
} round_state;

fct_ray raycast_ray(const tool_rows *rows, size_t i, const double origin[3]) {
    const double *r = rows->values + 8 * i;
    fct_ray ray = {.t_min = (float)r[6], .t_max = (float)r[7]};
    for (int k = 0; k < 3; ++k) ray.origin[k] = (float)(r[k] - origin[k]), ray.direction[k] = (float)r[3 + k];
    return ray;
}

/* --- Hits --- */

static void set_hit(const fct_hit *from, fct_scene_hit *to) {
    *to = (fct_scene_hit){.t = from->t,
                          .u = from->u,
                          .v = from->v,
                          .instance = FCT_NONE,
                          .face = from->face,
                          .place = from->place};
}

/* Returns the number of all hits, of which `hits` receives `capacity`. `room` has that many, for a mesh. */
static size_t find_hits(const raycast_question *q, const fct_ray *ray, size_t capacity, fct_hit *room,
                        fct_scene_hit *hits) {
    if (q->occlusion)
        return q->scene ? fct_scene_any_hit(q->scene, ray, NULL) : fct_bvh_any_hit(q->bvh, ray, NULL);
    if (q->scene)
        return q->all ? fct_scene_all_hits(q->scene, ray, capacity, hits, NULL)
                      : fct_scene_closest_hit(q->scene, ray, hits, NULL);
    size_t found = q->all ? fct_bvh_all_hits(q->bvh, ray, capacity, room, NULL)
                          : fct_bvh_closest_hit(q->bvh, ray, room, NULL);
    for (size_t i = 0; i < found && i < capacity; ++i) set_hit(room + i, hits + i);
    return found;
}

/* --- Lines --- */

static char *print_attributes(const raycast_question *q, const fct_scene_hit *hit, char *at, char *end) {
    fct_surface_point p;
    if (q->scene)
        fct_scene_point(q->scene, hit->instance, hit->place, hit->u, hit->v, &p);
    else
        fct_mesh_point(q->mesh, hit->face, hit->u, hit->v, &p);
    for (int i = 0; i < q->attributes.count; ++i) {
        unsigned kind = q->attributes.kind[i];
        const float *values = kind == FCT_MESH_NORMALS     ? p.normal
                              : kind == FCT_MESH_TEXCOORDS ? p.texcoord
                                                           : p.color;
        for (int k = 0; k < (kind == FCT_MESH_TEXCOORDS ? 2 : 3); ++k)
            at += snprintf(at, (size_t)(end - at), " %.9g", (double)values[k]);
    }
    return at;
}

/* One line, of LINE bytes at most. Returns its end. */
static char *print_hit(const raycast_question *q, size_t ray, const fct_scene_hit *hit, char *at) {
    char *end = at + LINE;
    if (q->all) at += snprintf(at, (size_t)(end - at), "%zu ", ray);
    if (q->scene) at += snprintf(at, (size_t)(end - at), "%u ", hit->instance);
    at += snprintf(at, (size_t)(end - at), "%u %.9g %.9g %.9g", hit->face, (double)hit->t, (double)hit->u,
                   (double)hit->v);
    if (q->attributes.count) at = print_attributes(q, hit, at, end);
    *at++ = '\n';
    return at;
}

static char *print_hits(const raycast_question *q, size_t ray, const fct_scene_hit *hits, size_t count,
                        char *at) {
    if (q->occlusion) return at + sprintf(at, "%zu\n", count);
    if (!count) return at + (q->all ? sprintf(at, "%zu -1\n", ray) : sprintf(at, "-1\n"));
    for (size_t i = 0; i < count; ++i) at = print_hit(q, ray, hits + i, at);
    return at;
}

/* --- Rounds --- */

static void shoot_chunk(void *user, size_t begin, size_t end, size_t chunk) {
    const round_state *s = user;
    const raycast_question *q = s->question;
    fct_hit room[HITS];
    fct_scene_hit hits[HITS];
    chunk_result result = {0};
    size_t capacity = s->writes ? HITS : q->all ? 0 : 1;
    for (size_t i = begin; i < end; ++i) {
        fct_ray ray = raycast_ray(q->rows, s->first + i, q->origin);
        size_t count = find_hits(q, &ray, capacity, room, hits);
        if (s->writes) {
            size_t lines = count ? count : 1;
            if (lines > (TEXT - result.length) / LINE) break;
            char *text = s->texts + chunk * TEXT, *at = text + result.length;
            result.length = (size_t)(print_hits(q, s->first + i, hits, count, at) - text);
        }
        ++result.done;
        result.hits += count, result.rays_hit += count > 0;
    }
    s->chunks[chunk] = result;
}

/* A ray with more hits than a chunk has room for. */
static int shoot_alone(tool *t, const raycast_question *q, size_t number, FILE *stream,
                       raycast_totals *totals) {
    char line[LINE];
    fct_ray ray = raycast_ray(q->rows, number, q->origin);
    size_t count = find_hits(q, &ray, 0, NULL, NULL);
    fct_hit *room = q->scene ? NULL : tool_allocate(t, count, sizeof *room);
    fct_scene_hit *hits = tool_allocate(t, count, sizeof *hits);
    int code = hits && (room || q->scene) ? TOOL_DONE : TOOL_MEMORY;
    if (code == TOOL_DONE) {
        find_hits(q, &ray, count, room, hits);
        for (size_t i = 0; i < count; ++i)
            fwrite(line, 1, (size_t)(print_hit(q, number, hits + i, line) - line), stream);
        totals->hits += count, ++totals->rays_hit;
    }
    tool_release(t, hits);
    tool_release(t, room);
    return code;
}

/* Shoots rays from s->first on, writes the lines of those that are complete, and moves s->first behind them.
 * *stopped: a chunk did not have room for all its rays. */
static int shoot_round(tool *t, round_state *s, size_t grain, FILE *stream, raycast_totals *totals,
                       bool *stopped) {
    size_t all = s->question->rows->count, rest = all - s->first, most = CHUNKS * grain;
    tool_loop loop = {.count = rest < most ? rest : most,
                      .grain = grain,
                      .body = shoot_chunk,
                      .user = s,
                      .phase = "rays",
                      .from = (double)s->first / (double)all};
    loop.to = (double)(s->first + loop.count) / (double)all;
    double start = tool_seconds();
    int code = tool_run_loop(t, &loop);
    totals->seconds += tool_seconds() - start;
    *stopped = false;
    for (size_t i = 0; i * grain < loop.count && code == TOOL_DONE && !*stopped; ++i) {
        const chunk_result *c = s->chunks + i;
        size_t left = loop.count - i * grain;
        if (stream) fwrite(s->texts + i * TEXT, 1, c->length, stream);
        totals->hits += c->hits, totals->rays_hit += c->rays_hit;
        s->first += c->done;
        *stopped = c->done < (left < grain ? left : grain);
        if (!*stopped || c->done > 0) continue;
        start = tool_seconds();
        code = shoot_alone(t, s->question, s->first, stream, totals);
        totals->seconds += tool_seconds() - start;
        ++s->first;
        *stopped = grain > 1; /* a chunk of one ray is complete now */
    }
    return code;
}

static int shoot_rounds(tool *t, round_state *s, FILE *stream, raycast_totals *totals) {
    size_t grain = GRAIN, calm = 0;
    int code = TOOL_DONE;
    t->bar.items = (double)s->question->rows->count;
    t->bar.unit = "rays";
    while (code == TOOL_DONE && s->first < s->question->rows->count) {
        bool stopped;
        code = shoot_round(t, s, grain, stream, totals, &stopped);
        calm = stopped ? 0 : calm + 1;
        if (stopped && grain > 1) grain /= 2;
        if (calm > CALM_ROUNDS && grain < GRAIN) grain *= 2, calm = 0;
    }
    return code;
}

int raycast_shoot(tool *t, const raycast_question *question, raycast_totals *totals) {
    tool_writer writer = {0};
    round_state s = {.question = question, .writes = !t->json || t->output};
    *totals = (raycast_totals){0};
    int code = s.writes ? tool_writer_open(t, t->output ? t->output : "-", &writer) : TOOL_DONE;
    if (code != TOOL_DONE) return code;
    s.chunks = tool_allocate(t, CHUNKS, sizeof *s.chunks);
    if (s.writes) s.texts = tool_allocate(t, CHUNKS, TEXT);
    if (!s.chunks || (s.writes && !s.texts)) code = TOOL_MEMORY;
    if (code == TOOL_DONE) code = shoot_rounds(t, &s, writer.stream, totals);
    tool_release(t, s.texts);
    tool_release(t, s.chunks);
    return s.writes ? tool_writer_close(t, &writer, code) : code;
}
