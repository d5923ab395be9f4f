/* Private declarations of simd_lanes.c and lanes_step.c. */
#ifndef MSTMM_LANES_STEP_H
#define MSTMM_LANES_STEP_H

#include "lanes.h"
#include "step.h"

/* The workspace cut into rows of n_state x lanes numbers, rounded up to whole vectors. */
typedef struct mstmm_cut_group {
    mstmm_group *group;
    const mstmm_system *system;
    const mstmm_tableau *tableau;
    int lanes;
    int64_t n, row;
    double *y, *k, *y_new, *y_stage, *dense; /* k: s + 1 + n_extra rows; dense: n_dense rows */
    double *atol; /* a row: infinite where there is no error to control */
    double *one; /* n_state: a single state */
} mstmm_cut_group;

/* Data of the present attempt of all lanes. */
typedef struct mstmm_attempt {
    double h[GROUP]; /* of each place of a row */
    double start[GROUP], end[GROUP], t[GROUP]; /* of the lanes: of the step, and of a stage */
    int meets_break; /* a lane's step starts or ends at a break */
    int active[GROUP], failed[GROUP], wants_dense[GROUP];
    double error[GROUP];
} mstmm_attempt;

/* First component of a lane that is not finite, -1 if all are */
int64_t mstmm_lane_not_finite(const mstmm_cut_group *c, const double *x, int lane);
/* The right-hand side of all lanes.  A failure ends the attempt of its own lane only. */
void mstmm_lanes_evaluate(const mstmm_cut_group *c, mstmm_attempt *a, const double *y, double *dy);
/* Fails the lanes in which something is not finite; cheap where everything is. */
void mstmm_lanes_check(const mstmm_cut_group *c, mstmm_attempt *a, const double *x);
/* All stages of the attempt, the end of the step among them. */
void mstmm_lanes_stages(const mstmm_cut_group *c, mstmm_attempt *a);
/* Scaled error of every lane, and the component that errs most in one. */
void mstmm_lanes_errors(const mstmm_cut_group *c, mstmm_attempt *a);
int64_t mstmm_lanes_worst(const mstmm_cut_group *c, int lane);
/* Dense output of all lanes; a failure counts only in those that want it. */
void mstmm_lanes_dense(const mstmm_cut_group *c, mstmm_attempt *a);
/* States of the lanes that moved, and first stages of those that keep the last one. */
void mstmm_lanes_move(const mstmm_cut_group *c, const int *moved, const int *kept_stage);

#endif
