/* Small dense matrices, row by row. */
#include <math.h>

#include "parts.h"

void classical_multiply(int n, int k, int m, const real *a, const real *b, real *out)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < m; j++) {
            real sum = 0;
            for (int l = 0; l < k; l++) sum += a[k * i + l] * b[m * l + j];
            out[m * i + j] = sum;
        }
}

static void exchange(int m, real *a, int i, int j)
{
    for (int k = 0; k < m && i != j; k++) {
        const real kept = a[m * i + k];
        a[m * i + k] = a[m * j + k];
        a[m * j + k] = kept;
    }
}

/* b (n x m) := a^-1 b, by rows scaled to one; a is destroyed.  Returns 1 where a is singular. */
int classical_solve(int n, int m, real *a, real *b)
{
    for (int i = 0; i < n; i++) {
        real size = 0;
        for (int j = 0; j < n; j++) size = fmax(size, fabs(a[n * i + j]));
        if (!(size > 0)) return 1;
        for (int j = 0; j < n; j++) a[n * i + j] /= size;
        for (int j = 0; j < m; j++) b[m * i + j] /= size;
    }
    for (int k = 0; k < n; k++) {
        int best = k;
        for (int i = k + 1; i < n; i++)
            if (fabs(a[n * i + k]) > fabs(a[n * best + k])) best = i;
        exchange(n, a, k, best);
        exchange(m, b, k, best);
        if (!(fabs(a[n * k + k]) > 0)) return 1;
        for (int i = k + 1; i < n; i++) {
            const real factor = a[n * i + k] / a[n * k + k];
            for (int j = k; j < n; j++) a[n * i + j] -= factor * a[n * k + j];
            for (int j = 0; j < m; j++) b[m * i + j] -= factor * b[m * k + j];
        }
    }
    for (int k = n - 1; k >= 0; k--)
        for (int j = 0; j < m; j++) {
            for (int i = k + 1; i < n; i++) b[m * k + j] -= a[n * k + i] * b[m * i + j];
            b[m * k + j] /= a[n * k + k];
        }
    return 0;
}
