/* simplify/handle/wish.c: see wish.h. */
#include "simplify/handle/wish.h"

fct_result fct_wishes_copy(const fct_simplifier *s, fct_wishes *out) {
    *out = (fct_wishes){.mark_count = s->mark_count};
    const fct_array arrays[] = {FCT_ARRAY_IF(s->paint, out->paint, s->point_count),
                                FCT_ARRAY(out->marks, s->mark_count)};
    fct_result result = fct_allocate_all(s->env, arrays, FCT_LENGTH(arrays), "paint and constraints");
    if (result != FCT_OK) return result;
    if (s->paint) memcpy(out->paint, s->paint, s->point_count * sizeof *out->paint);
    if (s->mark_count) memcpy(out->marks, s->marks, s->mark_count * sizeof *out->marks);
    return FCT_OK;
}

fct_result fct_wishes_apply(fct_simplifier *s, const fct_wishes *wishes) {
    size_t known = s->mark_count;
    fct_result result = FCT_OK;
    bool same = !s->paint == !wishes->paint &&
                (!s->paint || !memcmp(s->paint, wishes->paint, s->point_count * sizeof *s->paint));
    if (!same) result = fct_paint_points(s, wishes->paint);
    return result == FCT_OK ? fct_mark_add(s, wishes->marks + known, wishes->mark_count - known) : result;
}

void fct_wishes_release(const fct_env *env, fct_wishes *wishes) {
    fct_release(env, wishes->paint);
    fct_release(env, wishes->marks);
}
