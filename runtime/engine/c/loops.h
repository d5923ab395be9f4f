/* Closed loops, for the other engine files; see sweep.h. */
#ifndef MSTMM_LOOPS_H
#define MSTMM_LOOPS_H

#include "sweep.h"

/* Answers once more what the accelerations just found leave over, and adds that to them. */
int mstmm_refine(mstmm_state *state, const real *q, const real *u);
/* How much the rows lack in the sweep that was made last, by row. */
void mstmm_missing(const mstmm_state *state, real *missing);
/* Quaternions in q, by the first entry of each, brought back to length 1. */
void mstmm_unit_quaternions(int count, const int *first, real *q);

#endif
