/* simplify/progressive/splits.h: writes and reads the steps of a progressive mesh, one after the other.
 *
 * docs/progressive-file.md describes the stream. Writer and reader keep the same lists of corners, so that a
 * step names points, corners and handles by their place in a list. One function describes both directions
 * (coder.h). A damaged stream cannot lead out of the arrays: values have a range, or are checked.
 */
#ifndef FCT_SIMPLIFY_SPLITS_H
#define FCT_SIMPLIFY_SPLITS_H

#include "simplify/progressive/corners.h"

/* Whether a split of m has no faces: it undoes the contraction of a pair. Cost: linear in the steps. */
bool fct_splits_have_pairs(const fct_progressive *m);
/* A writer of m, which is at its coarsest level. Errors: MEMORY. */
fct_result fct_splits_write(fct_progressive *m, fct_splits **out);
/* A reader, which adds what it reads to m. m has no steps, but the members of the head. Errors: MEMORY. */
fct_result fct_splits_read(fct_progressive *m, bool has_materials, bool has_face_colors, bool has_pairs,
                           fct_splits **out);
void fct_splits_close(fct_splits *splits);
/* Codes the next step. The coder must have begun. A reader then has m at the level after it. Errors: MEMORY;
 * DATA without a message, if the stream is damaged. */
fct_result fct_splits_step(fct_splits *splits);

#endif
