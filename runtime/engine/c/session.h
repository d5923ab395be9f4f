/* A run that its caller advances in ticks, setting inputs in between. */
#ifndef MSTMM_SESSION_H
#define MSTMM_SESSION_H

#include "scene.h"

/* cdef begin */
typedef struct {
    mstmm_scene_run *scene;
    mstmm_run *run;
    real reach;        /* breaks are known before this time */
    int n;             /* inputs that are held */
    const real *given; /* n: what they are from the next call on */
    real *held;        /* n, in the run's memory: what they are */
    int refused;       /* of MSTMM_REFUSED: which input, -1 the time, -2 the session has ended */
} mstmm_session;

enum {
    MSTMM_REFUSED = -100, /* see `refused`; nothing has changed */
    MSTMM_UNMAPPED = 100  /* breaks must be computed first; nothing has changed */
};

/* Advances by dt (s) with the given inputs, for at most `wall` seconds; the status of
 * mstmm_advance, or one of the above.  With fixed steps a time beside their grid by rounding is the
 * grid's. */
int mstmm_session_advance(mstmm_session *session, real dt, real wall);
/* Completes a tick that ended because of the time limit. */
int mstmm_session_rest(mstmm_session *session, real wall);
/* cdef end */

#endif
