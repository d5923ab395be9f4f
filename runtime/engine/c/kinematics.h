/* Where points are and how they move at states whose accelerations are given: kinematics alone. */
#ifndef MSTMM_KINEMATICS_H
#define MSTMM_KINEMATICS_H

#include "scene.h"

/* cdef begin */
/* Of one thread; everything is the caller's. */
typedef struct {
    const mstmm_model *model; /* the tree without laws, drives and loads */
    real *workspace;
    const real *memory;
    const real *none; /* nu zeros */
    real *work;       /* nu, written over */
} mstmm_kinematics;

/* States and accelerations are rows of doubles, as bytes, as in alone.h.  Each function returns 0,
 * MSTMM_NO_NUMBER where one of them is not finite, or a reason, with `failure` filled. */
#define MSTMM_NO_NUMBER -1
/* n states one after the other; points: n x n_probes x MSTMM_PROBE_NUMBERS. */
int mstmm_moving_points(const mstmm_kinematics *known, int64_t n, const void *q, const void *u,
                        const void *udot, int n_probes, const mstmm_probe *probes, real *points,
                        mstmm_failure *failure);
/* n_probes x 6 x nu: velocity and angular velocity of each by the speeds, of rigid bodies. */
int mstmm_jacobians(const mstmm_kinematics *known, const void *q, int n_probes,
                    const mstmm_probe *probes, real *rows, mstmm_failure *failure);
/* cdef end */

#endif
