/* Least squares by reflections of Householder. */
#ifndef MSTMM_LEAST_SQUARES_H
#define MSTMM_LEAST_SQUARES_H

#include <math.h>

#include "mstmm.h"

/* Most equations. */
#define MSTMM_LEAST_SQUARES_ROWS 30

/* Zeros below the diagonal of column k.  Returns 1 where the column is zero. */
static inline int mstmm_reflect(int rows, int width, int k, real *system)
{
    real norm = 0, square = 0, v[MSTMM_LEAST_SQUARES_ROWS];
    for (int i = k; i < rows; i++) norm = hypot(norm, system[width * i + k]);
    if (!(norm > 0)) return 1;
    const real alpha = system[width * k + k] > 0 ? -norm : norm;
    for (int i = k; i < rows; i++) {
        v[i] = system[width * i + k] - (i == k ? alpha : 0);
        square += v[i] * v[i];
    }
    for (int j = k; j < width && square > 0; j++) {
        real dot = 0;
        for (int i = k; i < rows; i++) dot += v[i] * system[width * i + j];
        for (int i = k; i < rows; i++) system[width * i + j] -= 2 * dot / square * v[i];
    }
    return 0;
}

/* x (n x m): least squares of `rows` equations A x = b; system holds [A | b], destroyed.  Returns 1
 * for a rank below n. */
static inline int mstmm_least_squares(int rows, int n, int m, real *system, real *x)
{
    const int width = n + m;
    if (rows < n) return 1;
    for (int k = 0; k < n; k++)
        if (mstmm_reflect(rows, width, k, system)) return 1;
    for (int k = n - 1; k >= 0; k--) {
        if (!(fabs(system[width * k + k]) > 0)) return 1;
        for (int j = 0; j < m; j++) {
            x[m * k + j] = system[width * k + n + j];
            for (int i = k + 1; i < n; i++) x[m * k + j] -= system[width * k + i] * x[m * i + j];
            x[m * k + j] /= system[width * k + k];
        }
    }
    return 0;
}

#endif
