/* Harmonic response; see harmonic_response.h. */
#include "harmonic_response.h"

#include <string.h>

/* A step so long that the contribution of coordinates is negligible. */
#define MSTMM_STILL 1e300

/* Increase of the stiffness by the loss factors. */
static int write_losses(mstmm_response *of)
{
    real *lost = of->contributions + 2 * of->n_numbers;
    const int code = mstmm_tangent_contributions(of->stiffer, 0, 0, 1);
    if (code) of->at->failure = of->stiffer->failure;
    for (int64_t k = 0; k < of->n_numbers; k++)
        lost[k] = of->stiffer->numbers[k] - of->at->numbers[k];
    return code;
}

int mstmm_response_begin(mstmm_response *of)
{
    mstmm_tangent *at = of->at;
    const size_t n = (size_t)of->n_numbers;
    real *by_rate = of->contributions, *by_square = by_rate + n;
    int code = mstmm_tangent_contributions(at, 0, 0, MSTMM_STILL);
    if (code) return code;
    memcpy(by_square, at->numbers, n * sizeof(real));
    code = mstmm_tangent_contributions(at, 1, 0, MSTMM_STILL);
    for (size_t k = 0; k < n; k++) by_rate[k] = at->numbers[k] - by_square[k];
    if (!code) code = mstmm_tangent_contributions(at, 0, 1, MSTMM_STILL);
    for (size_t k = 0; k < n; k++) by_square[k] = at->numbers[k] - by_square[k];
    if (!code) code = mstmm_tangent_contributions(at, 0, 0, 1);
    return code || !of->stiffer ? code : write_losses(of);
}

/* How many frequencies go at a time on this processor, and by what. */
static int choose_lanes(const mstmm_response *of, mstmm_response_few **by)
{
#ifdef MSTMM_FOUR_LANES
    if (of->lanes != 2 && __builtin_cpu_supports("avx2")) {
        *by = mstmm_response_by_4;
        return 4;
    }
#endif
    (void)of;
    *by = mstmm_response_by_2;
    return 2;
}

/* The same with the numbers of s from number k on. */
static mstmm_response response_from(const mstmm_response *of, int64_t k)
{
    mstmm_response at = *of;
    if (at.n_exact) at.exact += 2 * k * of->exact_numbers;
    if (at.pivots) at.pivots += k * of->n_pivots;
    return at;
}

void mstmm_response_many(mstmm_response *of, int64_t count, const real *s, int64_t n,
                         const real *columns, real *x, real *growth, int *grown)
{
    const int64_t size = 2 * n * of->at->model->nu;
    mstmm_response_few *by;
    const int most = choose_lanes(of, &by);
    for (int64_t k = 0; k < count; k += most) {
        const int some = count - k < most ? (int)(count - k) : most;
        mstmm_response at = response_from(of, k);
        by(&at, some, s + 2 * k, n, columns, x + k * size, growth + k, grown + k);
        /* A singular one invalidates the others in its vector. */
        const int spoiled = some > 1 && !isfinite(growth[k]);
        for (int j = 0; spoiled && j < some; j++) {
            at = response_from(of, k + j);
            by(&at, 1, s + 2 * (k + j), n, columns, x + (k + j) * size, growth + k + j,
               grown + k + j);
        }
        for (int j = 0; j < some; j++)
            if (!isfinite(growth[k + j])) memset(x + (k + j) * size, 0, (size_t)size * sizeof *x);
    }
}
