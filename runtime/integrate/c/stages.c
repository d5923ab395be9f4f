/* Stages of a step: those of explicit Runge-Kutta methods, and the choice of the family. */
#include <math.h>
#include <string.h>

#include "implicit_step.h"
#include "iterated_runge_kutta.h"
#include "step.h"

int mstmm_first_stage(const mstmm_work *work)
{
    mstmm_run *run = work->run;
    if (run->count.first_stage_valid) return 0;
    const double t = run->count.at_break ? nextafter(run->real.t, INFINITY) : run->real.t;
    int status = mstmm_evaluate(work, t, work->y, work->k);
    if (!status) status = mstmm_check_finite(work, t, work->k);
    if (!status && work->implicit) mstmm_implicit_restart(work);
    run->count.first_stage_valid = !status;
    return status;
}

/* `row` is work->row, or a constant equal to it for which the compiler drops the loops. */
MSTMM_INLINE int explicit_stages(const mstmm_work *work, int64_t row)
{
    const mstmm_tableau *tableau = work->tableau;
    int status = 0;
    for (int i = 1; i < tableau->n_stages && !status; i++) {
        mstmm_combine(work, mstmm_stage_terms(tableau, i), row, work->y_stage);
        status = mstmm_evaluate(work, mstmm_time_in(work->run, tableau->c[i]), work->y_stage,
                                work->k + i * row);
    }
    return status;
}

static int implicit_stages(const mstmm_work *work)
{
    switch (work->tableau->kind) {
    case MSTMM_ROSENBROCK: return mstmm_rosenbrock_stages(work);
    case MSTMM_DIRK: return mstmm_dirk_stages(work);
    case MSTMM_EXPONENTIAL: return mstmm_exponential_stages(work);
    default: return mstmm_alpha_stages(work);
    }
}

MSTMM_WIDE int mstmm_stages(const mstmm_work *work)
{
    const mstmm_tableau *tableau = work->tableau;
    const int64_t row = work->row;
    double *last = work->k + tableau->n_stages * row;
    if (work->implicit) return implicit_stages(work);
    int status = tableau->n_nodes ? mstmm_iterate(work)
                 : row == GROUP   ? explicit_stages(work, GROUP)
                                  : explicit_stages(work, row);
    if (status) return status;
    mstmm_combine(work, mstmm_step_terms(tableau), row, work->y_new);
    status = mstmm_check_finite(work, work->run->real.t_new, work->y_new);
    if (!status) status = mstmm_evaluate(work, mstmm_time_in(work->run, 1.0), work->y_new, last);
    if (!status) status = mstmm_check_finite(work, work->run->real.t_new, last);
    return status;
}
