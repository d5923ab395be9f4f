/* The linear equations of a scene about a state; see linear.h. */
#include "linear.h"

#include "finite.h"

#include <string.h>

int64_t mstmm_linear_numbers(const mstmm_linear_code *code)
{
    const int64_t n = code->n;
    return code->fused->nu + 4 * n * n + n + code->fused->nq;
}

int mstmm_linear_at(const mstmm_linear_code *code, real t, const real *q, const real *u,
                    const real *efforts, real *found)
{
    const mstmm_fused *fused = code->fused;
    const int64_t n = code->n, square = n * n, count = mstmm_linear_numbers(code);
    real *a = found, *m = a + fused->nu, *r_t = m + 4 * square, *qdot = r_t + n;
    if (!isfinite(t) || !mstmm_finite(fused->nq, q) || !mstmm_finite(fused->nu, u)) return 1;
    mstmm_renew_inputs(&code->live, t, code->memory, code->p);
    int failed = fused->accelerations(code->p, &t, q, u, code->memory, efforts, qdot, a);
    if (!failed)
        failed = fused->linear(code->p, &t, q, u, code->memory, a, m, m + square, m + 2 * square,
                               m + 3 * square, r_t);
    return failed || !mstmm_finite(count, found);
}

int mstmm_linear_swept(mstmm_tangent *at, real t, const real *q, const real *u, const real *a,
                       int n, const int *free, real *found, real *work)
{
    const int64_t nq = at->model->nq, nu = at->model->nu;
    real *column = work, *unit = column + nu, *still = unit + nu, *moved = still + nq + nu;
    memset(work, 0, (size_t)(nq + 3 * nu) * sizeof(real));
    int code = mstmm_residual(at, t, q, u, a, column, NULL);
    for (int k = 0; k < n; k++)
        for (int kind = 0; !code && kind < 3; kind++) {
            unit[free[k]] = 1;
            /* The change of the rates along a speed is how coordinates follow it. */
            if (kind == 2) mstmm_rates_slope(at, moved);
            code = mstmm_residual_slope(at, 0, kind == 2 ? moved : still, kind == 1 ? unit : still,
                                        kind == 0 ? unit : still, column);
            unit[free[k]] = 0;
            for (int i = 0; !code && i < n; i++) found[(kind * n + i) * n + k] = column[free[i]];
        }
    return code;
}

typedef real two_reals __attribute__((vector_size(2 * sizeof(real)), aligned(sizeof(real)), may_alias));

/* to -= factor from, of m numbers */
static void take_away(int m, real factor, const real *restrict from, real *restrict to)
{
    int c = 0;
    for (; c + 4 <= m; c += 4) {
        const two_reals *other = (const two_reals *)(from + c);
        two_reals *own = (two_reals *)(to + c);
        own[0] -= factor * other[0];
        own[1] -= factor * other[1];
    }
    for (; c < m; c++) to[c] -= factor * from[c];
}

/* M = L^T D L from the last speed to the first, which leaves zeros between branches of a tree what
 * they are (R. Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 6.5).  Below the diagonal
 * `factors` gets L, on it 1 / D. */
static int factored(int n, const real *restrict mass, real *restrict factors)
{
    memcpy(factors, mass, (size_t)(n * n) * sizeof(real));
    for (int k = n - 1; k >= 0; k--) {
        real *last = factors + n * k;
        if (!(last[k] > 0)) return 1;
        last[k] = 1 / last[k];
        for (int i = k - 1; i >= 0; i--) {
            const real scaled = last[i] * last[k];
            if (scaled == 0) continue;
            take_away(i + 1, scaled, last, factors + n * i);
            last[i] = scaled;
        }
    }
    return 0;
}

/* rows (n x m) become M^-1 rows; `factors` are n x n numbers of room. */
static int divide_by_mass(int n, int m, const real *restrict mass, real *restrict rows,
                          real *restrict factors)
{
    if (factored(n, mass, factors)) return 1;
    for (int i = n - 1; i >= 0; i--)
        for (int j = 0; j < i; j++)
            if (factors[n * i + j] != 0)
                take_away(m, factors[n * i + j], rows + m * i, rows + m * j);
    for (int i = 0; i < n; i++) {
        for (int c = 0; c < m; c++) rows[m * i + c] *= factors[n * i + i];
        for (int j = 0; j < i; j++)
            if (factors[n * i + j] != 0)
                take_away(m, factors[n * i + j], rows + m * j, rows + m * i);
    }
    return 0;
}

int mstmm_state_matrix(const mstmm_linear_code *code, const real *found, int turning, real *matrix)
{
    const int n = code->n;
    const real *M = found + code->fused->nu, *C = M + n * n, *K = C + n * n, *G = K + n * n;
    real *below = matrix + 2 * n * n;
    memset(matrix, 0, 2 * (size_t)(n * n) * sizeof(real));
    for (int i = 0; i < n; i++) {
        matrix[2 * n * i + n + i] = 1;
        for (int j = 0; j < n; j++) {
            below[2 * n * i + j] = -K[n * i + j];
            below[2 * n * i + n + j] = -C[n * i + j];
        }
    }
    const int singular = divide_by_mass(n, 2 * n, M, below, code->work);
    /* x'' = G x' + u', where u' goes with u = x' - G x. */
    for (int i = 0; turning && i < n; i++) {
        real *by_x = below + 2 * n * i, *by_rate = by_x + n;
        for (int k = 0; k < n; k++)
            for (int j = 0; j < n; j++) by_x[j] -= by_rate[k] * G[n * k + j];
        for (int j = 0; j < n; j++) by_rate[j] += G[n * i + j];
    }
    return singular || !mstmm_finite(2 * n * n, below);
}

int mstmm_accelerations_about(const mstmm_linear_code *code, real t, const real *q, const real *u,
                              const real *efforts, real *found, real *slopes)
{
    const int n = code->n, width = 3 * n + 1;
    const real *M = found + code->fused->nu, *C = M + n * n, *K = C + n * n, *r_t = K + 2 * n * n;
    if (mstmm_linear_at(code, t, q, u, efforts, found)) return 1;
    for (int i = 0; i < n; i++) {
        real *right = slopes + i * width;
        for (int j = 0; j < n; j++) {
            right[j] = -K[n * i + j];
            right[n + j] = -C[n * i + j];
            right[2 * n + j] = i == j;
        }
        right[3 * n] = -r_t[i];
    }
    return divide_by_mass(n, width, M, slopes, code->work) || !mstmm_finite(n * width, slopes);
}
