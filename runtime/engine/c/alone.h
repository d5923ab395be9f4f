/* One state, for a caller to whom each of many calls counts: all that stays the same is made once. */
#ifndef MSTMM_ALONE_H
#define MSTMM_ALONE_H

#include "fused.h"
#include "sweep.h"

/* cdef begin */
/* Of one thread; everything is the caller's. */
typedef struct {
    const mstmm_model *model;
    const mstmm_fused *fused; /* code of the scene; NULL: the engine's loops */
    real *workspace;
    mstmm_live_inputs live;
    real *p; /* what `fused` reads, written anew by live inputs */
    const real *memory;
    const real *none; /* nu zeros */
    real *qdot;       /* nq, written over */
    const mstmm_model *inertia; /* the same tree without gravity, laws, drives and loads */
    real *work;                 /* 2 nu, written over */
} mstmm_alone;

/* Accelerations under efforts beside those of laws (NULL: none).  Returns 0; else a guard failed or
 * a number, of the state too, is not finite, and nothing is meant. */
int mstmm_alone_accelerations(const mstmm_alone *alone, real t, const real *q, const real *u,
                              const real *efforts, real *udot);
/* Efforts beyond those of laws that give `udot`; returns as above. */
int mstmm_alone_efforts(const mstmm_alone *alone, real t, const real *q, const real *u,
                        const real *udot, real *efforts);
/* The mass matrix (nu x nu); returns as above. */
int mstmm_alone_mass(const mstmm_alone *alone, const real *q, real *matrix);
/* cdef end */

#endif
