/* Arithmetic of one explicit Runge-Kutta step: its stages and its dense output. */
#include <math.h>
#include <string.h>

#include "step.h"

int mstmm_note(mstmm_run *run, int status, int64_t code, int64_t component, double time) {
  run->count.fail_status = status;
  run->count.code = code;
  run->count.component = component;
  run->real.fail_time = time;
  return status;
}

int64_t mstmm_first_not_finite(int64_t n, const double *x) {
  for (int64_t i = 0; i < n; i++)
    if (!isfinite(x[i])) return i;
  return -1;
}

int mstmm_all_finite(int64_t n, const double *x) {
  wide zeros = {0.0}; /* 0 * x is 0 for finite x and NaN otherwise */
  double rest = 0.0;
  int64_t i = 0;
  for (; i + WIDE <= n; i += WIDE) zeros += 0.0 * *(const wide *)(x + i);
  for (; i < n; i++) rest += 0.0 * x[i];
  return mstmm_total(&zeros) + rest == 0.0;
}

int mstmm_check_finite(const mstmm_work *work, double t, const double *x) {
  const int64_t n = work->system->n_state;
  if (mstmm_all_finite(n, x)) return 0;
  return mstmm_note(work->run, MSTMM_NOT_FINITE, 0, mstmm_first_not_finite(n, x), t);
}

/* A break belongs to neither side: stages of the step that ends there see the last number before
 * it, stages of the step that starts there the first number after it. */
double mstmm_time_in(const mstmm_run *run, double c) {
  double t = c == 1.0 ? run->real.t_new : run->real.t + c * run->real.h;
  if (run->count.lands_on_break && t >= run->real.t_new) t = nextafter(run->real.t_new, -INFINITY);
  if (run->count.at_break && t <= run->real.t) t = nextafter(run->real.t, INFINITY);
  return t;
}

int mstmm_evaluate(const mstmm_work *work, double t, const double *y, double *dy) {
  work->run->count.evaluations++;
  const int code = work->system->rhs(work->system->context, t, y, dy);
  return code ? mstmm_note(work->run, MSTMM_RHS_FAILED, code, -1, t) : 0;
}

int mstmm_first_stage(const mstmm_work *work) {
  mstmm_run *run = work->run;
  if (run->count.first_stage_valid) return 0;
  const double t = run->count.at_break ? nextafter(run->real.t, INFINITY) : run->real.t;
  int status = mstmm_evaluate(work, t, work->y, work->k);
  if (!status) status = mstmm_check_finite(work, t, work->k);
  run->count.first_stage_valid = !status;
  return status;
}

/* out = y + h sum_j w_j k_j */
MSTMM_INLINE void combine(const mstmm_work *work, mstmm_terms terms, int64_t row, double *out) {
  const double h = work->run->real.h;
  for (int64_t i = 0; i < row; i += WIDE) {
    wide sum;
    mstmm_add_terms(&terms, work->k + i, row, &sum);
    *(wide *)(out + i) = *(const wide *)(work->y + i) + h * sum;
  }
}

/* `row` is work->row, or a constant equal to it for which the compiler drops the loops. */
MSTMM_INLINE int explicit_stages(const mstmm_work *work, int64_t row) {
  const mstmm_tableau *tableau = work->tableau;
  int status = 0;
  for (int i = 1; i < tableau->n_stages && !status; i++) {
    combine(work, mstmm_stage_terms(tableau, i), row, work->y_stage);
    status = mstmm_evaluate(work, mstmm_time_in(work->run, tableau->c[i]), work->y_stage,
                            work->k + i * row);
  }
  return status;
}

MSTMM_WIDE int mstmm_stages(const mstmm_work *work) {
  const mstmm_tableau *tableau = work->tableau;
  const int64_t row = work->row;
  double *last = work->k + tableau->n_stages * row;
  int status = tableau->n_nodes ? mstmm_iterate(work)
               : row == WIDE    ? explicit_stages(work, WIDE)
                                : explicit_stages(work, row);
  if (status) return status;
  combine(work, mstmm_step_terms(tableau), row, work->y_new);
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
    combine(work, mstmm_extra_terms(tableau, i), row, work->y_event);
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
}
