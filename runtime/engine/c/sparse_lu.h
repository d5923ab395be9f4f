/* Factors of a full matrix with many zeros: those on the way are passed over. */
#ifndef MSTMM_SPARSE_LU_H
#define MSTMM_SPARSE_LU_H

#include <math.h>
#include <stdint.h>

#include "mstmm.h"

/* a (n x n) becomes L and U with row exchanges, 1 / pivot on the diagonal; `exchanges` and `sizes`
 * are n numbers each.  Returns 1 if a pivot is not above `relative` times the magnitude of its
 * column in a (NaN included), 2 if the determinant is negative, else 0. */
static inline int mstmm_sparse_factor(int64_t n, real *a, real *exchanges, real *sizes,
                                      real relative)
{
    int negative = 0;
    for (int64_t j = 0; j < n; j++) sizes[j] = 0;
    for (int64_t i = 0; i < n; i++)
        for (int64_t j = 0; j < n; j++) sizes[j] += fabs(a[i * n + j]);
    for (int64_t i = 0; i < n; i++) {
        int64_t best = i, end = n;
        for (int64_t k = i + 1; k < n; k++)
            if (fabs(a[best * n + i]) < fabs(a[k * n + i])) best = k;
        exchanges[i] = (real)best;
        for (int64_t j = 0; best != i && j < n; j++) {
            const real entry = a[i * n + j];
            a[i * n + j] = a[best * n + j];
            a[best * n + j] = entry;
        }
        const real pivot = a[i * n + i];
        if (!(fabs(pivot) > relative * sizes[i])) return 1;
        negative ^= (best != i) ^ (pivot < 0);
        a[i * n + i] = 1 / pivot;
        while (end > i + 1 && fabs(a[i * n + end - 1]) <= 0) end--;
        for (int64_t k = i + 1; k < n; k++) {
            if (fabs(a[k * n + i]) <= 0) continue;
            const real factor = a[k * n + i] *= a[i * n + i];
            for (int64_t j = i + 1; j < end; j++) a[k * n + j] -= factor * a[i * n + j];
        }
    }
    return negative ? 2 : 0;
}

/* x (n), the right-hand side at first, by factors that are known. */
static inline void mstmm_sparse_solve(int64_t n, const real *a, const real *exchanges, real *x)
{
    for (int64_t i = 0; i < n; i++) {
        const int64_t other = (int64_t)exchanges[i];
        const real entry = x[i];
        x[i] = x[other];
        x[other] = entry;
    }
    for (int64_t i = 0; i < n; i++)
        for (int64_t k = 0; k < i; k++) x[i] -= a[i * n + k] * x[k];
    for (int64_t i = n - 1; i >= 0; i--) {
        for (int64_t k = i + 1; k < n; k++) x[i] -= a[i * n + k] * x[k];
        x[i] *= a[i * n + i];
    }
}

#endif
