/* The linear equations of a scene about a state: M da + C du + K dphi = -r_t dt where accelerations
 * change by da, speeds by du, coordinates by N dphi.  By code compiled for the scene, or by
 * directions of the residual. */
#ifndef MSTMM_LINEAR_EQUATIONS_H
#define MSTMM_LINEAR_EQUATIONS_H

#include "fused.h"
#include "inputs.h"
#include "tangent.h"

/* cdef begin */
/* Columns that are solved at a time. */
#define MSTMM_TILE_COLUMNS 32

/* Code of a scene with n free speeds; the caller owns all memory. */
typedef struct {
    const mstmm_fused *fused;
    mstmm_live_inputs live;
    real *p; /* written anew by live inputs */
    const real *memory;
    real *work; /* n n + MSTMM_TILE_COLUMNS n */
    int n;
} mstmm_linear_code;

/* One of them, with memory for intermediate results. */
typedef struct {
    mstmm_linear_code code;
    const real *efforts; /* nu zeros */
    real *found; /* mstmm_linear_numbers */
} mstmm_linear_alone;

/* Numbers that it finds: udot (nu), M, C, K, G (n x n each), r_t (n), qdot (nq). */
int64_t mstmm_linear_numbers(const mstmm_linear_code *code);
/* Fills them at a state with efforts (nu).  Returns 0; otherwise a guard failed or a number is not
 * finite, the results are invalid, and the looped engine names the cause. */
int mstmm_linear_at(const mstmm_linear_code *code, real t, const real *q, const real *u,
                    const real *efforts, real *found);
/* M, C, K (n x n each) of the speeds `free` by the looped engine, behind one another.  `work` has
 * 2 nq + 3 nu numbers. */
int mstmm_linear_swept(mstmm_tangent *at, real t, const real *q, const real *u, const real *a,
                       int n, const int *free, real *found, real *work);
/* The same, and slopes of accelerations row by row (n x (3n + 1)): -M^-1 K, -M^-1 C, M^-1 and
 * -M^-1 r_t.  Both are invalid if M is not positive definite. */
int mstmm_accelerations_about(const mstmm_linear_code *code, real t, const real *q, const real *u,
                              const real *efforts, real *found, real *slopes);
/* The same for scenes without drives, called as in single_state.h: at q and u, udot, the four
 * derivatives separately, G and the identity.  The record is mstmm_linear_alone. */
int mstmm_linear_derivatives(const void *record, real t, const real *const *rows,
                             real *const *answers);
/* d/dt (x, x') = matrix (2n x 2n) (x, x') of what mstmm_linear_at found, x' = G x + du where
 * `turning`, else du.  Returns 1 where M is not positive definite, or a number not finite. */
int mstmm_state_matrix(const mstmm_linear_code *code, const real *found, int turning, real *matrix);
/* cdef end */

#endif
