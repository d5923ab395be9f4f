/* Vectors of four numbers, in portable GNU C, and the weighted sums of which every step of a
 * Runge-Kutta method consists.  Longer vectors are kept in memory by compilers that may not
 * count on AVX-512, and are slower than one number at a time. */
#ifndef MSTMM_WIDE_H
#define MSTMM_WIDE_H

#include <math.h>
#include <stdint.h>

/* Numbers of a vector; those of which rows are whole multiples, and as many lanes as there may be. */
enum { WIDE = 4, GROUP = 8 };

typedef double wide __attribute__((vector_size(32), aligned(8), may_alias));
typedef int64_t wide_mask __attribute__((vector_size(32), aligned(8), may_alias));

/* Compiled once per width of registers, chosen when the program starts.  No contraction (see the
 * flags): all of them, and the plain one, give the same bits. */
#if defined(__x86_64__) && defined(__linux__) && defined(__GLIBC__) && defined(__GNUC__) &&        \
    !defined(__clang__) && !defined(MSTMM_ONE_WIDTH)
#define MSTMM_WIDE __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define MSTMM_WIDE
#endif
#define MSTMM_INLINE static inline __attribute__((always_inline))

/* Weights of one row of a method: term j adds weights[j] times stage columns[j]. */
typedef struct mstmm_terms {
    int count;
    const int *columns;
    const double *weights;
} mstmm_terms;

/* *sum = sum_j w_j k_j over four components; k points to those of stage 0, stages lie `row`
 * doubles apart.  Terms are added in their order, so that the bits do not depend on the width. */
MSTMM_INLINE void mstmm_add_terms(const mstmm_terms *terms, const double *k, int64_t row, wide *sum)
{
    wide total = {0.0};
    for (int j = 0; j < terms->count; j++)
        total += terms->weights[j] * *(const wide *)(k + terms->columns[j] * row);
    *sum = total;
}

MSTMM_INLINE void mstmm_size(const double *x, wide *size)
{
    const wide_mask bits = {INT64_MAX, INT64_MAX, INT64_MAX, INT64_MAX};
    *size = (wide)(*(const wide_mask *)x & bits);
}

/* The first argument where the mask is set, else the second. */
MSTMM_INLINE void mstmm_choose(const wide_mask *mask, const wide *first, const wide *second,
                               wide *chosen)
{
    *chosen = (wide)((*mask & (wide_mask)*first) | (~*mask & (wide_mask)*second));
}

/* Keeps the first `count` of four numbers, the others become 0. */
MSTMM_INLINE void mstmm_keep(int64_t count, wide *x)
{
    const wide_mask place = {0, 1, 2, 3};
    *x = (wide)((wide_mask)*x & (place < count));
}

MSTMM_INLINE double mstmm_total(const wide *x)
{
    const wide v = *x;
    return (v[0] + v[1]) + (v[2] + v[3]);
}

#endif
