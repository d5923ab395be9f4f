/* Residual of a scene and its tangent, for implicit methods, equilibria and linear models.
 * R(t, q, u, a) are the efforts that accelerations a need in addition to all acting loads. */
#ifndef MSTMM_TANGENT_HEADER
#define MSTMM_TANGENT_HEADER

#include "sweep.h"

/* cdef begin */
/* An unknown of a hinge that closes a loop: the acceleration of a speed of its own, or the
 * multiplier of a row; or that of a coupling. */
typedef struct {
    int frame, direction; /* the hinge's frame (-1: a coupling), and which of its six directions */
    int speed, row; /* -1: the other is meant */
} mstmm_coupled_row;

/* Couplings that the elimination along the tree does not contain: loads on bodies that change with
 * other bodies, efforts by expressions of the state and by couplings, closing hinges, and
 * couplings.  These unknowns (n_coupled) are in groups, each of which moves its speeds and is read
 * by some of the unknowns; their lists go from first_.. of a group or a pass to that of the
 * next. */
typedef struct {
    int n_bodies, n_efforts, n_rows, n_passes;
    const int *bodies; /* on which such loads act: 6 numbers each */
    const int64_t *efforts; /* where an effort changes, in the derivatives' workspace */
    const int *speeds; /* and the speed that it acts on */
    const mstmm_coupled_row *rows;
    const int *group, *rank; /* of every unknown, its group and its place in the matrix */
    const int *first_reader, *reader, *first_moved, *moved; /* by group: unknowns, and speeds */
    const int *first_seed, *seed; /* by pass: unknowns that are solved together */
    const int *first_unit; /* and the positions of the loads among these, */
    const int64_t *unit; /* in the derivatives' workspace */
    int below, above; /* lower and upper bandwidth of the matrix */
} mstmm_couplings;

/* A scene at one state with its derivatives: everything is the caller's.  `work` has
 * mstmm_tangent_work numbers, `numbers` those of mstmm_tangent_lay, all of them zero at first. */
typedef struct {
    const mstmm_model *model;
    real *workspace, *memory, *work, *numbers;
    int64_t slots; /* largest workspace of a tape of derivatives */
    const mstmm_couplings *couplings;
    int n_coupled; /* numbers that they change by */
    real *answers; /* passes x nu: to one of each unknown */
    real *closure; /* n_coupled x (numbers of a row of the matrix + 4) */
    int known; /* there has been a residual since the memory changed */
    int approximate; /* the last tangent was that of mstmm_laws_factor */
    int on_positions; /* rows are those of positions only: see mstmm_across_solve */
    int rows_of_motion; /* rows are those of small motions x, J x = 0, for any s */
    int counts; /* pivots may be negative: they are counted */
    int keeps, kept; /* tangents keep S of every body, as known increments need */
    real t, rate, s, sq, kappa; /* of the last residual and tangent */
    mstmm_failure failure;
} mstmm_tangent;

/* Lays out the tangent's numbers over the bodies; returns how many there are, or -1 - i if the
 * kernels of body i or its hinge, or the force behind all bodies, are from before there were
 * derivatives. */
int64_t mstmm_tangent_lay(mstmm_model *model);
int64_t mstmm_tangent_work(const mstmm_model *model, int64_t slots);
/* Number of doubles of `work` for mstmm_residual and mstmm_tangent_rates only. */
int64_t mstmm_residual_work(const mstmm_model *model);
/* R (nu) at a state, to which the next calls refer; zero on prescribed speeds.  `balance` may be
 * NULL; its power is that of everything that is not stored.  `a` NULL: the accelerations
 * there.  Multipliers of closed loops are those there, whatever `a`; for closing hinges R are the
 * errors of their accelerations. */
int mstmm_residual(mstmm_tangent *at, real t, const real *q, const real *u, const real *a, real *r,
                   mstmm_balance *balance);
/* True if this is the state of the last residual with the same memory.  `a` NULL: any. */
int mstmm_residual_is_at(const mstmm_tangent *at, real t, const real *q, const real *u,
                         const real *a);
/* Derivative of R (nu) along d_t, d_q, d_u, d_a. */
int mstmm_residual_slope(mstmm_tangent *at, real d_t, const real *d_q, const real *d_u,
                         const real *d_a, real *d_r);
/* Partial derivative of the accelerations (nu) with respect to time, at the state of the last
 * residual, which was one without `a`.  Invalidates the tangent. */
int mstmm_accelerations_rate(mstmm_tangent *at, real *rate);
/* Change of the coordinates' rates (nq) along the direction of the last mstmm_residual_slope. */
void mstmm_rates_slope(const mstmm_tangent *at, real *d_rates);
/* Factors dR along unknowns x: du = rate x, da = s x, dq = (sq - kappa g_q)^-1 N x, where g_q are
 * the slopes of the coordinates' rates N u by the coordinates. */
int mstmm_tangent_factor(mstmm_tangent *at, real rate, real s, real sq, real kappa);
/* Fills `numbers` without the elimination: linear in rate, s and 1 / sq. */
int mstmm_tangent_contributions(mstmm_tangent *at, real rate, real s, real sq);
/* Change of every coupling along x for the coordinates, d_u and d_a (nu). */
int mstmm_coupled_along(mstmm_tangent *at, const real *x, const real *d_u, const real *d_a,
                        real *changes);
/* Pivots of the last factorisation: of each body that of its shapes (n, n), then the inverse of
 * that of its hinge; both n in `sizes` (2 n_bodies).  Returns how many numbers these are, and
 * writes them to `pivots` unless it is NULL. */
int64_t mstmm_tangent_pivots(const mstmm_tangent *at, int *sizes, real *pivots);
/* Known increments in addition to x: of coordinates (nq) and accelerations (nu). */
typedef struct {
    const real *q, *a;
} mstmm_known;
/* x (nu) with the change r of R, in addition to known increments (NULL: none), which must be zero
 * for prescribed speeds.  With the approximate tangent there are none. */
int mstmm_tangent_solve(mstmm_tangent *at, const real *r, const mstmm_known *known, real *x);
/* Factors the approximate tangent: inertia with the symmetric part of the derivatives of laws and
 * modes.  s and sq are positive. */
int mstmm_laws_factor(mstmm_tangent *at, real rate, real s, real sq, real kappa);
/* Accelerations a (nu) with the change r of R, in addition to changes dq and du of coordinates and
 * speeds; both NULL: none. */
int mstmm_laws_solve(mstmm_tangent *at, const real *r, const real *dq, const real *du, real *a);
/* dq = N(q) u, zero for prescribed coordinates; q and u need not be those of the last residual,
 * whose workspace this overwrites. */
int mstmm_tangent_rates(mstmm_tangent *at, const real *q, const real *u, real *dq);
/* Sets entries (nu) of prescribed speeds to zero. */
void mstmm_tangent_free(const mstmm_tangent *at, real *entries);
/* dq (nq) of an x: sq dq = kappa g_q dq + N x + rho; rho (nq) may be NULL. */
int mstmm_tangent_coordinates(mstmm_tangent *at, const real *x, const real *rho, real *dq);
/* cdef end */

#endif
