/* tools/view.h: the options of a view-dependent level, and its report. */
#ifndef FCT_TOOLS_VIEW_H
#define FCT_TOOLS_VIEW_H

#include <argp.h>

#include "facetree/progressive.h"
#include "tools/kit/command.h"

typedef struct view_options {
    const char *camera; /* NULL: no view */
    const char *other;  /* an option that needs a view; NULL: none */
    bool has_silhouette;
    fct_view view;
} view_options;

enum {
    KEY_BACK = TOOL_KEY + 100,
    KEY_COLOR_TOLERANCE,
    KEY_OUTSIDE,
    KEY_SILHOUETTE,
    KEY_SIZE,
    KEY_TOLERANCE,
    KEY_UP,
    KEY_VIEW
};

/* The rows of a table of options, in group 2. */
#define VIEW_OPTIONS                                                                                         \
    {NULL, 0, NULL, 0, "View:", 2},                                                                          \
        {"view",                                                                                             \
         KEY_VIEW,                                                                                           \
         "EX,EY,EZ,TX,TY,TZ[,FOV]",                                                                          \
         0,                                                                                                  \
         "The coarsest mesh that looks like the finest level to this camera: position of the eye, target "   \
         "and vertical field of view in degrees, 1 to 170 (default 35), as --camera of 'facetree render'",   \
         2},                                                                                                 \
        {"size", KEY_SIZE, "WxH", 0, "Width and height of the picture in pixels (default 1280x800)", 2},     \
        {"up", KEY_UP, "AXIS", 0, "The axis that points up: y (default) or z", 2},                           \
        {"tolerance",                                                                                        \
         KEY_TOLERANCE,                                                                                      \
         "PX",                                                                                               \
         0,                                                                                                  \
         "Pixels between the mesh and the finest level on the screen (default 1). 0 gives the finest "       \
         "level, inf the coarsest one",                                                                      \
         2},                                                                                                 \
        {"silhouette",                                                                                       \
         KEY_SILHOUETTE,                                                                                     \
         "PX",                                                                                               \
         0,                                                                                                  \
         "The same for silhouettes and open boundaries, at most that of --tolerance (default: half of it)",  \
         2},                                                                                                 \
        {"back",                                                                                             \
         KEY_BACK,                                                                                           \
         "FACTOR",                                                                                           \
         0,                                                                                                  \
         "Times the tolerance for surfaces that are seen from behind, 1 to inf (default 8)",                 \
         2},                                                                                                 \
        {"outside",                                                                                          \
         KEY_OUTSIDE,                                                                                        \
         "FACTOR",                                                                                           \
         0,                                                                                                  \
         "Times the tolerance outside of the picture, 1 to inf (default 8)",                                 \
         2},                                                                                                 \
    {                                                                                                        \
        "color-tolerance", KEY_COLOR_TOLERANCE, "C", 0,                                                      \
            "Also refine where a component of a vertex colour is off by more than C (default .03; inf: "     \
            "ignore colours)",                                                                               \
            2                                                                                                \
    }

view_options view_options_default(void);
/* Parses one of the options above, and checks them at ARGP_KEY_END. */
error_t view_parse(int key, const char *text, struct argp_state *state, view_options *o);

#endif
