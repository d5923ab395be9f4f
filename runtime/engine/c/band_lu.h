/* Factorisation of a band matrix, or of a full one; zeros are skipped. */
#ifndef MSTMM_BAND_LU_H
#define MSTMM_BAND_LU_H

#include <math.h>
#include <stdint.h>

#include "mstmm.h"

/* a (n x width): of each row the entries from `below` before the diagonal on, with room for what
 * exchanges of rows fill; all of it where that is no more. */
typedef struct {
    int64_t n, below, above, width;
    real *a;
} mstmm_band;

static inline mstmm_band mstmm_band_of(int64_t n, int64_t below, int64_t above, real *a)
{
    const int64_t width = 2 * below + above + 1;
    return (mstmm_band){n, below, above, width < n ? width : n, a};
}

/* Address that column 0 of row i would have: columns are counted from there. */
static inline real *mstmm_band_row(const mstmm_band *of, int64_t i)
{
    return of->a + i * of->width - (of->width < of->n ? i - of->below : 0);
}

static inline real *mstmm_band_at(const mstmm_band *of, int64_t i, int64_t j)
{
    return mstmm_band_row(of, i) + j;
}

/* The end of the band beside entry i, which reaches so much farther. */
static inline int64_t mstmm_band_end(const mstmm_band *of, int64_t i, int64_t farther)
{
    return i + farther + 1 < of->n ? i + farther + 1 : of->n;
}

/* Sums of magnitudes by column. */
static inline void mstmm_band_sizes(const mstmm_band *of, real *sizes)
{
    for (int64_t j = 0; j < of->n; j++) sizes[j] = 0;
    for (int64_t i = 0; i < of->n; i++) {
        const real *row = mstmm_band_row(of, i);
        const int64_t end = mstmm_band_end(of, i, of->above);
        for (int64_t j = i > of->below ? i - of->below : 0; j < end; j++) sizes[j] += fabs(row[j]);
    }
}

/* The row from i on with the largest entry in column i, exchanged with row i from there on. */
static inline int64_t mstmm_band_exchange(const mstmm_band *of, int64_t i)
{
    const int64_t low = mstmm_band_end(of, i, of->below);
    const int64_t end = mstmm_band_end(of, i, of->below + of->above);
    real *row = mstmm_band_row(of, i), *other = row;
    int64_t best = i;
    for (int64_t k = i + 1; k < low; k++) {
        real *next = mstmm_band_row(of, k);
        if (fabs(other[i]) < fabs(next[i])) best = k, other = next;
    }
    for (int64_t j = i; best != i && j < end; j++) {
        const real entry = row[j];
        row[j] = other[j];
        other[j] = entry;
    }
    return best;
}

/* L and U in place with row exchanges, 1 / pivot on the diagonal; `exchanges` and `sizes` are n
 * numbers each.  Returns 1 if a pivot is not above `relative` times the magnitude of its column in
 * a (NaN included), 2 if the determinant is negative, else 0. */
static inline int mstmm_band_factor(const mstmm_band *of, real *exchanges, real *sizes,
                                    real relative)
{
    int negative = 0;
    mstmm_band_sizes(of, sizes);
    for (int64_t i = 0; i < of->n; i++) {
        const int64_t best = mstmm_band_exchange(of, i), low = mstmm_band_end(of, i, of->below);
        int64_t end = mstmm_band_end(of, i, of->below + of->above);
        real *row = mstmm_band_row(of, i);
        exchanges[i] = (real)best;
        if (!(fabs(row[i]) > relative * sizes[i])) return 1;
        negative ^= (best != i) ^ (row[i] < 0);
        row[i] = 1 / row[i];
        while (end > i + 1 && fabs(row[end - 1]) <= 0) end--;
        for (int64_t k = i + 1; k < low; k++) {
            real *other = mstmm_band_row(of, k);
            if (fabs(other[i]) <= 0) continue;
            const real factor = other[i] *= row[i];
            for (int64_t j = i + 1; j < end; j++) other[j] -= factor * row[j];
        }
    }
    return negative ? 2 : 0;
}

/* Solves for x (n), initially the right-hand side, with known factors. */
static inline void mstmm_band_solve(const mstmm_band *of, const real *exchanges, real *x)
{
    for (int64_t i = 0; i < of->n; i++) {
        const int64_t other = (int64_t)exchanges[i], low = mstmm_band_end(of, i, of->below);
        const real entry = x[other];
        x[other] = x[i];
        x[i] = entry;
        for (int64_t k = i + 1; k < low && fabs(entry) > 0; k++)
            x[k] -= *mstmm_band_at(of, k, i) * entry;
    }
    for (int64_t i = of->n - 1; i >= 0; i--) {
        const int64_t end = mstmm_band_end(of, i, of->below + of->above);
        const real *row = mstmm_band_row(of, i);
        for (int64_t k = i + 1; k < end; k++) x[i] -= row[k] * x[k];
        x[i] *= row[i];
    }
}

#endif
