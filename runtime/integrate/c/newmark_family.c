/* Newmark's family: one acceleration per step is unknown, coordinates and speeds at its end are
 * linear in it.  Generalised alpha, HHT and Newmark, Wilson's collocation, Houbolt's differences.
 *
 * Over a step the coordinates move along q' = N(q) theta, theta constant, so that rotations need no
 * chart (O. Brüls, A. Cardona, M. Arnold, Mechanism and Machine Theory 48 (2012) 121-137).
 * The state and its accelerations are followed by auxiliary accelerations (M. Arnold, O. Brüls,
 * Multibody System Dynamics 18 (2007) 185-202), or the last two theta for Houbolt's differences. */
#include <math.h>
#include <string.h>

#include "implicit_step.h"

/* work->flow := q after time 1 along q' = N(q) theta from `from`, by the classical
 * Runge-Kutta method: exact but for rotations, and there beyond what the family resolves. */
static int flow_coordinates(const mstmm_work *work, double t, const double *from,
                            const double *theta, double *to)
{
    static const double nodes[] = {0.0, 0.5, 0.5, 1.0}, weights[] = {1.0, 2.0, 2.0, 1.0};
    const int n = work->implicit->n_q;
    double *q = work->flow, *rate = q + n, *sum = rate + n;
    if (!work->implicit->rates) {
        for (int i = 0; i < n; i++) to[i] = from[i] + theta[i];
        return 0;
    }
    for (int i = 0; i < n; i++) rate[i] = sum[i] = 0.0;
    for (int j = 0; j < 4; j++) {
        for (int i = 0; i < n; i++) q[i] = from[i] + nodes[j] * rate[i];
        const int status = mstmm_step_rates(work, t, q, theta, rate);
        if (status) return status;
        for (int i = 0; i < n; i++) sum[i] += weights[j] * rate[i];
    }
    for (int i = 0; i < n; i++) to[i] = from[i] + sum[i] / 6.0;
    return 0;
}

/* y_stage from the acceleration in it */
static int newmark_place(const mstmm_work *work, const mstmm_newton_equations *stage)
{
    const int n_q = work->implicit->n_q, n_u = work->implicit->n_u;
    double *y = work->y_stage, *a = mstmm_row_a(work, y), *theta = work->rho_u;
    for (int i = 0; i < n_u; i++) {
        theta[i] = work->map_q[i] + stage->cq * a[i];
        y[n_q + i] = work->map_u[i] + stage->cu * a[i];
    }
    const int status = flow_coordinates(work, stage->t, work->y, theta, y);
    return status ? status : mstmm_step_impose(work, stage->t, y);
}

static int newmark_move(const mstmm_work *work, const mstmm_newton_equations *stage)
{
    double *a = mstmm_row_a(work, work->y_stage);
    for (int i = 0; i < work->implicit->n_u; i++) a[i] += work->da[i];
    return newmark_place(work, stage);
}

/* ---- formulas in terms of the acceleration at the stage ---- */

/* Auxiliary acceleration i at the step's start: its time differs from that of the state and moves
 * when the step changes; without that correction the order is lost. */
static double auxiliary(const mstmm_work *work, int i)
{
    const double now = work->k[work->implicit->n_q + i], before = work->run->real.h_previous;
    const double kept = mstmm_row_behind(work, work->y)[i];
    return before > 0.0 && !work->tableau->backward
               ? now + (kept - now) * (work->run->real.h / before)
               : now;
}

/* Constants of a step */
typedef struct constants {
    double alpha_m, alpha_f, beta, gamma, part; /* part of an acceleration in the auxiliary one */
} constants;

/* Delay of auxiliary accelerations in a smooth motion, in steps. */
static double auxiliary_delay(const mstmm_tableau *t) { return t->alpha_f - t->alpha_m; }

/* A step with rows of accelerations from a start at which only the motion is known assumes a
 * smooth motion: its auxiliary accelerations at start and end have the same delay, which needs
 * none of them and keeps the order. */
static int has_smooth_start(const mstmm_work *work)
{
    return work->implicit->placing && !mstmm_step_places(work) && work->run->real.h_previous == 0.0;
}

static constants constants_of(const mstmm_work *work)
{
    const mstmm_tableau *t = work->tableau;
    if (has_smooth_start(work))
        return (constants){.beta = t->beta_n - 0.5 * auxiliary_delay(t),
                           .gamma = t->gamma_n - auxiliary_delay(t),
                           .part = 1.0};
    return (constants){.alpha_m = t->alpha_m,
                       .alpha_f = t->alpha_f,
                       .beta = t->beta_n,
                       .gamma = t->gamma_n,
                       .part = (1.0 - t->alpha_f) / (1.0 - t->alpha_m)};
}

/* Part of the auxiliary acceleration at the end that is known */
static double known_part(const mstmm_work *work, const constants *by, int i)
{
    const double now = work->k[work->implicit->n_q + i];
    return (by->alpha_f * now - by->alpha_m * auxiliary(work, i)) / (1.0 - by->alpha_m);
}

/* Newmark's formulas over the time `h` */
static void map_alpha(const mstmm_work *work, mstmm_newton_equations *stage, double h)
{
    const constants by = constants_of(work);
    const double *u = work->y + work->implicit->n_q;
    for (int i = 0; i < work->implicit->n_u; i++) {
        const double a = auxiliary(work, i), rest = known_part(work, &by, i);
        work->map_q[i] = h * u[i] + h * h * ((0.5 - by.beta) * a + by.beta * rest);
        work->map_u[i] = u[i] + h * ((1.0 - by.gamma) * a + by.gamma * rest);
    }
    stage->cq = h * h * by.beta * by.part;
    stage->cu = h * by.gamma * by.part;
}

/* Houbolt's differences, in increments of the last two steps */
static void map_backward(const mstmm_work *work, mstmm_newton_equations *stage, double h)
{
    const int n_u = work->implicit->n_u;
    const double *last = mstmm_row_behind(work, work->y), *before = last + n_u;
    for (int i = 0; i < n_u; i++) {
        work->map_q[i] = 1.5 * last[i] - 0.5 * before[i];
        work->map_u[i] = (11.0 * work->map_q[i] - 7.0 * last[i] + 2.0 * before[i]) / (6.0 * h);
    }
    stage->cq = 0.5 * h * h;
    stage->cu = 11.0 / 12.0 * h;
}

/* ---- the step ---- */

/* True if increments of two steps of this length exist. */
static int has_history(const mstmm_work *work)
{
    const mstmm_run *run = work->run;
    return work->tableau->backward && run->count.history == 2 &&
           fabs(run->real.h - run->real.h_previous) <= MSTMM_SAME_STEP * run->real.h;
}

/* Linear acceleration up to the collocation point: back to the step's end */
static int return_from_collocation(const mstmm_work *work, mstmm_newton_equations *stage)
{
    const mstmm_tableau *tableau = work->tableau;
    const int n_q = work->implicit->n_q;
    double *a = mstmm_row_a(work, work->y_stage);
    for (int i = 0; i < work->implicit->n_u; i++)
        a[i] = work->k[n_q + i] + (a[i] - work->k[n_q + i]) / tableau->collocation;
    stage->t = mstmm_time_in(work->run, 1.0);
    map_alpha(work, stage, work->run->real.h);
    return newmark_place(work, stage);
}

/* Data for the next step, after the state in y_new. */
static void store_history(const mstmm_work *work, const mstmm_newton_equations *stage)
{
    const mstmm_tableau *t = work->tableau;
    const int n_u = work->implicit->n_u, smooth = has_smooth_start(work);
    const constants by = constants_of(work);
    const double *a = mstmm_row_a(work, work->y_new), *first = work->k + work->implicit->n_q;
    double *behind = mstmm_row_behind(work, work->y_new);
    if (t->backward) memcpy(behind + n_u, mstmm_row_behind(work, work->y), (size_t)n_u * sizeof *a);
    for (int i = 0; i < n_u; i++)
        behind[i] = t->backward ? work->map_q[i] + stage->cq * a[i]
                    : smooth    ? a[i] - auxiliary_delay(t) * (a[i] - first[i])
                                : known_part(work, &by, i) + by.part * a[i];
}

/* The step as a whole in k_1, its error in k_2 (O. C. Zienkiewicz, Y. M. Xie, Earthquake
 * Engineering and Structural Dynamics 20 (1991) 871-887) */
static int fill_rows(const mstmm_work *work, double t)
{
    const int n_u = work->implicit->n_u;
    const double h = work->run->real.h, part = work->tableau->error_constant * h;
    const double *behind = mstmm_row_behind(work, work->y_new);
    double *whole = work->k + work->row, *error = whole + work->row;
    for (int64_t i = 0; i < work->row; i++) whole[i] = (work->y_new[i] - work->y[i]) / h;
    memset(error, 0, (size_t)work->row * sizeof(double));
    if (!work->tableau->n_errors) return 0;
    for (int i = 0; i < n_u; i++) work->rho_u[i] = part * (behind[i] - auxiliary(work, i));
    return mstmm_step_rates(work, t, work->y_new, work->rho_u, error);
}

/* A step with rows of accelerations starts with accelerations that satisfy them, because loops
 * were closed after the previous step.  A step with rows of positions must do so as well: the
 * error of its accelerations, velocity errors over its length, may grow in steps of other
 * lengths. */
static int obey_rows(const mstmm_work *work)
{
    double *a = mstmm_row_a(work, work->y), *behind = mstmm_row_behind(work, work->y);
    const int status = mstmm_step_residual(work, mstmm_time_in(work->run, 0.0), work->y, NULL);
    if (status) return status;
    for (int i = 0; i < work->implicit->n_u; i++) {
        a[i] -= work->residual[i];
        behind[i] -= work->residual[i];
        work->k[work->implicit->n_q + i] = a[i];
    }
    if (work->run->count.by_positions) work->run->real.h_previous = 0.0;
    return 0;
}

static int wants_rows_obeyed(const mstmm_work *work)
{
    return work->implicit->placing && !mstmm_step_places(work) && work->run->real.h_previous > 0.0;
}

int mstmm_alpha_stages(const mstmm_work *work)
{
    const mstmm_tableau *tableau = work->tableau;
    const int n_q = work->implicit->n_q, n_u = work->implicit->n_u;
    const double h = work->run->real.h, collocation = tableau->collocation;
    mstmm_newton_equations stage = {
        .t = mstmm_time_in(work->run, collocation), .kappa = 0, .move = newmark_move};
    int status = wants_rows_obeyed(work) ? obey_rows(work) : 0;
    if (status) return status;
    if (has_history(work))
        map_backward(work, &stage, h);
    else
        map_alpha(work, &stage, collocation * h);
    stage.s = 1.0 / stage.cu;
    stage.sq = stage.cu / stage.cq;
    memcpy(work->y_stage, work->y, (size_t)work->row * sizeof(double));
    memcpy(mstmm_row_a(work, work->y_stage), work->k + n_q, (size_t)n_u * sizeof(double));
    status = newmark_place(work, &stage);
    if (!status) status = mstmm_newton_stage(work, &stage);
    if (!status && collocation != 1.0) status = return_from_collocation(work, &stage);
    if (status) return status;
    memcpy(work->y_new, work->y_stage, (size_t)work->row * sizeof(double));
    store_history(work, &stage);
    status = fill_rows(work, stage.t);
    return status ? status : mstmm_check_new(work);
}
