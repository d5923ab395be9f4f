/* Closed loops, for the other engine files; see sweep.h. */
#ifndef MSTMM_LOOPS_H
#define MSTMM_LOOPS_H

#include "sweep.h"

/* Answers once more what the accelerations just found leave over, and adds that to them. */
int mstmm_refine(mstmm_state *state, const real *q, const real *u);
/* Accelerations `found`, from those given with their rows: the motion under all that acts whose gaps
 * would be gone if each coordinate changed by 1 / closing of what its acceleration differs. */
int mstmm_placing_accelerations(const mstmm_model *model, real *workspace, real closing, real t,
                                const real *q, const real *u, const real *a, const real *memory,
                                real *qdot, real *found, mstmm_failure *failure);
/* How near to a singular pose the sweep that was made last met the loops: the largest of what is
 * rounding for a row in parts of its pivot. */
real mstmm_strain(const mstmm_model *model, const real *workspace);
/* How much the rows lack in the sweep that was made last, by row. */
void mstmm_missing(const mstmm_state *state, real *missing);
/* What a coupling lacked in the sweep that was made last; 0 where nothing is asked of it. */
real mstmm_coupling_lack(const mstmm_state *state, const mstmm_coupling *one);
/* Efforts of the hinge of a body without those of couplings. */
void mstmm_uncoupled(const mstmm_state *state, int index, real *efforts);
/* Quaternions in q, by the first entry of each, brought back to length 1. */
void mstmm_unit_quaternions(int count, const int *first, real *q);

/* How far loops are open before a step that closes them (m, rad): what is met, and what repeats
 * others; where each is most, as the frame of its hinge. */
typedef struct {
    real met, repeated;
    int where_met, where_repeated;
} mstmm_gaps;

/* What brings a state back to where its loops are closed: one step of its coordinates, and its
 * speeds (NULL: those stay); both in place.  Nonzero = failure code. */
typedef struct {
    void *context;
    int (*gaps)(void *context, mstmm_gaps *found);
    int (*slips)(void *context);
    int near; /* a singular pose is near, where steps leave more than rounding of small gaps */
} mstmm_closing;

/* Gaps closed and slips stopped as well as the model asks for. */
int mstmm_closed(const mstmm_closing *by, const mstmm_model *model, mstmm_failure *failure);

#endif
