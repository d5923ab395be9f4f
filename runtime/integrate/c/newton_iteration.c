/* Newton's iteration for a stage of an implicit method, with a tangent that is kept over steps as
 * long as it converges.
 *
 * If the approximate tangent by laws is much cheaper it is used first: the omitted derivatives of
 * inertia and loads give a contraction like (h w)^2, w the fastest motion that they cause.  If
 * that is slow, some stages are solved with exact tangents before it is tried again.
 *
 * The state of the tangent is part of the run's state, so that a restarted run factors the same
 * tangent again and continues bit for bit. */
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
static const double NOTHING = 1e-4; /* of the tolerance: rounding, by which nothing is measured */
/* The same of laws alone, which cost less to renew than an iteration */
static const double SLOW_BY_LAWS = 0.1, CHANGED_BY_LAWS = 0.01;
static const double TOO_SLOW = 0.25; /* contraction by new laws: an exact tangent pays from it on */
static const double HOPELESS = 0.5; /* and at once, in the midst of an iteration */
enum { MOST_ITERATIONS = 10, FIRST_EXACT = 8, MOST_EXACT = 256 };

/* Levels of effort: with the present tangent, a new one, a new one in every iteration */
enum { KEPT, RENEWED, EACH };

static int can_use_laws(const mstmm_work *work)
{
    return work->implicit->laws && !work->tableau->one_iteration &&
           work->run->tangents != MSTMM_EXACT_TANGENT;
}

/* Which of the two tangents to take */
static int wants_laws(const mstmm_work *work)
{
    const mstmm_run *run = work->run;
    if (!can_use_laws(work)) return 0;
    if (run->tangents != MSTMM_ANY_TANGENT) return run->tangents == MSTMM_LAWS_TANGENT;
    return work->implicit->laws_spare && run->count.exact_left == 0;
}

/* Tangents are those of the rows that the step at hand has, or the kept one had. */
static void request_rows(const mstmm_work *work)
{
    if (work->implicit->placing)
        work->implicit->ask_positions(work->system->context, (int)work->run->count.by_positions);
}

static int factor_tangent(const mstmm_work *work, const mstmm_newton_equations *stage, int laws)
{
    mstmm_run *run = work->run;
    run->count.by_positions = mstmm_step_places(work);
    request_rows(work);
    memcpy(work->base, work->y_stage, (size_t)work->row * sizeof(double));
    run->real.contraction = -1.0;
    run->real.tangent_t = stage->t;
    run->real.tangent_s = stage->s;
    run->real.tangent_sq = stage->sq;
    run->count.by_laws = laws;
    const int status =
        mstmm_step_tangent(work, stage->t, work->base, stage->s, stage->sq, stage->kappa, laws);
    run->count.tangent_valid = run->count.tangent_held = !status;
    return status;
}

/* True if the present tangent suits this stage. */
static int is_tangent_usable(const mstmm_work *work, const mstmm_newton_equations *stage)
{
    const mstmm_run *run = work->run;
    const int laws = (int)run->count.by_laws;
    return run->count.tangent_valid && run->count.by_positions == mstmm_step_places(work) &&
           run->real.contraction <= (laws ? SLOW_BY_LAWS : SLOW) &&
           fabs(stage->s / run->real.tangent_s - 1.0) <= (laws ? CHANGED_BY_LAWS : CHANGED);
}

/* Factors the kept tangent again if the caller may have used the system since. */
static int refactor_tangent(const mstmm_work *work, const mstmm_newton_equations *stage)
{
    mstmm_run *run = work->run;
    const mstmm_implicit *at = work->implicit;
    if (run->count.tangent_held) return 0;
    request_rows(work);
    const int code = (run->count.by_laws && at->laws ? at->laws : at->tangent)(
        work->system->context, run->real.tangent_t, work->base, mstmm_row_a(work, work->base),
        run->real.tangent_s, run->real.tangent_sq, stage->kappa);
    run->count.tangent_held = !code;
    return code ? mstmm_note(run, MSTMM_TANGENT_FAILED, code, -1, stage->t) : 0;
}

/* One iteration; *size is that of the increment. */
static int newton_step(const mstmm_work *work, const mstmm_newton_equations *stage, double *size)
{
    work->run->count.iterations++;
    int status = mstmm_step_places(work)
                     ? mstmm_step_placing(work, stage->t, work->y_stage, 1.0 / stage->cq)
                     : mstmm_step_residual(work, stage->t, work->y_stage, NULL);
    for (int i = 0; i < work->implicit->n_u; i++) work->residual[i] = -work->residual[i];
    if (!status && stage->defect) status = stage->defect(work, stage);
    if (!status)
        status = mstmm_step_solve(work, stage->t, stage->defect ? work->rho_q : NULL, NULL);
    if (!status) status = stage->move(work, stage);
    if (!status) *size = mstmm_increment_norm(work);
    return status;
}

static int not_converged(const mstmm_work *work, double t)
{
    return mstmm_note(work->run, MSTMM_NOT_CONVERGED, 0, mstmm_increment_worst(work), t);
}

/* What may be left of a stage's equations, in units of the tolerance: with fixed steps of Newmark's
 * family no more is asked than a small part of the error that the last step made anyway.  It is the
 * smaller the less the method damps: what no step resolves would grow by what is left, from step to
 * step. */
static double residual_limit(const mstmm_work *work)
{
    const mstmm_run *run = work->run;
    if (work->tableau->kind != MSTMM_ALPHA || run->fixed_step <= 0.0) return ENOUGH;
    const double part = fmin(PART, DAMPED * (work->tableau->gamma_n - 0.5));
    return fmax(ENOUGH, part * run->real.error_previous);
}

/* True if there is a better tangent than the present one. */
static int can_use_exact(const mstmm_work *work)
{
    return work->run->count.by_laws && work->run->tangents == MSTMM_ANY_TANGENT;
}

/* What is left of the error after an increment of this size */
static double remaining_error(double contraction, double size)
{
    const double rate = fmax(contraction, SURE);
    return rate / (1.0 - rate) * size;
}

static int newton_iterate(const mstmm_work *work, const mstmm_newton_equations *stage, int effort)
{
    double *contraction = &work->run->real.contraction, size = 0.0, before = 0.0, first = 0.0;
    const double limit = residual_limit(work), most = can_use_exact(work) ? HOPELESS : 1.0;
    for (int i = 0; i < MOST_ITERATIONS; i++) {
        int status = i && effort == EACH ? factor_tangent(work, stage, 0) : 0;
        if (!status) status = newton_step(work, stage, &size);
        if (status) return status;
        if (work->tableau->one_iteration) return 0;
        if (!isfinite(size)) break;
        if (i == 0) first = size;
        if (size <= ROUNDING * first || size < NOTHING) return 0;
        const int measured = i > 0 && before > 0.0;
        if (measured) {
            *contraction = size / before;
            if (*contraction >= most && effort != EACH && remaining_error(SURE, size) >= limit)
                break;
        }
        const double known = effort == EACH ? fmin(*contraction, 0.5) : *contraction;
        if (known >= 0.0 && known < 1.0 && remaining_error(known, size) < limit) {
            if (!measured) *contraction *= FORGET;
            return 0;
        }
        before = size;
    }
    return not_converged(work, stage->t);
}

/* As often as new tangents of laws alone are too slow, twice as many stages are solved without. */
static void count_exact_stages(const mstmm_work *work, int effort, int solved)
{
    mstmm_run_count *count = &work->run->count;
    if (!can_use_exact(work)) {
        if (count->exact_left > 0) count->exact_left--;
    } else if (effort == RENEWED && (!solved || work->run->real.contraction > TOO_SLOW)) {
        count->exact_row = count->exact_row ? 2 * count->exact_row : FIRST_EXACT;
        if (count->exact_row > MOST_EXACT) count->exact_row = MOST_EXACT;
        count->exact_left = count->exact_row;
    } else if (solved) {
        count->exact_row /= 2;
    }
}

static int attempt_stage(const mstmm_work *work, const mstmm_newton_equations *stage, int effort,
                         int laws)
{
    const int status =
        effort == KEPT ? refactor_tangent(work, stage) : factor_tangent(work, stage, laws);
    return status ? status : newton_iterate(work, stage, effort);
}

/* Laws alone may have a tangent where there is no exact one, as where an expression rises
 * infinitely fast.  If they lead nowhere either, that there is none is the reason. */
static int solve_without_exact(const mstmm_work *work, const mstmm_newton_equations *stage)
{
    mstmm_run *run = work->run;
    const int64_t code = run->count.code;
    const double time = run->real.fail_time;
    memcpy(work->y_stage, work->y_first, (size_t)work->row * sizeof(double));
    if (!attempt_stage(work, stage, RENEWED, 1)) return 0;
    run->count.tangent_valid = 0;
    return mstmm_note(run, MSTMM_TANGENT_FAILED, code, -1, time);
}

int mstmm_newton_stage(const mstmm_work *work, const mstmm_newton_equations *stage)
{
    mstmm_run_count *count = &work->run->count;
    int effort = is_tangent_usable(work, stage) && !work->tableau->one_iteration ? KEPT : RENEWED;
    int laws = wants_laws(work);
    const int other = can_use_laws(work) && !laws;
    memcpy(work->y_first, work->y_stage, (size_t)work->row * sizeof(double));
    for (;;) {
        const int status = attempt_stage(work, stage, effort, laws);
        count_exact_stages(work, effort, !status);
        if (!status) return 0;
        count->tangent_valid = 0;
        if (effort == EACH)
            return other && status == MSTMM_TANGENT_FAILED ? solve_without_exact(work, stage)
                                                           : status;
        if (effort == RENEWED && laws)
            laws = 0; /* once more with an exact one */
        else
            effort++;
        memcpy(work->y_stage, work->y_first, (size_t)work->row * sizeof(double));
    }
}
