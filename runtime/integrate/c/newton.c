/* Newton's iteration for a stage of an implicit method, with a tangent that is kept from step to step
 * as long as it serves.
 *
 * Where it was taken is part of the run's state, so that a run that is continued elsewhere factors
 * the same tangent again and goes on bit for bit. */
#include "implicit_step.h"

#include <math.h>
#include <string.h>

static const double ENOUGH = 0.02;  /* of the tolerance: what is left of a stage's equations */
static const double PART = 1e-3;    /* of the error of a step */
static const double DAMPED = 1e-2;  /* the same, of the error times the damping gamma - 1/2 */
static const double SLOW = 0.05;    /* contraction at which a kept tangent is renewed */
static const double CHANGED = 0.1;  /* of the step: the same */
static const double SURE = 1e-2;    /* no contraction is trusted to be better */
static const double FORGET = 2.0;   /* how fast one that is not measured again grows */
static const double ROUNDING = 1e-10; /* of the first increment: no iteration makes it smaller */
static const double NOTHING = 1e-4;   /* of the tolerance: rounding, by which nothing is measured */
enum { MOST_ITERATIONS = 10 };

/* How hard to try: with the tangent in hand, with a new one, with a new one in every iteration */
enum { KEPT, RENEWED, EACH };

static int take(const mstmm_work *work, const mstmm_newton_equations *stage) {
  mstmm_run *run = work->run;
  memcpy(work->base, work->y_stage, (size_t)work->row * sizeof(double));
  run->real.tangent_t = stage->t;
  run->real.tangent_s = stage->s;
  run->real.tangent_sq = stage->sq;
  run->real.contraction = -1.0;
  const int status =
      mstmm_step_tangent(work, stage->t, work->base, stage->s, stage->sq, stage->kappa);
  run->count.tangent_valid = run->count.tangent_held = !status;
  return status;
}

/* Does the tangent in hand serve this stage? */
static int serves(const mstmm_work *work, const mstmm_newton_equations *stage) {
  const mstmm_run *run = work->run;
  return run->count.tangent_valid && run->real.contraction <= SLOW &&
         fabs(stage->s / run->real.tangent_s - 1.0) <= CHANGED;
}

/* Factors the kept tangent again where somebody else may have used the system since. */
static int hold(const mstmm_work *work, const mstmm_newton_equations *stage) {
  mstmm_run *run = work->run;
  if (run->count.tangent_held) return 0;
  const int code = work->implicit->tangent(
      work->system->context, run->real.tangent_t, work->base, mstmm_row_a(work, work->base),
      run->real.tangent_s, run->real.tangent_sq, stage->kappa);
  run->count.tangent_held = !code;
  return code ? mstmm_note(run, MSTMM_TANGENT_FAILED, code, -1, stage->t) : 0;
}

/* One iteration; *size is that of the increment. */
static int improve(const mstmm_work *work, const mstmm_newton_equations *stage, double *size) {
  work->run->count.iterations++;
  int status = mstmm_step_residual(work, stage->t, work->y_stage, NULL);
  for (int i = 0; i < work->implicit->n_u; i++) work->residual[i] = -work->residual[i];
  if (!status && stage->defect) status = stage->defect(work, stage);
  if (!status) status = mstmm_step_solve(work, stage->t, stage->defect ? work->rho_q : NULL, NULL);
  if (!status) status = stage->move(work, stage);
  if (!status) *size = mstmm_increment_norm(work);
  return status;
}

static int not_converged(const mstmm_work *work, double t) {
  return mstmm_note(work->run, MSTMM_NOT_CONVERGED, 0, mstmm_increment_worst(work), t);
}

/* What may be left of a stage's equations, in units of the tolerance: with fixed steps of Newmark's
 * family no more is asked than a small part of the error that the last step made anyway.  It is the
 * smaller the less the method damps: what no step resolves would grow by what is left, from step to
 * step. */
static double enough(const mstmm_work *work) {
  const mstmm_run *run = work->run;
  if (work->tableau->kind != MSTMM_ALPHA || run->fixed_step <= 0.0) return ENOUGH;
  const double part = fmin(PART, DAMPED * (work->tableau->gamma_n - 0.5));
  return fmax(ENOUGH, part * run->real.error_previous);
}

/* What is left of the error after an increment of this size */
static double left(double contraction, double size) {
  const double rate = fmax(contraction, SURE);
  return rate / (1.0 - rate) * size;
}

static int iterate(const mstmm_work *work, const mstmm_newton_equations *stage, int effort) {
  double *contraction = &work->run->real.contraction, size = 0.0, before = 0.0, first = 0.0;
  const double limit = enough(work);
  for (int i = 0; i < MOST_ITERATIONS; i++) {
    int status = i && effort == EACH ? take(work, stage) : 0;
    if (!status) status = improve(work, stage, &size);
    if (status) return status;
    if (work->tableau->one_iteration) return 0;
    if (!isfinite(size)) break;
    if (i == 0) first = size;
    if (size <= ROUNDING * first || size < NOTHING) return 0;
    const int measured = i > 0 && before > 0.0;
    if (measured) {
      *contraction = size / before;
      if (*contraction >= 1.0 && effort != EACH && left(SURE, size) >= limit) break;
    }
    const double known = effort == EACH ? fmin(*contraction, 0.5) : *contraction;
    if (known >= 0.0 && known < 1.0 && left(known, size) < limit) {
      if (!measured) *contraction *= FORGET;
      return 0;
    }
    before = size;
  }
  return not_converged(work, stage->t);
}

int mstmm_newton_stage(const mstmm_work *work, const mstmm_newton_equations *stage) {
  int effort = serves(work, stage) && !work->tableau->one_iteration ? KEPT : RENEWED;
  memcpy(work->y_first, work->y_stage, (size_t)work->row * sizeof(double));
  for (;; effort++) {
    int status = effort == KEPT ? hold(work, stage) : take(work, stage);
    if (!status) status = iterate(work, stage, effort);
    if (!status) return 0;
    work->run->count.tangent_valid = 0;
    if (effort == EACH) return status;
    memcpy(work->y_stage, work->y_first, (size_t)work->row * sizeof(double));
  }
}
