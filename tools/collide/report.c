/* tools/collide/report.c: see report.h. */
#include "tools/collide/report.h"

int collide_report_open(tool *t, bool contacts, collide_report *out) {
    *out = (collide_report){.tool = t, .contacts = contacts};
    if (!t->json || t->output) return tool_writer_open(t, t->output ? t->output : "-", &out->writer);
    out->results = json_array();
    return out->results ? TOOL_DONE : tool_fail(t, TOOL_MEMORY, "out of memory for the JSON output");
}

void collide_report_add(collide_report *r, json_t *result) {
    if (json_array_append_new(r->results, result)) r->incomplete = true;
}

/* --- Coordinates --- */

/* Coordinates relative to an origin need more digits. */
static void print_point(FILE *stream, const double point[3], const double origin[3]) {
    for (int k = 0; k < 3; ++k) fprintf(stream, " %.*g", origin[k] != 0 ? 15 : 9, origin[k] + point[k]);
}

static json_t *make_point(const double point[3], const double origin[3]) {
    return json_pack("[f, f, f]", origin[0] + point[0], origin[1] + point[1], origin[2] + point[2]);
}

/* --- Answers --- */

static const double zero[3] = {0, 0, 0};

static void report_touch(collide_report *r, const collide_answer *answer) {
    const fct_face_pair *p = &answer->nearest.pair;
    if (r->writer.stream && answer->found)
        fprintf(r->writer.stream, "1 %u %u\n", p->face_a, p->face_b);
    else if (r->writer.stream)
        fputs("0\n", r->writer.stream);
    if (r->results)
        collide_report_add(r, answer->found
                                  ? json_pack("{s:b, s:I, s:I}", "touching", 1, "face_a",
                                              (json_int_t)p->face_a, "face_b", (json_int_t)p->face_b)
                                  : json_pack("{s:b}", "touching", 0));
}

static void report_within(collide_report *r, const collide_answer *answer) {
    if (r->writer.stream) fputs(answer->found ? "1\n" : "0\n", r->writer.stream);
    if (r->results) collide_report_add(r, json_pack("{s:b}", "within", answer->found));
}

static void report_relation(collide_report *r, const collide_answer *answer) {
    static const char *const names[] = {[FCT_APART] = "apart",
                                        [FCT_TOUCHING] = "touching",
                                        [FCT_A_INSIDE] = "a-inside",
                                        [FCT_B_INSIDE] = "b-inside"};
    const char *name = names[answer->relation];
    if (r->writer.stream) fprintf(r->writer.stream, "%s\n", name);
    if (r->results) collide_report_add(r, json_pack("{s:s}", "relation", name));
}

static void report_distance(collide_report *r, const double origin[3], const collide_answer *answer) {
    const fct_distance *d = &answer->nearest;
    FILE *stream = r->writer.stream;
    if (stream && answer->found) {
        fprintf(stream, "%.9g %u %u", d->distance, d->pair.face_a, d->pair.face_b);
        print_point(stream, d->point_a, origin);
        print_point(stream, d->point_b, origin);
        fputc('\n', stream);
    } else if (stream) {
        fputs("-1\n", stream);
    }
    if (!r->results) return;
    collide_report_add(r, answer->found
                              ? json_pack("{s:f, s:I, s:I, s:o, s:o}", "distance", d->distance, "face_a",
                                          (json_int_t)d->pair.face_a, "face_b", (json_int_t)d->pair.face_b,
                                          "point_a", make_point(d->point_a, origin), "point_b",
                                          make_point(d->point_b, origin))
                              : json_pack("{s:n}", "distance"));
}

static json_t *make_pair(const fct_face_pair *pair, const fct_contact *contact, const double origin[3]) {
    if (!contact)
        return json_pack("{s:I, s:I}", "face_a", (json_int_t)pair->face_a, "face_b",
                         (json_int_t)pair->face_b);
    return json_pack("{s:I, s:I, s:o, s:o, s:o, s:f}", "face_a", (json_int_t)pair->face_a, "face_b",
                     (json_int_t)pair->face_b, "from", make_point(contact->from, origin), "to",
                     make_point(contact->to, origin), "normal", make_point(contact->normal, zero), "depth",
                     contact->depth);
}

static void print_pair(FILE *stream, const fct_face_pair *pair, const fct_contact *contact,
                       const double origin[3]) {
    fprintf(stream, "%u %u", pair->face_a, pair->face_b);
    if (contact) {
        print_point(stream, contact->from, origin);
        print_point(stream, contact->to, origin);
        print_point(stream, contact->normal, zero);
        fprintf(stream, " %.9g", contact->depth);
    }
    fputc('\n', stream);
}

static void report_pairs(collide_report *r, const collide_question *q, size_t number, const double origin[3],
                         const collide_answer *answer) {
    const collide_models *m = q->models;
    fct_pose pose = collide_pose(q->poses, number);
    json_t *list = r->results ? json_array() : NULL;
    for (size_t i = 0; i < answer->pair_count; ++i) {
        const fct_face_pair *pair = answer->pairs + i;
        fct_contact contact;
        bool known = r->contacts && fct_bvh_contact(m->a, m->b ? m->b : m->a, &pose, pair, &contact);
        if (r->writer.stream && m->b) fprintf(r->writer.stream, "%zu ", number);
        if (r->writer.stream) print_pair(r->writer.stream, pair, known ? &contact : NULL, origin);
        if (list && json_array_append_new(list, make_pair(pair, known ? &contact : NULL, origin)))
            r->incomplete = true;
    }
    if (r->results) collide_report_add(r, json_pack("{s:o}", "pairs", list));
}

void collide_report_answer(collide_report *r, const collide_question *question, size_t pose,
                           const collide_answer *answer) {
    const double *origin = question->poses->origin_a;
    r->found += question->kind == COLLIDE_PAIRS ? answer->pair_count : answer->found;
    switch (question->kind) {
    case COLLIDE_TOUCH:
        report_touch(r, answer);
        break;
    case COLLIDE_WITHIN:
        report_within(r, answer);
        break;
    case COLLIDE_RELATION:
        report_relation(r, answer);
        break;
    case COLLIDE_DISTANCE:
        report_distance(r, origin, answer);
        break;
    case COLLIDE_PAIRS:
        report_pairs(r, question, pose, origin, answer);
        break;
    }
}

void collide_report_bodies(collide_report *r, const fct_scene_view *scene, const fct_body_pair *pair) {
    const fct_instance *a = scene->instances + pair->body_a, *b = scene->instances + pair->body_b;
    ++r->found;
    if (r->writer.stream)
        fprintf(r->writer.stream, "%u %u %u %u\n", pair->body_a, pair->body_b, pair->faces.face_a,
                pair->faces.face_b);
    if (r->results)
        collide_report_add(r, json_pack("{s:I, s:I, s:o, s:o, s:I, s:I}", "instance_a",
                                        (json_int_t)pair->body_a, "instance_b", (json_int_t)pair->body_b,
                                        "name_a", tool_json_text(a->name), "name_b", tool_json_text(b->name),
                                        "face_a", (json_int_t)pair->faces.face_a, "face_b",
                                        (json_int_t)pair->faces.face_b));
}

int collide_report_close(collide_report *r, int code, json_t *object, bool asked) {
    tool *t = r->tool;
    if (code == TOOL_DONE && (r->incomplete || !object))
        code = tool_fail(t, TOOL_MEMORY, "out of memory for the JSON output");
    if (r->writer.stream) code = tool_writer_close(t, &r->writer, code);
    if (code == TOOL_DONE && r->results) json_object_set(object, "results", r->results);
    json_decref(r->results);
    if (code == TOOL_DONE)
        code = tool_json(t, object);
    else
        json_decref(object);
    return code == TOOL_DONE && asked && !r->found ? TOOL_NO : code;
}
