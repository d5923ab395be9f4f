/* Rosenbrock methods: one tangent a step, one evaluation of the accelerations and one solution a
 * stage, no iteration.
 *
 * Accelerations are evaluated, not carried along as unknowns of the algebraic equation R = 0: a stage
 * would see the mass matrix of its own place through the tangent of the step's start alone, and where
 * bodies turn over by far within a step, an error of the accelerations grows from step to step.
 *
 * E. Hairer, G. Wanner, Solving Ordinary Differential Equations II (1996), section IV.7 (the form
 * without products by the Jacobian). */
#include <string.h>

#include "implicit_step.h"

/* The right-hand side of stage i: the slope of its state, and what the stages before leave, in rho;
 * -d_i h R_t. */
static int prepare(const mstmm_work *work, int i, double t) {
  const mstmm_implicit *at = work->implicit;
  const mstmm_terms terms = mstmm_second_terms(work->tableau, i);
  const double late = work->tableau->d[i] * work->run->real.h;
  double *slope = work->k + i * work->row;
  if (i == 1) { /* at the start of the step */
    memcpy(slope, work->k, (size_t)work->row * sizeof *slope);
  } else {
    const int status = mstmm_evaluate(work, t, work->y_stage, slope);
    if (status) return status;
  }
  memcpy(work->rho_q, slope, (size_t)at->n_q * sizeof *slope);
  memcpy(work->rho_u, slope + at->n_q, (size_t)at->n_u * sizeof *slope);
  for (int j = 0; j < at->n_u; j++) work->residual[j] = -late * work->residual_rate[j];
  for (int l = 0; l < terms.count; l++) {
    const double weight = terms.weights[l], *k = work->k + terms.columns[l] * work->row;
    for (int j = 0; j < at->n_q; j++) work->rho_q[j] += weight * k[j];
    for (int j = 0; j < at->n_u; j++) work->rho_u[j] += weight * k[at->n_q + j];
  }
  return 0;
}

/* k_i = U_i / h; quadratures and accelerations are not the stages' affair */
static void keep(const mstmm_work *work, int i) {
  const mstmm_implicit *at = work->implicit;
  double *k = work->k + i * work->row;
  const double h = work->run->real.h;
  memset(k, 0, (size_t)work->row * sizeof *k);
  for (int j = 0; j < at->n_q; j++) k[j] = work->dq[j] / h;
  for (int j = 0; j < at->n_u; j++) k[at->n_q + j] = work->du[j] / h;
}

static int stage(const mstmm_work *work, int i) {
  const double t = mstmm_time_in(work->run, work->tableau->c[i]);
  mstmm_combine(work, mstmm_stage_terms(work->tableau, i), work->row, work->y_stage);
  int status = prepare(work, i, t);
  if (!status) status = mstmm_step_solve(work, t, work->rho_q, work->rho_u);
  if (!status) keep(work, i);
  return status;
}

static int begin(const mstmm_work *work, double t) {
  const double s = 1.0 / (work->tableau->gamma * work->run->real.h);
  const int code =
      work->implicit->residual_rate(work->system->context, t, work->y,
                                    mstmm_row_a(work, work->y), work->residual_rate);
  if (code) return mstmm_note(work->run, MSTMM_RHS_FAILED, code, -1, t);
  return mstmm_step_tangent(work, t, work->y, s, s, 1);
}

int mstmm_rosenbrock_stages(const mstmm_work *work) {
  int status = begin(work, mstmm_time_in(work->run, 0.0));
  for (int i = 1; i < work->tableau->n_stages && !status; i++) status = stage(work, i);
  if (status) return status;
  mstmm_combine(work, mstmm_step_terms(work->tableau), work->row, work->y_new);
  status = mstmm_step_impose(work, mstmm_time_in(work->run, 1.0), work->y_new);
  return status ? status : mstmm_check_new(work);
}
