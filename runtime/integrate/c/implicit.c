/* Common parts of the implicit methods: calls of the system, and norms of their errors. */
#include "implicit_step.h"

#include <math.h>
#include <string.h>

/* ---- the system ---- */

int mstmm_step_impose(const mstmm_work *work, double t, double *row)
{
    const mstmm_implicit *at = work->implicit;
    if (!at->impose) return 0;
    const int code = at->impose(work->system->context, t, row, mstmm_row_a(work, row));
    return code ? mstmm_note(work->run, MSTMM_RHS_FAILED, code, -1, t) : 0;
}

int mstmm_step_residual(const mstmm_work *work, double t, const double *row, double *rest)
{
    work->run->count.residuals++;
    const int code = work->implicit->residual(work->system->context, t, row,
                                              row + work->system->n_state, work->residual, rest);
    return code ? mstmm_note(work->run, MSTMM_RHS_FAILED, code, -1, t) : 0;
}

int mstmm_step_placing(const mstmm_work *work, double t, const double *row, double closing)
{
    work->run->count.residuals++;
    const int code = work->implicit->placing(work->system->context, t, row,
                                             row + work->system->n_state, closing, work->residual);
    return code ? mstmm_note(work->run, MSTMM_RHS_FAILED, code, -1, t) : 0;
}

int mstmm_step_places(const mstmm_work *work)
{
    return work->implicit->placing && !work->run->count.cut_short;
}

int mstmm_step_rates(const mstmm_work *work, double t, const double *q, const double *u, double *dq)
{
    const mstmm_implicit *at = work->implicit;
    if (!at->rates) {
        memcpy(dq, u, (size_t)at->n_q * sizeof *dq);
        return 0;
    }
    const int code = at->rates(work->system->context, q, u, dq);
    return code ? mstmm_note(work->run, MSTMM_RHS_FAILED, code, -1, t) : 0;
}

int mstmm_step_tangent(const mstmm_work *work, double t, const double *row, double s, double sq,
                       int kappa, int laws)
{
    const mstmm_implicit *at = work->implicit;
    work->run->count.tangents++;
    work->run->count.laws_tangents += laws;
    const int code = (laws ? at->laws : at->tangent)(work->system->context, t, row,
                                                     row + work->system->n_state, s, sq, kappa);
    return code ? mstmm_note(work->run, MSTMM_TANGENT_FAILED, code, -1, t) : 0;
}

int mstmm_step_solve(const mstmm_work *work, double t, const double *rho_q, const double *rho_u)
{
    work->run->count.solves++;
    const int code = work->implicit->solve(work->system->context, work->residual, rho_q, rho_u,
                                           work->dq, work->du, work->da);
    return code ? mstmm_note(work->run, MSTMM_TANGENT_FAILED, code, -1, t) : 0;
}

int mstmm_step_slope(const mstmm_work *work, double t, const double *row, double *slope)
{
    const int n_q = work->implicit->n_q, n_u = work->implicit->n_u;
    int status = mstmm_step_rates(work, t, row, row + n_q, slope);
    memcpy(slope + n_q, row + work->system->n_state, (size_t)n_u * sizeof *slope);
    if (!status && mstmm_n_rest(work))
        status = mstmm_step_residual(work, t, row, slope + n_q + n_u);
    return status ? status : mstmm_check_finite(work, t, slope);
}

int mstmm_check_new(const mstmm_work *work)
{
    const int n_q = work->implicit->n_q, n_u = work->implicit->n_u;
    const double *a = mstmm_row_a(work, work->y_new), t = work->run->real.t_new;
    const int status = mstmm_check_finite(work, t, work->y_new);
    if (status || mstmm_all_finite(n_u, a)) return status;
    return mstmm_note(work->run, MSTMM_NOT_FINITE, 0, n_q + mstmm_first_not_finite(n_u, a), t);
}

void mstmm_implicit_restart(const mstmm_work *work)
{
    mstmm_run *run = work->run;
    memcpy(mstmm_row_a(work, work->y), work->k + work->implicit->n_q,
           (size_t)work->implicit->n_u * sizeof(double));
    run->real.h_previous = run->real.error_previous = 0.0;
    run->count.tangent_valid = run->count.history = 0;
}

/* ---- norms ---- */

MSTMM_INLINE double tolerance(const mstmm_work *work, const double *other, int64_t i)
{
    const double here = fabs(work->y[i]), there = fabs(other[i]);
    return work->atol[i] +
           work->run->rtol * (there > here ? there : here); /* fmax would be a call */
}

/* Size of error e of component i in units of its tolerance, which goes with the size of the state
 * here or at the other end. */
MSTMM_INLINE double scaled_plain(const mstmm_work *work, const double *other, int64_t i, double e)
{
    const double unit = tolerance(work, other, i);
    return unit > 0.0 ? fabs(e) / unit : 0.0;
}

/* The same for speed i - n_q: weighted by its displacement in a step, because the vibration of a
 * stiff spring is fast and small and its speed irrelevant. */
MSTMM_INLINE double scaled_speed(const mstmm_work *work, const double *other, int64_t i, double e)
{
    const int *coordinates = work->implicit->coordinates;
    const int64_t j = i - work->implicit->n_q;
    const double h = work->run->real.h;
    const double unit = tolerance(work, other, coordinates ? coordinates[j] : j) +
                        0.1 * h * tolerance(work, other, i);
    return unit > 0.0 ? fabs(e * h) / unit : 0.0;
}

MSTMM_INLINE int is_speed(const mstmm_work *work, int64_t i)
{
    return i >= work->implicit->n_q && i < work->implicit->n_q + work->implicit->n_u;
}

MSTMM_INLINE double rms(const mstmm_work *work, const double *other, int64_t first, int64_t last,
                        int speeds)
{
    double sum = 0.0;
    if (last > work->system->n_error) last = work->system->n_error;
    for (int64_t i = first; i < last; i++) {
        const double e = speeds ? scaled_speed(work, other, i, work->error[i])
                                : scaled_plain(work, other, i, work->error[i]);
        sum += e * e;
    }
    return last > first ? sqrt(sum / (double)(last - first)) : 0.0;
}

/* The largest of three, or NaN where one is */
static double largest_of_three(double a, double b, double c)
{
    const double found = a > b ? a : b;
    return a + b + c != a + b + c ? NAN : found > c ? found : c;
}

/* Norm of work->error */
static double weighted_norm(const mstmm_work *work, const double *other)
{
    const int n_q = work->implicit->n_q, n_u = work->implicit->n_u;
    return largest_of_three(rms(work, other, 0, n_q, 0), rms(work, other, n_q, n_q + n_u, 1),
                            rms(work, other, n_q + n_u, work->system->n_state, 0));
}

MSTMM_WIDE static void estimate_error(const mstmm_work *work)
{
    const mstmm_terms terms = mstmm_error_terms(work->tableau, 0);
    for (int64_t i = 0; i < work->row; i += WIDE) {
        wide sum;
        mstmm_add_terms(&terms, work->k + i, work->row, &sum);
        *(wide *)(work->error + i) = work->run->real.h * sum;
    }
}

double mstmm_implicit_norm(const mstmm_work *work, double *absolute)
{
    const int n_q = work->implicit->n_q, n_u = work->implicit->n_u;
    const int n = work->system->n_error < n_q + n_u ? work->system->n_error : n_q + n_u;
    double sum = 0.0; /* of the motion alone: quadratures have units of their own */
    estimate_error(work);
    for (int i = 0; i < n; i++) {
        const double e = work->error[i] * (is_speed(work, i) ? work->run->real.h : 1.0);
        sum += e * e;
    }
    *absolute = n ? sqrt(sum / n) : 0.0;
    return weighted_norm(work, work->y_new);
}

double mstmm_increment_norm(const mstmm_work *work)
{
    const int n_q = work->implicit->n_q, n_u = work->implicit->n_u;
    memcpy(work->error, work->dq, (size_t)n_q * sizeof(double));
    memcpy(work->error + n_q, work->du, (size_t)n_u * sizeof(double));
    for (int64_t i = n_q + n_u; i < work->row; i++) work->error[i] = 0.0;
    return weighted_norm(work, work->y_stage);
}

/* Which of the first n components of work->error is the largest in units of its tolerance */
static int64_t worst_of(const mstmm_work *work, const double *other, int64_t n)
{
    int64_t worst = -1;
    double most = -1.0;
    for (int64_t i = 0; i < n; i++) {
        const double e = is_speed(work, i) ? scaled_speed(work, other, i, work->error[i])
                                           : scaled_plain(work, other, i, work->error[i]);
        if (e > most || e != e) {
            most = e == e ? e : INFINITY;
            worst = i;
        }
    }
    return worst;
}

int64_t mstmm_implicit_worst(const mstmm_work *work)
{
    estimate_error(work);
    return worst_of(work, work->y_new, work->system->n_error);
}

int64_t mstmm_increment_worst(const mstmm_work *work)
{
    return worst_of(work, work->y_stage, work->implicit->n_q + work->implicit->n_u);
}

/* A step over which speeds and accelerations of the start displace by 1 % of the tolerance, were
 * they of the order of the estimate: a guess, which the estimate corrects in a step or two. */
double mstmm_implicit_first_step(const mstmm_work *work, double interval)
{
    const int n_q = work->implicit->n_q, n_u = work->implicit->n_u, n = work->system->n_error;
    const int *coordinates = work->implicit->coordinates;
    double speed = 0.0, acceleration = 0.0;
    for (int i = 0; i < n_q && i < n; i++) {
        const double e = work->k[i] / tolerance(work, work->y, i);
        speed += e * e / n_q;
    }
    for (int i = 0; i < n_u && n_q + i < n; i++) {
        const double e =
            work->k[n_q + i] / tolerance(work, work->y, coordinates ? coordinates[i] : i);
        acceleration += e * e / n_u;
    }
    const double fastest = sqrt(fmax(speed, acceleration)), most = 0.1 * interval;
    if (!(fastest > 0.0)) return most;
    return fmin(most, pow(0.01 / fastest, 1.0 / (work->tableau->error_order + 1)));
}
