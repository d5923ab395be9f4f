/* Complex numbers of MSTMM_LANES frequencies at a time, and what passes in them are at
 * (complex_steps.c). */
#ifdef MSTMM_LANES
#ifndef MSTMM_COMPLEX_LANES_HEADER
#define MSTMM_COMPLEX_LANES_HEADER

#include "harmonic_response.h"

typedef double mstmm_lanes __attribute__((vector_size(8 * MSTMM_LANES)));
typedef int64_t mstmm_bits __attribute__((vector_size(8 * MSTMM_LANES)));
typedef struct {
    mstmm_lanes re, im;
} complex_t;
typedef const complex_t *restrict complex_in_t;
typedef complex_t *restrict complex_out_t;

#define MSTMM_COMPLEX static inline __attribute__((always_inline))

MSTMM_COMPLEX complex_t z_add(complex_t a, complex_t b)
{
    return (complex_t){a.re + b.re, a.im + b.im};
}

MSTMM_COMPLEX complex_t z_sub(complex_t a, complex_t b)
{
    return (complex_t){a.re - b.re, a.im - b.im};
}

MSTMM_COMPLEX complex_t z_mul(complex_t a, complex_t b)
{
    return (complex_t){a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}

MSTMM_COMPLEX complex_t z_scale(double factor, complex_t a)
{
    return (complex_t){factor * a.re, factor * a.im};
}

MSTMM_COMPLEX complex_t z_plain(double number)
{
    return (complex_t){number + (mstmm_lanes){0}, (mstmm_lanes){0}};
}

MSTMM_COMPLEX void mstmm_complex_set_zero(complex_t *to, int n)
{
    for (int j = 0; j < n; j++) to[j] = z_plain(0);
}

MSTMM_COMPLEX complex_t z_inverse(complex_t a)
{
    const mstmm_lanes square = a.re * a.re + a.im * a.im;
    return (complex_t){a.re / square, -a.im / square};
}

/* |re| + |im| of every lane, and of all of them. */
MSTMM_COMPLEX mstmm_lanes z_size(complex_t a)
{
    const mstmm_bits all = INT64_MAX + (mstmm_bits){0};
    return (mstmm_lanes)((mstmm_bits)a.re & all) + (mstmm_lanes)((mstmm_bits)a.im & all);
}

MSTMM_COMPLEX double z_sizes(complex_t a)
{
    const mstmm_lanes size = z_size(a);
    double sum = 0;
    for (int lane = 0; lane < MSTMM_LANES; lane++) sum += size[lane];
    return sum;
}

/* x = a^-1 b by LU with row exchange, the same in all lanes; arguments and result of
 * mstmm_solve_lu (templates/solve_lu.c.jinja), singular if one of the lanes is.  A pivot is
 * refused where it is zero alone: frequencies are asked for, and counted, next to where they
 * vanish, and the digits that are lost are told by how inertia grows (complex_sweeps.h). */
MSTMM_COMPLEX int mstmm_complex_solve_lu(int n, int m, const complex_t *restrict a,
                                         const complex_t *restrict b, complex_t *restrict x,
                                         complex_t *restrict work, double relative_pivot)
{
    (void)relative_pivot;
    for (int i = 0; i < n * n; i++) work[i] = a[i];
    for (int i = 0; i < n * m; i++) x[i] = b[i];
    for (int i = 0; i < n; i++) {
        int best = i;
        for (int k = i + 1; k < n; k++)
            if (z_sizes(work[best * n + i]) < z_sizes(work[k * n + i])) best = k;
        for (int j = i; best != i && j < n; j++) {
            const complex_t entry = work[i * n + j];
            work[i * n + j] = work[best * n + j];
            work[best * n + j] = entry;
        }
        for (int j = 0; best != i && j < m; j++) {
            const complex_t entry = x[i * m + j];
            x[i * m + j] = x[best * m + j];
            x[best * m + j] = entry;
        }
        const mstmm_bits there = z_size(work[i * n + i]) > 0;
        for (int lane = 0; lane < MSTMM_LANES; lane++)
            if (!there[lane]) return 1;
        const complex_t scale = work[i * n + i] = z_inverse(work[i * n + i]);
        for (int k = i + 1; k < n; k++) {
            const complex_t factor = z_mul(work[k * n + i], scale);
            for (int j = i + 1; j < n; j++)
                work[k * n + j] = z_sub(work[k * n + j], z_mul(factor, work[i * n + j]));
            for (int j = 0; j < m; j++)
                x[k * m + j] = z_sub(x[k * m + j], z_mul(factor, x[i * m + j]));
        }
    }
    for (int i = n - 1; i >= 0; i--)
        for (int j = 0; j < m; j++) {
            complex_t rest = x[i * m + j];
            for (int k = i + 1; k < n; k++)
                rest = z_sub(rest, z_mul(work[i * n + k], x[k * m + j]));
            x[i * m + j] = z_mul(rest, work[i * n + i]);
        }
    return 0;
}

/* --- what a pass is at: numbers of the state are plain, what moves is complex --- */

typedef struct {
    complex_t *numbers;
    const real *held;    /* what no s changes of them */
    int kept;            /* S of every body stays */
} mstmm_complex_tangents;

typedef struct {
    complex_t *workspace;
} mstmm_complex_slope;

typedef struct {
    const mstmm_model *model;
    real *workspace;
    const real *memory;
    const complex_t *column;
    complex_t *answer;
    mstmm_complex_slope *slope;
    mstmm_complex_tangents *tangents;
    mstmm_failure *failure;
    int observed;
} mstmm_complex_state;

MSTMM_COMPLEX int mstmm_complex_fail(mstmm_complex_state *state, int reason, int element, int code)
{
    *state->failure = (mstmm_failure){.reason = reason, .element = element, .code = code};
    return reason;
}

/* The code of an elimination: determinants have no sign here. */
#define mstmm_complex_elimination_code(state, code) (code)

#endif
#endif
