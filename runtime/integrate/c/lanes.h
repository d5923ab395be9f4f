/* Many independent trajectories of one system, several of them in SIMD lanes.  Every lane has its
 * own time, step and error control, and lanes do not influence each other: the numbers of a
 * trajectory depend neither on the number of trajectories, nor on its neighbours, nor on the
 * number of threads. A lane whose trajectory has ended starts the next one.
 *
 * For systems without events and memory. */
#ifndef MSTMM_LANES_H
#define MSTMM_LANES_H

#include "integrate.h"

/* cdef begin */
typedef struct mstmm_outcome {
    int64_t
        status; /* MSTMM_FINISHED or a failure; MSTMM_RUNNING where the run has not come so far */
    int64_t code, component; /* of a failure, as in mstmm_run_count */
    int64_t steps, rejected, evaluations;
    double t, fail_time; /* time of the last good state; of the failure */
} mstmm_outcome;

/* What is to be done, shared by all threads. */
typedef struct mstmm_many {
    mstmm_run
        problem; /* tableau, times, tolerances, breaks and outputs (n_outputs >= 0) of a run */
    int64_t n;
    const double *y0;        /* n x n_state */
    double *samples;         /* n x n_outputs x n_state: as far as a trajectory came */
    double *last;            /* n x n_state: the last good state */
    mstmm_outcome *outcomes; /* n */
    int64_t next;            /* the first trajectory not started yet */
} mstmm_many;

/* The lanes of one thread. */
typedef struct mstmm_group {
    mstmm_many *many;
    const mstmm_system *system; /* of this thread: rhs_lanes, accept, context */
  /* NULL, or called with the system's context when a lane takes up a trajectory */
    void (*enter)(void *context, int lane, int64_t trajectory);
    /* NULL, or called with the same when the system has accepted a step of a lane */
    void (*accepted)(void *context, int lane);
    double *workspace; /* mstmm_group_size doubles */
  /* the state: read freely, write never */
    mstmm_run runs[8];
    int64_t trajectory[8]; /* -1: the lane is idle */
    int64_t retries[8];    /* of the step that is tried */
} mstmm_group;

/* Doubles of workspace; 0 for sizes that make no sense or a system without lanes. */
int64_t mstmm_group_size(const mstmm_system *system, const mstmm_tableau *tableau);
/* Every lane idle.  MSTMM_BAD_ARGUMENT for arguments that make no sense, else 0. */
int mstmm_group_start(mstmm_group *group);
/* Advances until all trajectories have started and this group's have ended, MSTMM_FINISHED, or
 * wall_seconds have passed, MSTMM_RUNNING. */
int mstmm_group_advance(mstmm_group *group, double wall_seconds);
/* cdef end */

#endif
