/* simplify/cost/channels.h: vertex colours, texture coordinates, normals and light as coordinates beside the
 * position (Garland 1999, section 5.2).
 *
 * A channel is one float of an attribute. Its factor scales the attribute to about unit range and then
 * multiplies it by its weight. Attributes of weight 0 come last: they are interpolated and do not steer.
 */
#ifndef FCT_SIMPLIFY_CHANNELS_H
#define FCT_SIMPLIFY_CHANNELS_H

#include "simplify/state.h"

/* Fills channels, channel_count and steering from the arrays of the mesh and the weights of the def; without
 * the weight of colours. */
void fct_simplify_channels(fct_simplifier *s);
/* Multiplies the colours by their weight, then allocates `attributes` and fills it with the scaled values of
 * every wedge. Needs the topology. Errors: MEMORY. */
fct_result fct_simplify_attributes(fct_simplifier *s);

#endif
