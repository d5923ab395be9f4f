/* Dense output of all methods, and quadratures of implicit steps, integrated on it. */
#include <math.h>
#include <string.h>

#include "implicit_step.h"
#include "step.h"

MSTMM_WIDE int mstmm_build_dense(const mstmm_work *work)
{
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

MSTMM_WIDE void mstmm_dense(const mstmm_work *work, double t, double *y)
{
    const int64_t row = work->row;
    const double theta = (t - work->run->real.t) / work->run->real.h;
    if (t == work->run->real.t_new) {
        memcpy(y, work->y_new, (size_t)row * sizeof *y);
        return;
    }
    for (int64_t i = 0; i < row; i += WIDE) {
        wide sum = {0.0};
        for (int j = work->tableau->n_dense - 1; j >= 0; j--)
            sum =
                (j % 2 ? 1.0 - theta : theta) * (sum + *(const wide *)(work->dense + j * row + i));
        *(wide *)(y + i) = *(const wide *)(work->y + i) + sum;
    }
    if (work->tableau->kind == MSTMM_EXPONENTIAL) mstmm_exponential_dense(work, theta, y);
    if (work->implicit)
        (void)mstmm_step_impose(work, t, y); /* who needs what fails here fails by it */
}

MSTMM_WIDE void mstmm_dense_rates(const mstmm_work *work, double t, double *rates)
{
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

/* ---- quadratures ---- */

/* Accelerations at part c of a step of Newmark's family, to a row of its dense output: the slopes
 * of the speeds, so that the work of drives agrees with the change of speeds.  A fixed step may be
 * far too long for a vibration, so that dense output oscillates: there speeds are linear. */
static int take_accelerations(const mstmm_work *work, double c, double t, double *row)
{
    const int n_q = work->implicit->n_q, fixed = work->run->fixed_step > 0.0;
    const double *first = work->k + n_q, *last = first + work->tableau->n_stages * work->row;
    double *a = mstmm_row_a(work, row);
    for (int j = 0; j < work->implicit->n_u; j++) {
        const double change = work->y_new[n_q + j] - work->y[n_q + j];
        const double mean = change / work->run->real.h;
        if (fixed) row[n_q + j] = work->y[n_q + j] + c * change;
        a[j] = fixed ? mean
                     : 6.0 * c * (1.0 - c) * mean + (1.0 - c) * (1.0 - 3.0 * c) * first[j] +
                           c * (3.0 * c - 2.0) * last[j];
    }
    return mstmm_step_impose(work, t, row);
}

/* Rates of the quadratures at a state within the part c of the step */
static int rates_of_quadratures(const mstmm_work *work, double c, double *row, double *to)
{
    const int rest = mstmm_n_rest(work);
    const double t = mstmm_time_in(work->run, c);
    if (work->tableau->kind == MSTMM_ALPHA) {
        const int status = take_accelerations(work, c, t, row);
        return status ? status : mstmm_step_residual(work, t, row, to);
    }
    const int status = mstmm_evaluate(work, t, row, work->y_event);
    memcpy(to, work->y_event + work->system->n_state - rest, (size_t)rest * sizeof *to);
    return status ? status : mstmm_check_finite(work, t, work->y_event);
}

/* The error of quadrature i of the step: the highest difference of its rates, squared against
 * their size, which has the order of the rule where they are smooth and is their size where they
 * are not (R. Piessens and others, QUADPACK, 1983, use the same test).  It is stored where the
 * error estimate reads it; the last stage is known by then. */
static void estimate_quadrature(const mstmm_work *work, int i)
{
    const mstmm_terms terms = mstmm_error_terms(work->tableau, 0);
    const int rest = mstmm_n_rest(work), n = work->tableau->n_inner + 2, last = terms.count - 1;
    double difference = 0.0, size = 0.0;
    if (!work->tableau->n_errors) return;
    for (int l = 0; l < n; l++) {
        const double part = work->tableau->roughness[l] * work->nodes[l * rest + i];
        difference += part;
        size += fabs(part);
    }
    work->k[terms.columns[last] * work->row + work->system->n_state - rest + i] =
        size > 0.0 ? difference * difference / size / terms.weights[last] : 0.0;
}

/* Quadratures over the step, and their dense output: from their rates at its ends, which the slopes
 * hold, and on the dense output of the motion between. */
static int integrate_quadratures(const mstmm_work *work)
{
    const mstmm_tableau *tableau = work->tableau;
    const int rest = mstmm_n_rest(work), first = work->system->n_state - rest;
    const int n = tableau->n_inner + 2;
    const size_t bytes = (size_t)rest * sizeof(double);
    const double h = work->run->real.h;
    memcpy(work->nodes, work->k + first, bytes);
    memcpy(work->nodes + (n - 1) * rest, work->k + tableau->n_stages * work->row + first, bytes);
    for (int l = 1; l < n - 1; l++) {
        const double c = tableau->inner[l - 1];
        mstmm_dense(work, work->run->real.t + c * h, work->y_stage);
        const int status = rates_of_quadratures(work, c, work->y_stage, work->nodes + l * rest);
        if (status) return status;
    }
    for (int i = 0; i < rest; i++) {
        for (int j = 0; j < tableau->n_dense; j++) {
            double sum = 0.0;
            for (int l = 0; l < n; l++)
                sum += tableau->quadrature[l * tableau->n_dense + j] * work->nodes[l * rest + i];
            work->dense[j * work->row + first + i] = h * sum;
        }
        work->y_new[first + i] = work->y[first + i] + work->dense[first + i];
        estimate_quadrature(work, i);
    }
    return mstmm_check_finite(work, work->run->real.t_new, work->y_new);
}

int mstmm_implicit_finish(const mstmm_work *work, int wants_dense)
{
    const mstmm_tableau *tableau = work->tableau;
    const int rest = tableau->kind != MSTMM_DIRK && mstmm_n_rest(work);
    int status = 0;
    if (tableau->kind == MSTMM_ALPHA)
        status = mstmm_step_slope(work, mstmm_time_in(work->run, 1.0), work->y_new,
                                  work->k + tableau->n_stages * work->row);
    if (!status && (rest || wants_dense)) status = mstmm_build_dense(work);
    if (!status && rest) status = integrate_quadratures(work);
    return status;
}
