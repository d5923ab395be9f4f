/* Workspace of a run, its right-hand side and its failures: the basis of all parts of the time
 * integration. */
#ifndef MSTMM_WORKSPACE_H
#define MSTMM_WORKSPACE_H

#include <math.h>

#include "integrate.h"
#include "phi_functions.h"
#include "four_lanes.h"

#define MSTMM_DEPTH 40 /* times that a part of a step is halved in search of an event */
#define MSTMM_SAME_STEP 1e-9 /* relative difference of two steps that are of one length */

/* Workspace divided into named arrays.  The first part is kept between steps: the state, the first
 * stage, data of events; the rest is used only inside a step.  Rows of the state
 * hold `row` numbers, n_state rounded up to whole vectors; those behind n_state stay 0. */
typedef struct mstmm_work {
    mstmm_run *run;
    const mstmm_system *system;
    const mstmm_tableau *tableau;
    int64_t row;
    double *y;                         /* row: the current good state */
    double *k;                         /* (s + 1 + n_extra) rows */
    double *truth;                     /* events and switches */
    double *last_fire;                 /* the same: time, or NaN */
    double *side; /* the same: 1, or -1 for a switch that starts above zero */
    double *y_new, *y_stage, *y_event; /* a row each */
    double *dense; /* n_dense rows */
    double *atol; /* a row: the tolerances, 0 where there are none */
    double *lanes_y, *lanes_k; /* iterated methods: 8 rows each, see iterated_runge_kutta.c */
    double *g_before, *g_left, *g_right, *g_trial; /* events and switches */
    double *memory; /* n_memory: saved while an event is tried */
    int64_t seen_row;
    double *seen; /* 3 + MSTMM_DEPTH rows: what is seen at left, right and between */
    double *rates; /* a row */
    mstmm_bounds *bounds, *first_bounds; /* events and switches */
    /* Implicit methods, NULL and empty for others.  Rows of the state are longer then: the n_state
   * components are followed by the accelerations, and in Newmark's family by other data for the
   * next step, see newmark_family.c. */
    const mstmm_implicit *implicit;
    double *base; /* a row, kept: where the tangent of Newton's iteration was taken */
    double *y_star, *y_first, *error; /* a row each */
    double *residual, *residual_rate, *rho_u, *du, *da; /* n_u each */
    double *rho_q, *dq; /* n_q each */
    double *map_q, *map_u; /* n_u each: what is known of the step, see newmark_family.c */
    double *flow; /* 3 n_q */
    double *nodes; /* quadratures at the ends and nodes of a step */
    /* Exponential methods; n = n_q + n_u */
    double *jacobian, *inverse_mass; /* n x n; n_u x n_u */
    double *time_slope; /* n */
    double *motion; /* 4 n: see exponential.c */
    mstmm_phi phi;
} mstmm_work;

MSTMM_INLINE double *mstmm_row_a(const mstmm_work *work, double *row)
{
    return row + work->system->n_state;
}
MSTMM_INLINE double *mstmm_row_behind(const mstmm_work *work, double *row)
{
    return row + work->system->n_state + work->implicit->n_u;
}
MSTMM_INLINE int mstmm_n_rest(const mstmm_work *work)
{
    return work->system->n_state - work->implicit->n_q - work->implicit->n_u;
}

/* Rows of a method's weights, see mstmm_tableau. */
MSTMM_INLINE mstmm_terms mstmm_row(const mstmm_tableau *tableau, int r)
{
    const int first = tableau->starts[r];
    return (mstmm_terms){.count = tableau->starts[r + 1] - first,
                         .columns = tableau->columns + first,
                         .weights = tableau->weights + first};
}
MSTMM_INLINE mstmm_terms mstmm_stage_terms(const mstmm_tableau *tableau, int i)
{
    return mstmm_row(tableau, i - 1);
}
MSTMM_INLINE mstmm_terms mstmm_step_terms(const mstmm_tableau *tableau)
{
    return mstmm_row(tableau, tableau->n_stages - 1);
}
MSTMM_INLINE mstmm_terms mstmm_error_terms(const mstmm_tableau *tableau, int which)
{
    return mstmm_row(tableau, tableau->n_stages + which);
}
MSTMM_INLINE mstmm_terms mstmm_extra_terms(const mstmm_tableau *tableau, int i)
{
    return mstmm_row(tableau, tableau->n_stages + 2 + i);
}
MSTMM_INLINE mstmm_terms mstmm_dense_terms(const mstmm_tableau *tableau, int j)
{
    return mstmm_row(tableau, tableau->n_stages + 2 + tableau->n_extra + j);
}

/* Implicit methods: a second set of weights for each of the stages 1 .. s - 1. */
MSTMM_INLINE mstmm_terms mstmm_second_terms(const mstmm_tableau *tableau, int i)
{
    return mstmm_row(tableau, tableau->n_stages + 1 + tableau->n_extra + tableau->n_dense + i);
}

int mstmm_all_finite(int64_t n, const double *x);
int64_t mstmm_first_not_finite(int64_t n, const double *x);
/* Notes a failure in the run and returns its status. */
int mstmm_note(mstmm_run *run, int status, int64_t code, int64_t component, double time);
int mstmm_check_finite(const mstmm_work *work, double t, const double *x);

/* The next break, INFINITY: none */
MSTMM_INLINE double mstmm_next_break(const mstmm_run *run)
{
    return run->count.break_index < run->n_breaks ? run->breaks[run->count.break_index] : INFINITY;
}

/* Time of a stage with node c in the trial step, which may lie behind the step's end.
 * A break belongs to neither side: stages of the step that ends there see the last number before
 * it, stages of the step that starts there the first number after it. */
MSTMM_INLINE double mstmm_time_in(const mstmm_run *run, double c)
{
    double t = c == 1.0 ? run->real.t_new : run->real.t + c * run->real.h;
    if (run->count.lands_on_break && t >= run->real.t_new)
        t = nextafter(run->real.t_new, -INFINITY);
    if (run->count.at_break && t <= run->real.t) t = nextafter(run->real.t, INFINITY);
    if (c > 1.0 && t >= mstmm_next_break(run)) t = nextafter(mstmm_next_break(run), -INFINITY);
    return t;
}

MSTMM_INLINE int mstmm_evaluate(const mstmm_work *work, double t, const double *y, double *dy)
{
    work->run->count.evaluations++;
    const int code = work->system->rhs(work->system->context, t, y, dy);
    return code ? mstmm_note(work->run, MSTMM_RHS_FAILED, code, -1, t) : 0;
}

/* out = y + h sum_j w_j k_j; `row` is work->row, or a constant equal to it for which the compiler
 * drops the loops. */
MSTMM_INLINE void mstmm_combine(const mstmm_work *work, mstmm_terms terms, int64_t row, double *out)
{
    const double h = work->run->real.h;
    for (int64_t i = 0; i < row; i += WIDE) {
        wide sum;
        mstmm_add_terms(&terms, work->k + i, row, &sum);
        *(wide *)(out + i) = *(const wide *)(work->y + i) + h * sum;
    }
}

#endif
