/* The linear equations of a scene about a state; see linear_equations.h. */
#include "linear_equations.h"

#include "is_finite.h"
#include "four_lanes.h"

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

/* M = L^T D L from the last speed to the first, which leaves zeros between branches of a tree what
 * they are (R. Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 6.5).  Below the diagonal
 * `factors` gets L, on it 1 / D. */
static int factor_mass(int n, const real *restrict mass, real *restrict factors)
{
    memcpy(factors, mass, (size_t)(n * n) * sizeof(real));
    for (int k = n - 1; k >= 0; k--) {
        real *last = factors + n * k;
        if (!(last[k] > 0)) return 1;
        last[k] = 1 / last[k];
        for (int i = k - 1; i >= 0; i--) {
            const real scaled = last[i] * last[k];
            if (scaled == 0) continue;
            for (int j = 0; j <= i; j++) factors[n * i + j] -= scaled * last[j];
            last[i] = scaled;
        }
    }
    return 0;
}

/* Columns solved at a time, which stay in registers; columns of one call, taken together:
 * `to` (rows `stride` apart) becomes -M^-1 from (n x width), M^-1 where there is none. */
enum { TILE = MSTMM_TILE_COLUMNS };
typedef struct {
    const real *from;
    int width, stride;
    real *to;
} columns;

/* The next `width` columns from `first` on, side by side in rows of a tile. */
static void fill_tile(int n, const columns *of, int first, int width, real *tile)
{
    for (int i = 0; i < n; i++)
        for (int k = 0; k < width; k++)
            tile[TILE * i + k] =
                of->from ? -of->from[of->width * i + first + k] : (real)(i == first + k);
}

static void store_tile(int n, const columns *of, int first, int width, const real *tile)
{
    for (int i = 0; i < n; i++)
        memcpy(of->to + of->stride * i + first, tile + TILE * i, (size_t)width * sizeof(real));
}

/* Four numbers: with longer vectors compilers for shorter registers use memory. */
typedef real quad __attribute__((vector_size(4 * sizeof(real)), aligned(sizeof(real)), may_alias));

/* A row of a tile, by name so that it stays in registers. */
typedef struct {
    quad a, b, c, d, e, f, g, h;
} row;
_Static_assert(sizeof(row) == TILE * sizeof(real), "a row is as wide as a tile");

MSTMM_INLINE void subtract_row(row *own, real times, const real *other)
{
    const quad factor = {times, times, times, times}, *from = (const quad *)other;
    own->a -= factor * from[0];
    own->b -= factor * from[1];
    own->c -= factor * from[2];
    own->d -= factor * from[3];
    own->e -= factor * from[4];
    own->f -= factor * from[5];
    own->g -= factor * from[6];
    own->h -= factor * from[7];
}

MSTMM_INLINE void get_row(row *own, real times, const real *of)
{
    const quad factor = {times, times, times, times}, *from = (const quad *)of;
    own->a = factor * from[0], own->b = factor * from[1];
    own->c = factor * from[2], own->d = factor * from[3];
    own->e = factor * from[4], own->f = factor * from[5];
    own->g = factor * from[6], own->h = factor * from[7];
}

MSTMM_INLINE void put_row(const row *own, real *to)
{
    quad *into = (quad *)to;
    into[0] = own->a, into[1] = own->b, into[2] = own->c, into[3] = own->d;
    into[4] = own->e, into[5] = own->f, into[6] = own->g, into[7] = own->h;
}

MSTMM_WIDE static void solve_tile(int n, const real *restrict factors, real *restrict tile)
{
    row own;
    for (int j = n - 1; j >= 0; j--) {
        get_row(&own, 1, tile + TILE * j);
        for (int i = n - 1; i > j; i--)
            if (factors[n * i + j] != 0) subtract_row(&own, factors[n * i + j], tile + TILE * i);
        put_row(&own, tile + TILE * j);
    }
    for (int i = 0; i < n; i++) {
        get_row(&own, factors[n * i + i], tile + TILE * i);
        for (int j = 0; j < i; j++)
            if (factors[n * i + j] != 0) subtract_row(&own, factors[n * i + j], tile + TILE * j);
        put_row(&own, tile + TILE * i);
    }
}

/* As many columns as a tile holds, laid out there or taken back from it, from column `first` of
 * *all on; returns where the next ones begin. */
static const columns *copy_tile(int n, const columns *all, const columns *end, int *first, int back,
                                real *tile)
{
    for (int used = 0; all < end && used < TILE;) {
        const int left = all->width - *first, room = TILE - used;
        const int width = left < room ? left : room;
        if (back)
            store_tile(n, all, *first, width, tile + used);
        else
            fill_tile(n, all, *first, width, tile + used);
        used += width;
        *first += width;
        if (*first == all->width) all++, *first = 0;
    }
    return all;
}

/* All columns by the mass matrix (n x n); `work` as mstmm_linear_code has it. */
static int divide_by_mass(int n, const real *mass, int count, const columns *all, real *work)
{
    const columns *end = all + count;
    real *tile = work + n * n;
    int first = 0, behind = 0;
    if (factor_mass(n, mass, work)) return 1;
    memset(tile, 0, (size_t)(TILE * n) * sizeof(real));
    while (all < end) {
        copy_tile(n, all, end, &first, 0, tile);
        solve_tile(n, work, tile);
        all = copy_tile(n, all, end, &behind, 1, tile);
    }
    return 0;
}

int mstmm_state_matrix(const mstmm_linear_code *code, const real *found, int turning, real *matrix)
{
    const int n = code->n;
    const real *M = found + code->fused->nu, *C = M + n * n, *K = C + n * n, *G = K + n * n;
    real *below = matrix + 2 * n * n;
    const columns both[] = {{K, n, 2 * n, below}, {C, n, 2 * n, below + n}};
    memset(matrix, 0, 2 * (size_t)(n * n) * sizeof(real));
    for (int i = 0; i < n; i++) matrix[2 * n * i + n + i] = 1;
    const int singular = divide_by_mass(n, M, 2, both, code->work);
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
    const columns all[] = {{K, n, width, slopes},
                           {C, n, width, slopes + n},
                           {NULL, n, width, slopes + 2 * n},
                           {r_t, 1, width, slopes + 3 * n}};
    return mstmm_linear_at(code, t, q, u, efforts, found) ||
           divide_by_mass(n, M, 4, all, code->work) || !mstmm_finite(n * width, slopes);
}

int mstmm_linear_derivatives(const void *record, real t, const real *const *rows,
                             real *const *answers)
{
    const mstmm_linear_alone *alone = record;
    const mstmm_linear_code *code = &alone->code;
    const int n = code->n, nu = code->fused->nu, square = n * n;
    const real *M = alone->found + nu, *C = M + square, *K = C + square, *G = K + square;
    const columns all[] = {{K, n, n, answers[1]},
                           {C, n, n, answers[2]},
                           {NULL, n, n, answers[3]},
                           {G + square, 1, 1, answers[4]}};
    int failed = mstmm_linear_at(code, t, rows[0], rows[1], alone->efforts, alone->found) ||
                 divide_by_mass(n, M, 4, all, code->work) || !mstmm_finite(n, answers[4]);
    for (int k = 1; !failed && k < 4; k++) failed = !mstmm_finite(square, answers[k]);
    if (failed) return 1;
    memcpy(answers[0], alone->found, (size_t)nu * sizeof(real));
    memcpy(answers[5], G, (size_t)square * sizeof(real));
    memset(answers[6], 0, (size_t)square * sizeof(real));
    for (int i = 0; i < n; i++) answers[6][i * n + i] = 1;
    return 0;
}
