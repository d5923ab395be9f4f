/* One state, for a caller to whom each of many calls counts: all that stays the same is made once. */
#ifndef MSTMM_ALONE_H
#define MSTMM_ALONE_H

#include "fused.h"
#include "scene.h"

/* cdef begin */
/* Each of several threads has its own, or one at a time uses it; everything is the caller's. */
typedef struct {
    const mstmm_model *model;
    const mstmm_fused *fused;   /* code of the scene; NULL: the engine's loops */
    const mstmm_fused *inverse; /* the same for efforts and the mass matrix */
    real *workspace;
    mstmm_live_inputs live;
    real *p; /* what `fused` reads, written anew by live inputs */
    const real *memory;
    const real *none; /* nu zeros */
    real *qdot;       /* nq, written over */
    const mstmm_model *inertia; /* the same tree without gravity, laws, drives and loads */
    real *work;                 /* 2 nu, written over */
    int n_quaternions;
    const int *quaternions; /* first coordinate of each */
} mstmm_alone;

/* All are called alike: a record, a number, rows of doubles, and where answers go.  Each returns 0;
 * else a guard failed or a number, of the state too, is not finite, and nothing is meant. */
/* At t, of q, u and efforts beside those of laws (NULL: none): accelerations. */
int mstmm_alone_accelerations(const void *alone, real t, const real *const *rows,
                              real *const *answers);
/* At t, of q, u and udot: efforts beyond those of laws. */
int mstmm_alone_efforts(const void *alone, real t, const real *const *rows, real *const *answers);
/* Of q: the mass matrix (nu x nu), of rigid bodies. */
int mstmm_alone_mass(const void *alone, real none, const real *const *rows, real *const *answers);
/* At t, of q and u: the whole energy, by the engine's loops. */
int mstmm_alone_energy(const void *alone, real t, const real *const *rows, real *const *answers);
/* The same: momentum (3) and angular momentum (3). */
int mstmm_alone_momentum(const void *alone, real t, const real *const *rows,
                         real *const *answers);
/* Of q and u: coordinates (nq) after dt at steady rates, of rigid bodies; quaternions, which may be
 * of any length, turn at a steady angular velocity. */
int mstmm_alone_moved(const void *alone, real dt, const real *const *rows, real *const *answers);
/* cdef end */

#endif
