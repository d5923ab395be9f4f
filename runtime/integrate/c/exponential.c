/* An exponential Rosenbrock method.  At a step's start the motion is linearised,
 * y' = f + J (y - y_0) + f_t (t - t_0) + remainder, and its linear part is integrated exactly,
 * however fast it oscillates:
 *
 *   Y = y_0 + h phi_1(h J) f + h^2 phi_2(h J) f_t
 *   y_1 = Y + 2 h phi_3(h J) D,   D = f(t_1, Y) - f - J (Y - y_0) - h f_t
 *
 * Y is of second order and the last term its error.  Inside the step the remainder of f grows as
 * D theta^2, so that dense output is the same motion at an earlier time.
 *
 * J comes from derivatives along single coordinates and speeds, the lower half of it and f_t behind
 * the inverse of the mass matrix.  Rows of prescribed coordinates are zero, also in f, f_t and D,
 * so that neither J nor the error contains them.
 *
 * M. Hochbruck, A. Ostermann, J. Schweitzer, Exponential Rosenbrock-type methods, SIAM Journal on
 * Numerical Analysis 47 (2009) 786-803. */
#include <string.h>

#include "implicit_step.h"

/* The tangent K W + C + s M of this s is s M but for rounding, and exact in it: a power of two. */
static const double ALL_MASS = 0x1p200;

static int unknowns(const mstmm_work *work) { return work->implicit->n_q + work->implicit->n_u; }

/* ---- the linear motion at a step's start ---- */

static int invert_mass(const mstmm_work *work, double t)
{
    const int n_u = work->implicit->n_u;
    int status = mstmm_step_tangent(work, t, work->y, ALL_MASS, 1.0, 0, 0);
    for (int j = 0; j < n_u && !status; j++) {
        for (int i = 0; i < n_u; i++) work->residual[i] = i == j;
        status = mstmm_step_solve(work, t, NULL, NULL);
        for (int i = 0; i < n_u; i++) work->inverse_mass[i * n_u + j] = work->da[i];
    }
    return status;
}

/* to_i = -(M^-1 r)_i, entries of `to` lying `stride` apart */
static void accelerate(const mstmm_work *work, const double *r, int stride, double *to)
{
    const int n_u = work->implicit->n_u;
    for (int i = 0; i < n_u; i++) {
        double sum = 0.0;
        for (int j = 0; j < n_u; j++) sum -= work->inverse_mass[i * n_u + j] * r[j];
        to[i * stride] = sum;
    }
}

static int fill_jacobian(const mstmm_work *work, double t)
{
    const mstmm_implicit *at = work->implicit;
    const int n_q = at->n_q, n = unknowns(work);
    double *direction = work->motion, *column = work->jacobian;
    memset(direction, 0, (size_t)n * sizeof *direction);
    for (int j = 0; j < n; j++, column++) {
        direction[j] = 1.0;
        const int code = at->slope(work->system->context, t, work->y, mstmm_row_a(work, work->y),
                                   direction, direction + n_q, work->dq, work->residual);
        if (code) return mstmm_note(work->run, MSTMM_TANGENT_FAILED, code, -1, t);
        direction[j] = 0.0;
        for (int i = 0; i < n_q; i++) column[i * n] = work->dq[i];
        accelerate(work, work->residual, n, column + n_q * n);
    }
    return 0;
}

/* J and f_t at the step's start, unless a longer step from there has computed them. */
static int linearise(const mstmm_work *work)
{
    const mstmm_implicit *at = work->implicit;
    mstmm_run *run = work->run;
    const double t = mstmm_time_in(run, 0.0);
    if (run->count.tangent_valid && run->count.tangent_held && run->real.tangent_t == t) return 0;
    run->count.tangent_valid = run->count.tangent_held = 0;
    int status = invert_mass(work, t);
    if (!status) status = fill_jacobian(work, t);
    if (status) return status;
    const int code = at->residual_rate(work->system->context, t, work->y,
                                       mstmm_row_a(work, work->y), work->residual_rate);
    if (code) return mstmm_note(run, MSTMM_RHS_FAILED, code, -1, t);
    memset(work->time_slope, 0, (size_t)at->n_q * sizeof(double));
    accelerate(work, work->residual_rate, 1, work->time_slope + at->n_q);
    run->real.tangent_t = t;
    run->count.tangent_valid = run->count.tangent_held = 1;
    return 0;
}

/* ---- the step ---- */

/* Parts of work->motion, n each */
typedef struct parts {
    double *f, *way, *rest, *scratch; /* rates at the start, Y - y_0, D, and intermediate results */
} parts;

static parts motion_parts(const mstmm_work *work)
{
    const int n = unknowns(work);
    double *first = work->motion;
    return (parts){.f = first, .way = first + n, .rest = first + 2 * n, .scratch = first + 3 * n};
}

/* Rates of coordinates and speeds at a row, from its slope, zero for prescribed ones */
static int free_rates(const mstmm_work *work, double t, const double *row, const double *slope,
                      double *to)
{
    const int n_q = work->implicit->n_q, n_u = work->implicit->n_u;
    for (int i = 0; i < n_u; i++)
        to[n_q + i] = work->inverse_mass[i * n_u + i] > 0.0 ? slope[n_q + i] : 0.0;
    return mstmm_step_rates(work, t, row, row + n_q, to);
}

static void set_force(const mstmm_work *work, int k, double weight, const double *vector)
{
    double *c = motion_parts(work).scratch;
    for (int i = 0; i < unknowns(work); i++) c[i] = weight * vector[i];
    mstmm_phi_force(&work->phi, k, c);
}

static int integrate_linear_part(const mstmm_work *work, const parts *at)
{
    const double h = work->run->real.h, t = mstmm_time_in(work->run, 0.0);
    const int n = unknowns(work), status = free_rates(work, t, work->y, work->k, at->f);
    if (status) return status;
    if (mstmm_phi_prepare(&work->phi, h, work->jacobian))
        return mstmm_note(work->run, MSTMM_TANGENT_FAILED, 0, -1, t);
    set_force(work, 0, h, at->f);
    set_force(work, 1, h * h, work->time_slope);
    mstmm_phi_part(&work->phi, 0, at->way);
    mstmm_phi_part(&work->phi, 1, at->scratch);
    for (int i = 0; i < n; i++) at->way[i] += at->scratch[i];
    memcpy(work->y_stage, work->y, (size_t)work->row * sizeof(double));
    for (int i = 0; i < n; i++) work->y_stage[i] += at->way[i];
    return mstmm_step_impose(work, mstmm_time_in(work->run, 1.0), work->y_stage);
}

/* D, and its contribution to the motion */
static int integrate_remainder(const mstmm_work *work, const parts *at)
{
    const double h = work->run->real.h, t = mstmm_time_in(work->run, 1.0);
    const int n = unknowns(work);
    double *slope = work->k + work->row;
    int status = mstmm_evaluate(work, t, work->y_stage, slope);
    if (!status) status = mstmm_check_finite(work, t, slope);
    if (!status) status = free_rates(work, t, work->y_stage, slope, at->rest);
    if (status) return status;
    for (int i = 0; i < n; i++) {
        double linear = at->f[i] + h * work->time_slope[i];
        for (int j = 0; j < n; j++) linear += work->jacobian[i * n + j] * at->way[j];
        at->rest[i] -= linear;
    }
    set_force(work, 2, 2.0 * h, at->rest);
    mstmm_phi_part(&work->phi, 2, at->rest);
    return 0;
}

/* y_new, its slope, the step as a whole and its error */
static int finish_exponential_step(const mstmm_work *work, const parts *at)
{
    const double h = work->run->real.h, t = mstmm_time_in(work->run, 1.0);
    double *whole = work->k + work->row, *error = whole + work->row, *last = error + work->row;
    const int n = unknowns(work);
    memcpy(work->y_new, work->y, (size_t)work->row * sizeof(double));
    for (int i = 0; i < n; i++) work->y_new[i] += at->way[i] + at->rest[i];
    int status = mstmm_step_impose(work, t, work->y_new);
    if (!status) status = mstmm_check_finite(work, t, work->y_new);
    if (!status) status = mstmm_evaluate(work, t, work->y_new, last);
    if (!status) status = mstmm_check_finite(work, t, last);
    if (status) return status;
    memcpy(mstmm_row_a(work, work->y_new), last + work->implicit->n_q,
           (size_t)work->implicit->n_u * sizeof(double));
    for (int64_t i = 0; i < work->row; i++) whole[i] = (work->y_new[i] - work->y[i]) / h;
    memset(error, 0, (size_t)work->row * sizeof(double));
    for (int i = 0; i < n; i++) error[i] = at->rest[i] / h;
    return 0;
}

int mstmm_exponential_stages(const mstmm_work *work)
{
    const parts at = motion_parts(work);
    int status = linearise(work);
    if (!status) status = integrate_linear_part(work, &at);
    if (!status) status = integrate_remainder(work, &at);
    return status ? status : finish_exponential_step(work, &at);
}

void mstmm_exponential_dense(const mstmm_work *work, double theta, double *y)
{
    double *way = motion_parts(work).scratch;
    mstmm_phi_at(&work->phi, theta, way);
    for (int i = 0; i < unknowns(work); i++) y[i] = work->y[i] + way[i];
}
