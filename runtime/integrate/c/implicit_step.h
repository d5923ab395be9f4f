/* Declarations shared by the implicit methods and the loop. */
#ifndef MSTMM_IMPLICIT_STEP_H
#define MSTMM_IMPLICIT_STEP_H

#include "workspace.h"

/* ---- for the loop: as the functions of step.h without "implicit" ---- */

/* The slope at the start of a step has just been evaluated: accelerations from it, and nothing else
 * is known. */
void mstmm_implicit_restart(const mstmm_work *work);
/* What an accepted step needs besides: the slope at its end, quadratures, dense output if
 * wanted. */
int mstmm_implicit_finish(const mstmm_work *work, int wants_dense);
double mstmm_implicit_norm(const mstmm_work *work, double *absolute);
int64_t mstmm_implicit_worst(const mstmm_work *work);
double mstmm_implicit_first_step(const mstmm_work *work, double interval);

/* ---- the steppers: from the slope at the start of a step to y_new and the error ---- */

int mstmm_rosenbrock_stages(const mstmm_work *work);
int mstmm_dirk_stages(const mstmm_work *work);
int mstmm_alpha_stages(const mstmm_work *work);
int mstmm_exponential_stages(const mstmm_work *work);
/* Coordinates and speeds inside the present step: the exact linear motion, however fast it
 * oscillates. */
void mstmm_exponential_dense(const mstmm_work *work, double theta, double *y);

/* ---- the system, with its failures and counts; a row holds its accelerations ---- */

int mstmm_step_impose(const mstmm_work *work, double t, double *row);
int mstmm_step_residual(const mstmm_work *work, double t, const double *row, double *rest);
/* The same with gaps that an acceleration of one closes by 1 / closing. */
int mstmm_step_placing(const mstmm_work *work, double t, const double *row, double closing);
/* True if the present step has rows of positions.  A shortened step has rows of accelerations: gaps
 * over its squared length would be velocity errors and rounding only. */
int mstmm_step_places(const mstmm_work *work);
int mstmm_step_rates(const mstmm_work *work, double t, const double *q, const double *u,
                     double *dq);
/* `laws`: that of laws alone */
int mstmm_step_tangent(const mstmm_work *work, double t, const double *row, double s, double sq,
                       int kappa, int laws);
/* For the right-hand side in work->residual, to work->dq, du and da. */
int mstmm_step_solve(const mstmm_work *work, double t, const double *rho_q, const double *rho_u);
/* A slope row at a state row: rates, accelerations, and rates of the quadratures. */
int mstmm_step_slope(const mstmm_work *work, double t, const double *row, double *slope);
/* True if all numbers of y_new are finite, accelerations too. */
int mstmm_check_new(const mstmm_work *work);

/* ---- Newton's iteration ---- */

/* Equations of one stage, whose unknown state is in work->y_stage. */
typedef struct mstmm_newton_equations {
    double t, s, sq; /* as `tangent` takes them */
    int kappa;
    double h;      /* DIRK: gamma times the step */
    double cq, cu; /* Alpha: what an acceleration adds to coordinates and speeds */
    /* How far the coordinates are from their own equation, to work->rho_q; NULL: they obey it. */
    int (*defect)(const mstmm_work *work, const struct mstmm_newton_equations *stage);
    /* Takes the increments in work->dq and da into y_stage. */
    int (*move)(const mstmm_work *work, const struct mstmm_newton_equations *stage);
} mstmm_newton_equations;

/* Solves a stage from the start value in y_stage. */
int mstmm_newton_stage(const mstmm_work *work, const mstmm_newton_equations *stage);
/* Size of the increments in work->dq and du in units of the tolerance. */
double mstmm_increment_norm(const mstmm_work *work);
/* The component in which the increments are largest, once they have been measured. */
int64_t mstmm_increment_worst(const mstmm_work *work);

#endif
