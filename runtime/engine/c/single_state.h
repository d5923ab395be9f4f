/* Fast calls on single states: everything that does not change is prepared once. */
#ifndef MSTMM_SINGLE_STATE_H
#define MSTMM_SINGLE_STATE_H

#include "fused.h"
#include "scene.h"

/* cdef begin */
/* One per thread, or used by one thread at a time; the caller owns all memory. */
typedef struct {
    const mstmm_model *model;
    const mstmm_fused *fused;   /* code of the scene; NULL: the engine's loops */
    const mstmm_fused *inverse; /* the same for efforts and the mass matrix */
    real *workspace;
    mstmm_live_inputs live;
    real *p; /* numbers that `fused` reads, with values of live inputs */
    const real *memory;
    const real *none; /* nu zeros */
    real *qdot;       /* nq, written over */
    const mstmm_model *inertia; /* the same tree without gravity, laws, drives and loads */
    real *work;                 /* 2 nu, written over */
    int n_quaternions;
    const int *quaternions; /* first coordinate of each */
} mstmm_alone;

/* Common arguments: a record, a number, rows of doubles, and the result.  Each returns 0; otherwise
 * a guard failed or a number, perhaps of the state, is not finite, and the result is invalid. */
/* Accelerations at t, q, u with efforts in addition to those of laws (NULL: none). */
int mstmm_alone_accelerations(const void *alone, real t, const real *const *rows,
                              real *const *answers);
/* Efforts at t, q, u, udot in addition to those of laws. */
int mstmm_alone_efforts(const void *alone, real t, const real *const *rows, real *const *answers);
/* Mass matrix (nu x nu) at q, rigid bodies only. */
int mstmm_alone_mass(const void *alone, real none, const real *const *rows, real *const *answers);
/* Total energy at t, q, u, by the engine's loops. */
int mstmm_alone_energy(const void *alone, real t, const real *const *rows, real *const *answers);
/* Momentum (3) and angular momentum (3), likewise. */
int mstmm_alone_momentum(const void *alone, real t, const real *const *rows, real *const *answers);
/* Coordinates (nq) after dt from q with constant u, rigid bodies only; quaternions, of any length,
 * rotate at constant angular velocity. */
int mstmm_alone_moved(const void *alone, real dt, const real *const *rows, real *const *answers);
/* cdef end */

#endif
