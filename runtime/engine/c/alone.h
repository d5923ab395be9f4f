/* One state, for a caller to whom each of many calls counts: all that stays the same is made once. */
#ifndef MSTMM_ALONE_H
#define MSTMM_ALONE_H

#include "fused.h"
#include "sweep.h"

/* cdef begin */
/* Of one thread; everything is the caller's. */
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
    real *found;                /* nu, what was asked for */
    real *matrix;               /* nu x nu, the mass matrix that was asked for */
} mstmm_alone;

/* q, u, ... are rows of doubles, as bytes: a caller in Python hands a copy over for less than a
 * view.  Each function returns 0; else a guard failed or a number, of the state too, is not finite,
 * and nothing is meant. */
/* `found`: accelerations under efforts beside those of laws (NULL: none). */
int mstmm_alone_accelerations(const mstmm_alone *alone, real t, const void *q, const void *u,
                              const void *efforts);
/* `found`: efforts beyond those of laws that give `udot`. */
int mstmm_alone_efforts(const mstmm_alone *alone, real t, const void *q, const void *u,
                        const void *udot);
/* `matrix`: the mass matrix. */
int mstmm_alone_mass(const mstmm_alone *alone, const void *q);
/* cdef end */

#endif
