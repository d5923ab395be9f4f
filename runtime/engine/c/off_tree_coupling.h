/* Couplings of distant bodies, which the tangent's elimination along the tree does not contain:
 * they are additional unknowns after those of the tree.  Unknown are changes of loads or efforts,
 * which must agree with the solution, and accelerations and multipliers of closing hinges. */
#ifndef MSTMM_OFF_TREE_COUPLING_H
#define MSTMM_OFF_TREE_COUPLING_H

#include "band_lu.h"
#include "loop_closure.h"
#include "tangent_workspace.h"

/* Unit solutions of all unknowns and their coupling matrix, for the factored tangent.  `negative`:
 * whether the determinant of the tree's tangent is negative. */
int mstmm_across_factor(mstmm_tangent *at, int negative);
/* x as from mstmm_tangent_solve, of a tangent that has kept what known increments need; in addition
 * rows change by `missing` (NULL: by zero). */
int mstmm_across_solve(mstmm_tangent *at, const real *r, const mstmm_known *known,
                       const real *missing, real *x);
/* No multiplier changes along the present direction. */
void mstmm_keep_multipliers(const mstmm_model *model, real *workspace);
/* Frames of closing hinges move without their own accelerations, which are separate unknowns: `own`
 * (nu) receives the accelerations with zeros for such hinges. */
void mstmm_set_own_apart(const mstmm_tangent *at, real *a, real *own);
/* Rows of hinges that close loops, of the derivatives' workspace: to `rows`. */
void mstmm_rows_along(const mstmm_tangent *at, real *workspace, const real *own, real *rows);
/* Instead of efforts: errors of the accelerations of closing hinges. */
void mstmm_lacking(const mstmm_tangent *at, const real *workspace, const real *own, real *required);

/* `closure`: factored matrix, its row exchanges, changes, errors of rows, and changes in the order
 * of the matrix. */
static inline mstmm_band mstmm_across_band(const mstmm_tangent *at)
{
    return mstmm_band_of(at->n_coupled, at->couplings->below, at->couplings->above, at->closure);
}
static inline real *mstmm_across_exchanges(const mstmm_tangent *at)
{
    return at->closure + (int64_t)at->n_coupled * mstmm_across_band(at).width;
}
static inline real *mstmm_across_changes(const mstmm_tangent *at)
{
    return mstmm_across_exchanges(at) + at->n_coupled;
}
static inline real *mstmm_across_missing(const mstmm_tangent *at)
{
    return mstmm_across_changes(at) + at->n_coupled;
}
static inline real *mstmm_across_ordered(const mstmm_tangent *at)
{
    return mstmm_across_missing(at) + at->n_coupled;
}

#endif
