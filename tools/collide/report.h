/* tools/collide/report.h: answers as lines of text or as objects of JSON, in the coordinates of the files. */
#ifndef FCT_TOOLS_COLLIDE_REPORT_H
#define FCT_TOOLS_COLLIDE_REPORT_H

#include "tools/collide/answers.h"
#include "tools/kit/file.h"

typedef struct collide_report {
    tool *tool;
    tool_writer writer; /* of the lines; stream NULL: none */
    json_t *results;    /* NULL: none */
    bool incomplete;    /* no memory for a result */
    bool contacts;      /* pairs are followed by their contacts */
    size_t found;       /* poses with a yes; of pairs, the pairs */
} collide_report;

/* Without -o, --json collects the results instead of writing lines. Returns an exit code. */
int collide_report_open(tool *t, bool contacts, collide_report *out);
void collide_report_answer(collide_report *r, const collide_question *question, size_t pose,
                           const collide_answer *answer);
/* Two instances of a scene that touch. */
void collide_report_bodies(collide_report *r, const fct_scene_view *scene, const fct_body_pair *pair);
/* Adds a result, which may be NULL if memory was short. */
void collide_report_add(collide_report *r, json_t *result);
/* Prints the object with the results, unless `code` is an error. `object` may be NULL if memory was short.
 * Returns TOOL_NO if nothing was found and `asked`. */
int collide_report_close(collide_report *r, int code, json_t *object, bool asked);

#endif
