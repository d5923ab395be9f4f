/* Harmonic response: Z(s) x = r with Z(s) = s^2 M + s C + K, the tangent in complex numbers.
 * Contributions of bodies are computed once per state; every s is one elimination, O(bodies), of
 * several s at a time. */
#ifndef MSTMM_HARMONIC_RESPONSE_H
#define MSTMM_HARMONIC_RESPONSE_H

#include "tangent.h"

/* cdef begin */
/* The most frequencies at a time. */
#define MSTMM_MOST_LANES 4

/* A scene behind mstmm_residual, and what is kept; everything is the caller's, beginning where 64
 * divides its address.  Complex numbers are 2 MSTMM_MOST_LANES of these. */
typedef struct {
    mstmm_tangent *at;
    mstmm_tangent
        *stiffer; /* the same, its elastic stiffness by the losses larger; NULL: no losses */
    int lanes;           /* frequencies at a time, 2 or 4; 0: as many as the processor takes */
    int64_t n_numbers;   /* see mstmm_tangent_lay */
    real *contributions; /* 3 n_numbers: what s, s^2 and losses bring; the rest is the tangent's */
    real *numbers; /* n_numbers complex */
    real *workspace; /* as many complex as the model has */
    real *vectors; /* 2 nu complex */
    /* Bodies with a dynamic stiffness in place of mass and stiffness, the last one first: a matrix
     * of three rotations and three displacements of the frame, and the shapes.  Of all of them
     * together `exact_numbers` complex numbers for every s. */
    int n_exact, exact_numbers;
    const int *exact_bodies;
    const real *exact;
    real *pivots; /* where real parts of pivots are wanted: n_pivots for every s; NULL */
    int n_pivots;
    real *scratch; /* 3 nu + 2 n_coupled */
    real *answers; /* n_coupled x nu complex: to one of each coupling */
    real *closure; /* n_coupled x (4 n_coupled + 2) complex */
} mstmm_response;

/* Contributions of bodies about the state of the last residual. */
int mstmm_response_begin(mstmm_response *of);
/* Amplitudes x (count, n, nu) of n right-hand sides (n, nu) at every s (count), x and s pairs of
 * real and imaginary parts; how many times larger the elimination made inertia, and the body where
 * (-1: none).  What is singular has infinite growth, and zeros.  Pivots go by bodies: those of
 * shapes, then inverses of those of hinges, as mstmm_tangent_pivots has them. */
void mstmm_response_many(mstmm_response *of, int64_t count, const real *s, int64_t n,
                         const real *columns, real *x, real *growth, int *grown);
/* cdef end */

/* The same for at most `lanes` values of s, in one vector. */
typedef void mstmm_response_few(mstmm_response *of, int count, const real *s, int64_t n,
                                const real *columns, real *x, real *growth, int *grown);
mstmm_response_few mstmm_response_by_2, mstmm_response_by_4;

/* True if there is code for processors with wide registers. */
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define MSTMM_FOUR_LANES
#endif

#endif
