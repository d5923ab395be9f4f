/* Rosenbrock methods: one tangent a step, one solution a stage and no iteration, in two forms.
 *
 * Carried: a stage evaluates one residual, and accelerations are unknowns of the algebraic
 * equation R = 0.  With stiff springs between bodies this form is the most accurate.  But a stage
 * has its mass matrix only through the tangent of the step's start, and the error estimate does
 * not contain the error of large rotations within a step. Evaluated: a stage evaluates the
 * accelerations, which are then no unknowns.
 *
 * Steps are made in the first form, and repeated in the second if the accelerations carried to the
 * end differ from those evaluated there, for another reason than stiff springs or by too much;
 * some steps after that use the second form at once.
 *
 * E. Hairer, G. Wanner, Solving Ordinary Differential Equations II (1996), sections IV.7 (the form
 * without products by the Jacobian) and VI.3, VI.4 (differential-algebraic equations). */
#include <math.h>
#include <string.h>

#include "implicit_step.h"

enum { MOST_EVALUATED = 64 };     /* steps before the first form is tried again */
static const double SMALL = 5e-3; /* of the tolerance: what does not matter in a step */
static const double LARGE = 0.25; /* of the estimated error: what must not come on top */
static const double ALIKE = 0.75; /* of the way of a gap on its own: stiff springs leave less */

/* ---- stages ---- */

/* Prepares the right-hand side of stage i: residual, and slopes in rho. */
typedef int form(const mstmm_work *work, int i, double t);

/* As the slope of the stage's state is known */
static void set_right_side(const mstmm_work *work, const double *slope)
{
    const mstmm_implicit *at = work->implicit;
    memcpy(work->rho_q, slope, (size_t)at->n_q * sizeof *slope);
    memcpy(work->rho_u, slope + at->n_q, (size_t)at->n_u * sizeof *slope);
    memset(work->residual, 0, (size_t)at->n_u * sizeof *slope);
}

static int carried_form(const mstmm_work *work, int i, double t)
{
    const mstmm_implicit *at = work->implicit;
    double *y = work->y_stage;
    (void)i;
    int status = mstmm_step_impose(work, t, y);
    if (!status) status = mstmm_step_residual(work, t, y, NULL);
    if (!status) status = mstmm_step_rates(work, t, y, y + at->n_q, work->rho_q);
    for (int j = 0; j < at->n_u; j++) work->residual[j] = -work->residual[j];
    memcpy(work->rho_u, mstmm_row_a(work, y), (size_t)at->n_u * sizeof *y);
    return status;
}

static int evaluated_form(const mstmm_work *work, int i, double t)
{
    double *slope = work->k + i * work->row;
    const int status = mstmm_evaluate(work, t, work->y_stage, slope);
    set_right_side(work, slope);
    return status;
}

/* What the stages before leave, and -d_i h R_t */
static void add_others(const mstmm_work *work, int i)
{
    const mstmm_implicit *at = work->implicit;
    const mstmm_terms terms = mstmm_second_terms(work->tableau, i);
    const double late = work->tableau->d[i] * work->run->real.h;
    for (int j = 0; j < at->n_u; j++) work->residual[j] -= late * work->residual_rate[j];
    for (int l = 0; l < terms.count; l++) {
        const double weight = terms.weights[l], *k = work->k + terms.columns[l] * work->row;
        for (int j = 0; j < at->n_q; j++) work->rho_q[j] += weight * k[j];
        for (int j = 0; j < at->n_u; j++) work->rho_u[j] += weight * k[at->n_q + j];
    }
}

/* k_i = U_i / h; stages do not contain quadratures */
static void store_stage(const mstmm_work *work, int i)
{
    const mstmm_implicit *at = work->implicit;
    double *k = work->k + i * work->row, *a = mstmm_row_a(work, k);
    const double h = work->run->real.h;
    memset(k, 0, (size_t)work->row * sizeof *k);
    for (int j = 0; j < at->n_q; j++) k[j] = work->dq[j] / h;
    for (int j = 0; j < at->n_u; j++) {
        k[at->n_q + j] = work->du[j] / h;
        a[j] = work->da[j] / h;
    }
}

static int rosenbrock_solve_stage(const mstmm_work *work, int i, double t)
{
    add_others(work, i);
    const int status = mstmm_step_solve(work, t, work->rho_q, work->rho_u);
    if (!status) store_stage(work, i);
    return status;
}

static int rosenbrock_stage(const mstmm_work *work, int i, form *prepare)
{
    const double t = mstmm_time_in(work->run, work->tableau->c[i]);
    mstmm_combine(work, mstmm_stage_terms(work->tableau, i), work->row, work->y_stage);
    const int status = prepare(work, i, t);
    return status ? status : rosenbrock_solve_stage(work, i, t);
}

/* W-methods have their order in the second form only. */
static int uses_laws(const mstmm_work *work) { return work->run->tangents == MSTMM_LAWS_TANGENT; }

/* The tangent, and the first stage, which is the same in both forms */
static int start_step(const mstmm_work *work, double t)
{
    const double s = 1.0 / (work->tableau->gamma * work->run->real.h);
    const int code = work->implicit->residual_rate(work->system->context, t, work->y,
                                                   mstmm_row_a(work, work->y), work->residual_rate);
    if (code) return mstmm_note(work->run, MSTMM_RHS_FAILED, code, -1, t);
    const int status = mstmm_step_tangent(work, t, work->y, s, s, 1, uses_laws(work));
    if (status) return status;
    set_right_side(work, work->k);
    return rosenbrock_solve_stage(work, 1, t);
}

/* From the second stage to y_new, and the slope there */
static int complete_step(const mstmm_work *work, form *prepare)
{
    const double t = mstmm_time_in(work->run, 1.0);
    double *last = work->k + work->tableau->n_stages * work->row;
    int status = 0;
    for (int i = 2; i < work->tableau->n_stages && !status; i++)
        status = rosenbrock_stage(work, i, prepare);
    if (status) return status;
    mstmm_combine(work, mstmm_step_terms(work->tableau), work->row, work->y_new);
    status = mstmm_step_impose(work, t, work->y_new);
    if (!status) status = mstmm_check_new(work);
    if (!status) status = mstmm_evaluate(work, t, work->y_new, last);
    return status ? status : mstmm_check_finite(work, t, last);
}

/* ---- the choice between the forms ---- */

/* Sizes, in units of the tolerance, of what the gap of accelerations in rho_u moves within a step:
 * on its own, and through the tangent, which leaves little where the gap is a stiff spring's. */
static int effects_of_gap(const mstmm_work *work, double *alone, double *held)
{
    const mstmm_implicit *at = work->implicit;
    const double reach = work->tableau->gamma * work->run->real.h;
    memcpy(work->y_stage, work->y_new, (size_t)work->row * sizeof(double));
    memset(work->dq, 0, (size_t)at->n_q * sizeof(double));
    for (int j = 0; j < at->n_u; j++) work->du[j] = reach * work->rho_u[j];
    *alone = *held = mstmm_increment_norm(work);
    if (*alone < SMALL) return 0;
    memset(work->residual, 0, (size_t)at->n_u * sizeof(double));
    const int status = mstmm_step_solve(work, mstmm_time_in(work->run, 1.0), NULL, work->rho_u);
    *held = mstmm_increment_norm(work);
    return status;
}

/* True if the accelerations carried to the step's end are those there, except for stiff springs and
 * the error of the step, which is about one order less than the estimate. */
static int is_carried_accurate(const mstmm_work *work)
{
    const mstmm_implicit *at = work->implicit;
    const double *f = work->k + work->tableau->n_stages * work->row + at->n_q;
    const double *a = mstmm_row_a(work, work->y_new);
    double absolute, alone, held;
    const double error = mstmm_implicit_norm(work, &absolute);
    const double order = work->tableau->error_order + 1.0;
    const double most = error * fmin(LARGE, pow(error * work->run->rtol, 1.0 / order));
    for (int j = 0; j < at->n_u; j++) work->rho_u[j] = a[j] - f[j];
    if (effects_of_gap(work, &alone, &held)) return 0;
    return held < SMALL || held < fmin(most, ALIKE * alone);
}

/* The step in the form that suits it.  As often as the first one fails in a row, twice as many
 * steps are made in the second. */
static int choose_form(const mstmm_work *work)
{
    mstmm_run_count *count = &work->run->count;
    if (uses_laws(work) || work->implicit->evaluated) return complete_step(work, evaluated_form);
    if (count->evaluated_left > 0) {
        count->evaluated_left--;
        return complete_step(work, evaluated_form);
    }
    if (complete_step(work, carried_form) == 0 && is_carried_accurate(work)) {
        count->evaluated_row /= 2;
        return 0;
    }
    count->evaluated_row = count->evaluated_row ? 2 * count->evaluated_row : 1;
    if (count->evaluated_row > MOST_EVALUATED) count->evaluated_row = MOST_EVALUATED;
    count->evaluated_left = count->evaluated_row - 1;
    return complete_step(work, evaluated_form);
}

int mstmm_rosenbrock_stages(const mstmm_work *work)
{
    const int status = start_step(work, mstmm_time_in(work->run, 0.0));
    if (status) return status;
    const int made = choose_form(work);
    memcpy(mstmm_row_a(work, work->y_new),
           work->k + work->tableau->n_stages * work->row + work->implicit->n_q,
           (size_t)work->implicit->n_u * sizeof(double));
    return made;
}
