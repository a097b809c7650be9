/* radiosity/solve/iterate.h: repeats a sweep of gathers until the solution stops changing.
 *
 * Input: functions that gather one item and that publish a finished sweep. Invariant: all items of a sweep
 * read the radiosities of the sweep before (Jacobi), and sums follow fixed chunks, so the result does not
 * depend on the number of threads. Stop: |B_k - B_(k-1)| <= tolerance (1 - rho) / rho |B_k| in the
 * area-weighted 2-norm. If the operator has norm rho, then the remaining error is at most tolerance |B|.
 */
#ifndef FCT_RADIOSITY_ITERATE_H
#define FCT_RADIOSITY_ITERATE_H

#include "radiosity/solve/element.h"

/* Squared 2-norms over area and channels: of the change of B in this sweep, and of B itself. */
typedef struct fct_change {
    double change2, norm2;
} fct_change;

typedef struct fct_sweep_def {
    /* Computes the new irradiance of items [begin, end) and adds their part to *sum. Threads call it. */
    void (*gather)(void *user, size_t begin, size_t end, fct_change *sum);
    /* Publishes the new irradiances as radiosities. The calling thread calls it after each sweep. */
    void (*publish)(void *user);
    void *user;
    size_t count, grain; /* items; items per chunk */
    double tolerance;
    uint32_t most;     /* sweeps */
    const char *phase; /* for the progress hook; NULL: no progress, and no cancellation */
} fct_sweep_def;

typedef struct fct_sweep_result {
    uint32_t sweeps;
    double change; /* of the last sweep, relative to the solution */
    bool converged;
} fct_sweep_result;

/* Errors: MEMORY, CANCELLED. */
fct_result fct_iterate(const fct_elements *set, const fct_sweep_def *def, fct_sweep_result *out);

/* Adds area |new - old|^2 and area |new|^2 of the radiosity B = e + rho E of an element whose irradiance
 * changes from e->irradiance to `irradiance`. */
static inline void fct_change_add(fct_change *sum, const fct_element *e, const double irradiance[3]) {
    for (int c = 0; c < 3; ++c) {
        double d = e->reflectance[c] * (irradiance[c] - e->irradiance[c]);
        double b = e->emission[c] + e->reflectance[c] * irradiance[c];
        sum->change2 += e->area * d * d;
        sum->norm2 += e->area * b * b;
    }
}

#endif
