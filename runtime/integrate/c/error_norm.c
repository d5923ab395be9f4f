/* Error norm of a step, stiffness index, and length of the first step. */
#include <math.h>
#include <stddef.h>

#include "implicit_step.h"
#include "step.h"

/* 1 / (atol + rtol size) of four components, 0 where that would not be a number */
MSTMM_INLINE void component_scales(const mstmm_work *work, int64_t i, const wide *size, wide *scale)
{
    const wide unit = *(const wide *)(work->atol + i) + work->run->rtol * *size, none = {0.0};
    const wide inverse = 1.0 / unit;
    const wide_mask sound = unit > 0.0;
    mstmm_choose(&sound, &inverse, &none, scale);
}

MSTMM_INLINE void larger_components(const wide *a, const wide *b, wide *out)
{
    const wide_mask first = *a > *b;
    mstmm_choose(&first, a, b, out);
}

/* RMS of one error vector, or the combination err5^2 / sqrt(err5^2 + 0.01 err3^2) of two (Hairer,
 * Norsett, Wanner, Solving Ordinary Differential Equations I, II.10), from sums of squares. */
double mstmm_combined_error(double h, double high, double low, int64_t n, int both)
{
    if (high == 0.0) return 0.0;
    if (!both) return h * sqrt(high / (double)n);
    return h * high / sqrt((high + 0.01 * low) * (double)n);
}

#define OF_NOISE 3e-3

/* Factor on scaled errors so that no tolerance asks for less than the noise of the right-hand side:
 * relative ones for `attainable`, absolute ones for OF_NOISE of it. */
static double share_above_noise(const mstmm_work *work)
{
    const double noise = work->system->attainable ? *work->system->attainable : 0.0;
    if (!(noise > 0.0)) return 1.0;
    double least = OF_NOISE * noise;
    for (int64_t i = 0; i < work->system->n_error; i++)
        if (work->atol[i] > 0.0) least = fmin(least, work->atol[i]);
    return fmin(fmin(1.0, work->run->rtol / noise), least / (OF_NOISE * noise));
}

MSTMM_WIDE double mstmm_error_norm(const mstmm_work *work, double *absolute)
{
    const mstmm_tableau *tableau = work->tableau;
    const int64_t n = work->system->n_error, row = work->row;
    if (work->implicit) return mstmm_implicit_norm(work, absolute);
    const int both = tableau->n_errors > 1;
    const mstmm_terms first = mstmm_error_terms(tableau, 0), second = mstmm_error_terms(tableau, 1);
    const wide zero = {0.0};
    wide high = zero, low = zero, high_scaled = zero, low_scaled = zero;
    for (int64_t i = 0; i < n; i += WIDE) {
        wide a, b = zero, old, new, size, scale;
        mstmm_add_terms(&first, work->k + i, row, &a);
        if (both) mstmm_add_terms(&second, work->k + i, row, &b);
        mstmm_keep(n - i, &a);
        mstmm_keep(n - i, &b);
        mstmm_size(work->y + i, &old);
        mstmm_size(work->y_new + i, &new);
        larger_components(&old, &new, &size);
        component_scales(work, i, &size, &scale);
        high += a * a;
        low += b * b;
        high_scaled += (a * scale) * (a * scale);
        low_scaled += (b * scale) * (b * scale);
    }
    const double h = work->run->real.h, share = share_above_noise(work);
    *absolute = n ? mstmm_combined_error(h, mstmm_total(&high), mstmm_total(&low), n, both) : 0.0;
    return n ? share * mstmm_combined_error(h, mstmm_total(&high_scaled), mstmm_total(&low_scaled),
                                            n, both)
             : 0.0;
}

int64_t mstmm_worst_component(const mstmm_work *work)
{
    const mstmm_terms terms = mstmm_error_terms(work->tableau, 0);
    int64_t worst = -1;
    if (work->implicit) return mstmm_implicit_worst(work);
    double largest = -1.0;
    for (int64_t i = 0; i < work->system->n_error; i++) {
        double e = 0.0;
        for (int j = 0; j < terms.count; j++)
            e += terms.weights[j] * work->k[terms.columns[j] * work->row + i];
        e = fabs(e) /
            (work->atol[i] + work->run->rtol * fmax(fabs(work->y[i]), fabs(work->y_new[i])));
        if (e > largest || e != e) {
            largest = e == e ? e : INFINITY;
            worst = i;
        }
    }
    return worst;
}

/* h |f(t_new, y_new) - k_(s-1)| / |y_new - Y_(s-1)|: both stages lie at the step's end, so the
 * quotient follows the Jacobian alone (Hairer, Wanner, Solving ODE II, section IV.2).  Components
 * are measured by their own size (y^2 + h^2 f^2)^(1/2), or metres beside metres per second would
 * make an oscillation of frequency w look as fast as w^2.  0 where the last stage does not lie at
 * the end or the difference is rounding. */
MSTMM_WIDE double mstmm_stiffness(const mstmm_work *work)
{
    const int s = work->tableau->n_stages;
    const int64_t n = work->system->n_error;
    const double h = work->run->real.h, tiny = 1e-300;
    const double *k_end = work->k + s * work->row, *k_last = k_end - work->row;
    wide top = {0.0}, bottom = {0.0};
    if (s < 2 || work->tableau->c[s - 1] != 1.0) return 0.0;
    for (int64_t i = 0; i < n; i += WIDE) {
        const wide y = *(const wide *)(work->y_new + i), a = *(const wide *)(work->atol + i);
        const wide f = h * *(const wide *)(k_end + i);
        wide df = f - h * *(const wide *)(k_last + i);
        wide dy = y - *(const wide *)(work->y_stage + i);
        const wide unit = 1.0 / (y * y + f * f + a * a + tiny);
        mstmm_keep(n - i, &df);
        mstmm_keep(n - i, &dy);
        top += df * df * unit;
        bottom += dy * dy * unit;
    }
    const double above = mstmm_total(&top), below = mstmm_total(&bottom);
    return below > 1e-26 ? sqrt(above / below) : 0.0;
}

static double scaled_norm(const mstmm_slopes *at, const double *x, const double *minus)
{
    double sum = 0.0;
    for (int64_t i = 0; i < at->n; i++) {
        const int64_t j = i * at->stride;
        const double unit = at->atol[i] + at->rtol * fabs(at->y[j]);
        const double e = (x[j] - (minus ? minus[j] : 0.0)) / unit;
        sum += e * e;
    }
    return at->n ? sqrt(sum / (double)at->n) : 0.0;
}

/* Hairer, Norsett, Wanner I, II.4: a step over which an explicit Euler step errs by 1 % of the
 * tolerance. */
double mstmm_guess_step(const mstmm_slopes *at)
{
    const double d0 = scaled_norm(at, at->y, NULL), d1 = scaled_norm(at, at->k, NULL);
    return fmin(d0 < 1e-5 || d1 < 1e-5 ? 1e-6 : 0.01 * d0 / d1, at->interval);
}

double mstmm_step_from(const mstmm_slopes *at, double guess, const double *f1, int error_order)
{
    const double d1 = scaled_norm(at, at->k, NULL), d2 = scaled_norm(at, f1, at->k) / guess;
    const double largest = fmax(d1, d2), power = 1.0 / (error_order + 1);
    const double h1 = largest <= 1e-15 ? fmax(1e-6, 1e-3 * guess) : pow(0.01 / largest, power);
    return fmin(fmin(100.0 * guess, h1), at->interval);
}

/* A failing trial evaluation only makes the step cautious. */
double mstmm_initial_step(const mstmm_work *work, double interval)
{
    const int64_t n = work->system->n_state;
    if (work->implicit) return mstmm_implicit_first_step(work, interval);
    const mstmm_slopes at = {.n = work->system->n_error,
                             .stride = 1,
                             .y = work->y,
                             .k = work->k,
                             .atol = work->atol,
                             .rtol = work->run->rtol,
                             .interval = interval};
    const double h0 = mstmm_guess_step(&at), end = work->run->real.t + interval;
    const double t = fmin(work->run->real.t + h0, nextafter(end, -INFINITY));
    double *f1 = work->k + work->row;
    for (int64_t i = 0; i < n; i++) work->y_stage[i] = work->y[i] + h0 * work->k[i];
    if (!mstmm_all_finite(n, work->y_stage) || mstmm_evaluate(work, t, work->y_stage, f1) ||
        !mstmm_all_finite(n, f1))
        return 1e-3 * h0;
    return mstmm_step_from(&at, h0, f1, work->tableau->error_order);
}
