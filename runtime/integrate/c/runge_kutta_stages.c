/* Arithmetic of one step: stages of explicit Runge-Kutta methods, dense output of all methods. */
#include <math.h>
#include <string.h>

#include "implicit_step.h"
#include "iterate.h"
#include "step.h"

int mstmm_first_stage(const mstmm_work *work) {
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
MSTMM_INLINE int explicit_stages(const mstmm_work *work, int64_t row) {
  const mstmm_tableau *tableau = work->tableau;
  int status = 0;
  for (int i = 1; i < tableau->n_stages && !status; i++) {
    mstmm_combine(work, mstmm_stage_terms(tableau, i), row, work->y_stage);
    status = mstmm_evaluate(work, mstmm_time_in(work->run, tableau->c[i]), work->y_stage,
                            work->k + i * row);
  }
  return status;
}

MSTMM_WIDE int mstmm_stages(const mstmm_work *work) {
  const mstmm_tableau *tableau = work->tableau;
  const int64_t row = work->row;
  double *last = work->k + tableau->n_stages * row;
  if (work->implicit) return mstmm_implicit_stages(work);
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

MSTMM_WIDE int mstmm_build_dense(const mstmm_work *work) {
  const mstmm_tableau *tableau = work->tableau;
  const int64_t row = work->row;
  const double h = work->run->real.h;
  int status = 0;
  for (int i = 0; i < tableau->n_extra && !status; i++) {
    double *k = work->k + (tableau->n_stages + 1 + i) * row;
    const double t = mstmm_time_in(work->run, tableau->c_extra[i]);
    mstmm_combine(work, mstmm_extra_terms(tableau, i), row, work->y_event);
    status = mstmm_evaluate(work, t, work->y_event, k);
    if (!status) status = mstmm_check_finite(work, t, k);
  }
  for (int j = 0; j < tableau->n_dense && !status; j++) {
    const mstmm_terms terms = mstmm_dense_terms(tableau, j);
    for (int64_t i = 0; i < row; i += WIDE) {
      wide sum;
      mstmm_add_terms(&terms, work->k + i, row, &sum);
      *(wide *)(work->dense + j * row + i) = h * sum;
    }
  }
  return status;
}

MSTMM_WIDE void mstmm_dense(const mstmm_work *work, double t, double *y) {
  const int64_t row = work->row;
  const double theta = (t - work->run->real.t) / work->run->real.h;
  if (t == work->run->real.t_new) {
    memcpy(y, work->y_new, (size_t)row * sizeof *y);
    return;
  }
  for (int64_t i = 0; i < row; i += WIDE) {
    wide sum = {0.0};
    for (int j = work->tableau->n_dense - 1; j >= 0; j--)
      sum = (j % 2 ? 1.0 - theta : theta) * (sum + *(const wide *)(work->dense + j * row + i));
    *(wide *)(y + i) = *(const wide *)(work->y + i) + sum;
  }
  if (work->tableau->kind == MSTMM_EXPONENTIAL) mstmm_exponential_dense(work, theta, y);
  if (work->implicit)
    (void)mstmm_step_impose(work, t, y); /* who needs what fails here fails by it */
}

MSTMM_WIDE void mstmm_dense_rates(const mstmm_work *work, double t, double *rates) {
  const int64_t row = work->row;
  const double h = work->run->real.h, theta = (t - work->run->real.t) / h;
  for (int64_t i = 0; i < row; i += WIDE) {
    wide sum = {0.0}, slope = {0.0};
    for (int j = work->tableau->n_dense - 1; j >= 0; j--) {
      const double factor = j % 2 ? 1.0 - theta : theta, sign = j % 2 ? -1.0 : 1.0;
      sum += *(const wide *)(work->dense + j * row + i);
      slope = sign * sum + factor * slope;
      sum *= factor;
    }
    *(wide *)(rates + i) = slope / h;
  }
}
