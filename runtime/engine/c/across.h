/* What the tangent's elimination does not see, as it reaches across the tree: unknowns of their own,
 * behind those of the tree.  A change of load or effort is one, which must be what the unknowns make
 * of it; so are accelerations of hinges that close loops, and multipliers, for which rows vanish. */
#ifndef MSTMM_ACROSS_H
#define MSTMM_ACROSS_H

#include "band_lu.h"
#include "tangent_parts.h"

/* The answer to one of each, and how they answer one another, for the tangent in hand.  `negative`:
 * whether the determinant of the tree's is. */
int mstmm_across_factor(mstmm_tangent *at, int negative);
/* x as mstmm_tangent_solve gives it; rows are to change by `missing` besides (NULL: not at all). */
int mstmm_across_solve(mstmm_tangent *at, const real *r, const mstmm_known *known,
                       const real *missing, real *x);
/* No multiplier changes along the direction at hand. */
void mstmm_keep_multipliers(const mstmm_model *model, real *workspace);
/* Frames of hinges that close loops move without accelerations of their own, which rows name apart:
 * `own` (nu) takes the accelerations, where those of such hinges become zero. */
void mstmm_set_own_apart(const mstmm_tangent *at, real *a, real *own);
/* Rows of hinges that close loops, of the derivatives' workspace: to `rows`. */
void mstmm_rows_along(const mstmm_tangent *at, real *workspace, const real *own, real *rows);
/* In place of efforts: the accelerations that hinges which close loops lack. */
void mstmm_lacking(const mstmm_tangent *at, const real *workspace, const real *own,
                   real *required);

/* Numbers of a row of the loops in a workspace. */
static inline real *mstmm_row_numbers(const mstmm_model *model, real *workspace,
                                      int row)
{
    return workspace + model->loops + MSTMM_ROW * (int64_t)row;
}

/* `closure`: the factored matrix, its exchanges of rows, changes, what rows miss, and changes in the
 * order of the matrix. */
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
