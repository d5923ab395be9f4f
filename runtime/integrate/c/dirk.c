/* Diagonally implicit Runge-Kutta methods whose first stage is explicit and whose last one is the
 * step's end: the accelerations of the stages are found by Newton's iteration.
 *
 * C. A. Kennedy, M. H. Carpenter, Diagonally implicit Runge-Kutta methods for ordinary differential
 * equations, a review, NASA/TM-2016-219173. */
#include <string.h>

#include "implicit_step.h"

/* -s (q - q* - gamma h N(q) u): zero except for rotations during the iteration */
static int dirk_defect(const mstmm_work *work, const mstmm_newton_equations *stage)
{
    const int n_q = work->implicit->n_q;
    const double *y = work->y_stage;
    const int status = mstmm_step_rates(work, stage->t, y, y + n_q, work->rho_q);
    for (int i = 0; i < n_q; i++) work->rho_q[i] -= (y[i] - work->y_star[i]) / stage->h;
    return status;
}

/* Speeds follow from the accelerations exactly. */
static int dirk_move(const mstmm_work *work, const mstmm_newton_equations *stage)
{
    const int n_q = work->implicit->n_q, n_u = work->implicit->n_u;
    double *y = work->y_stage, *a = mstmm_row_a(work, y);
    for (int i = 0; i < n_q; i++) y[i] += work->dq[i];
    for (int i = 0; i < n_u; i++) {
        a[i] += work->da[i];
        y[n_q + i] = work->y_star[n_q + i] + stage->h * a[i];
    }
    return mstmm_step_impose(work, stage->t, y);
}

/* y_stage = y* + gamma h k with k extrapolated from the previous stages */
MSTMM_WIDE static int dirk_start(const mstmm_work *work, int i, const mstmm_newton_equations *stage)
{
    const int n_q = work->implicit->n_q, n_u = work->implicit->n_u;
    const mstmm_terms terms = mstmm_second_terms(work->tableau, i);
    double *k = work->k + i * work->row, *y = work->y_stage;
    for (int64_t j = 0; j < work->row; j += WIDE)
        mstmm_add_terms(&terms, work->k + j, work->row, (wide *)(k + j));
    memcpy(y, work->y_star, (size_t)work->row * sizeof(double));
    for (int j = 0; j < n_q + n_u; j++) y[j] += stage->h * k[j];
    memcpy(mstmm_row_a(work, y), k + n_q, (size_t)n_u * sizeof(double));
    return mstmm_step_impose(work, stage->t, y);
}

static int dirk_solve_stage(const mstmm_work *work, int i)
{
    const mstmm_tableau *tableau = work->tableau;
    const double h = tableau->gamma * work->run->real.h;
    const mstmm_newton_equations stage = {.t = mstmm_time_in(work->run, tableau->c[i]),
                                          .s = 1.0 / h,
                                          .sq = 1.0 / h,
                                          .kappa = 1,
                                          .h = h,
                                          .defect = dirk_defect,
                                          .move = dirk_move};
    mstmm_combine(work, mstmm_stage_terms(tableau, i), work->row, work->y_star);
    int status = dirk_start(work, i, &stage);
    if (!status) status = mstmm_newton_stage(work, &stage);
    return status ? status
                  : mstmm_step_slope(work, stage.t, work->y_stage, work->k + i * work->row);
}

int mstmm_dirk_stages(const mstmm_work *work)
{
    const mstmm_tableau *tableau = work->tableau;
    const int s = tableau->n_stages, n_q = work->implicit->n_q, n_u = work->implicit->n_u;
    const double *last = work->k + (s - 1) * work->row;
    int status = 0;
    for (int i = 1; i < s && !status; i++) status = dirk_solve_stage(work, i);
    if (status) return status;
    mstmm_combine(work, mstmm_step_terms(tableau), work->row, work->y_new);
    memcpy(mstmm_row_a(work, work->y_new), last + n_q, (size_t)n_u * sizeof(double));
    memcpy(work->k + s * work->row, last, (size_t)work->row * sizeof(double));
    status = mstmm_step_impose(work, mstmm_time_in(work->run, 1.0), work->y_new);
    return status ? status : mstmm_check_new(work);
}
