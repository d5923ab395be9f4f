/* Measured quantities of a state, by expressions, and controllers that sample them. */
#ifndef MSTMM_CONTROLLERS_H
#define MSTMM_CONTROLLERS_H

#include "scene.h"

/* cdef begin */
/* Expressions of t, q, u, inputs and the observation `shown`; unread arrays are NULL there and
 * empty on the tape. */
typedef struct mstmm_measure {
    const mstmm_tape *tape; /* t, q, u, points, loads, efforts, udot, sums, inputs -> numbers */
    int observes;           /* whether anything of `shown` is read */
    mstmm_observation shown;
} mstmm_measure;

/* The numbers of a state (t, y) of a scene's run, with what the run's memory holds.  0, or a
 * reason, with the run's `failure` filled. */
int mstmm_evaluate_measure(mstmm_scene_run *run, const mstmm_measure *measure, real t,
                           const real *y, real *numbers);

/* Linear in discrete time: at t_k = k sample_time, with e = y - reference,
 *   u = C x + D e + offset, held from t_k on;  x <- A x + B e.
 * Memory from `memory` on: the next k (NaN before the first), x, u. */
typedef struct mstmm_controller {
    real sample_time;
    int n_x, n_y, n_u;
    const real *A, *B, *C, *D, *reference, *offset; /* matrices row by row */
    const mstmm_measure *measure;
    real *y;    /* n_y */
    real *next; /* n_x */
    int memory;
} mstmm_controller;

/* All controllers with a sample at t measure, then set outputs.  0: there is none, -1: outputs
 * are set, > 0: a reason. */
int mstmm_controllers_act(mstmm_scene_run *run, real t, const real *y);
/* cdef end */

#endif
