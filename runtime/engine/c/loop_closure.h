/* Closed loops, for the other engine files; see sweep.h. */
#ifndef MSTMM_LOOP_CLOSURE_H
#define MSTMM_LOOP_CLOSURE_H

#include <string.h>

#include "sweep.h"
#include "sweep_steps.h"

/* Numbers of a row of the loops in a workspace. */
static inline real *mstmm_row_numbers(const mstmm_model *model, real *workspace, int row)
{
    return workspace + model->loops + MSTMM_ROW * (int64_t)row;
}

/* Runs the passes of a correction; `change` receives it, and begins as zero. */
static inline int mstmm_run_correction_from_zero(mstmm_state *state, real *change)
{
    memset(change, 0, (size_t)state->model->nu * sizeof(real));
    state->given = state->udot = change; /* only constant values are prescribed */
    state->qdot = mstmm_spare_qdot(state);
    mstmm_ground(state);
    return mstmm_run_correction(state);
}

/* Solves for the residual of the accelerations just found and adds the correction. */
int mstmm_refine(mstmm_state *state, const real *q, const real *u);
/* Accelerations `found`, from those given with their rows: the motion under all that acts whose
 * gaps would be gone if each coordinate changed by 1 / closing of what its acceleration differs. */
int mstmm_placing_accelerations(const mstmm_model *model, real *workspace, real closing, real t,
                                const real *q, const real *u, const real *a, const real *memory,
                                real *qdot, real *found, mstmm_failure *failure);
/* Nearness to a singular pose in the last sweep: the largest ratio of a row's rounding level to its
 * pivot. */
real mstmm_strain(const mstmm_model *model, const real *workspace);
/* Error of a coupling in the last sweep; 0 if it is inactive. */
real mstmm_coupling_lack(const mstmm_state *state, const mstmm_coupling *one);
/* Efforts of the hinge of a body without those of couplings. */
void mstmm_efforts_without_couplings(const mstmm_state *state, int index, real *efforts);
/* Quaternions in q, by the first entry of each, brought back to length 1. */
void mstmm_unit_quaternions(int count, const int *first, real *q);

/* Gaps of loops before a step that closes them (m, rad): of independent rows, and of redundant
 * ones; where each is largest, as the frame of its hinge. */
typedef struct {
    real met, repeated;
    int where_met, where_repeated;
} mstmm_gaps;

/* Projects a state on its constraints: one step of its coordinates, and its speeds (NULL: these
 * stay); both in place.  Nonzero = failure code. */
typedef struct {
    void *context;
    int (*gaps)(void *context, mstmm_gaps *found);
    int (*slips)(void *context);
    int near; /* a singular pose is near, where steps leave more than rounding of small gaps */
} mstmm_closing;

/* Gaps and velocity errors removed to the accuracy of the model. */
int mstmm_remove_gaps(const mstmm_closing *by, const mstmm_model *model, mstmm_failure *failure);

#endif
