/* Arithmetic of steps in SIMD lanes: stages, errors, dense output. */
#include <math.h>
#include <string.h>

#include "lanes_step.h"

/* First component of a lane that is not finite, -1 if all are */
int64_t mstmm_lane_not_finite(const mstmm_cut_group *c, const double *x, int lane)
{
    for (int64_t i = 0; i < c->n; i++)
        if (!isfinite(x[i * c->lanes + lane])) return i;
    return -1;
}

/* out = y + h sum_j w_j k_j */
MSTMM_INLINE void combine(const mstmm_cut_group *c, mstmm_terms terms, const double *h, double *out)
{
    for (int64_t i = 0; i < c->row; i += WIDE) {
        wide sum;
        mstmm_add_terms(&terms, c->k + i, c->row, &sum);
        *(wide *)(out + i) = *(const wide *)(c->y + i) + *(const wide *)(h + i % GROUP) * sum;
    }
}

/* The right-hand side of all lanes.  A failure ends the attempt of its own lane only. */
void mstmm_lanes_evaluate(const mstmm_cut_group *c, mstmm_attempt *a, const double *y, double *dy)
{
    int codes[GROUP] = {0};
    const int any = c->system->rhs_lanes(c->system->context, a->t, y, dy, codes);
    for (int lane = 0; lane < c->lanes; lane++) {
        mstmm_run *run = &c->group->runs[lane];
        if (!a->active[lane] || a->failed[lane]) continue;
        run->count.evaluations++;
        if (any && codes[lane])
            a->failed[lane] = mstmm_note(run, MSTMM_RHS_FAILED, codes[lane], -1, a->t[lane]);
    }
}

/* Fails the lanes in which something is not finite; cheap where everything is. */
void mstmm_lanes_check(const mstmm_cut_group *c, mstmm_attempt *a, const double *x)
{
    if (mstmm_all_finite(c->row, x)) return;
    for (int lane = 0; lane < c->lanes; lane++) {
        const int64_t bad = mstmm_lane_not_finite(c, x, lane);
        if (bad >= 0 && a->active[lane] && !a->failed[lane])
            a->failed[lane] =
                mstmm_note(&c->group->runs[lane], MSTMM_NOT_FINITE, 0, bad, a->t[lane]);
    }
}

MSTMM_INLINE void stage_times(const mstmm_cut_group *c, mstmm_attempt *a, double node)
{
    if (!a->meets_break) {
        for (int i = 0; i < GROUP; i++)
            a->t[i] = node == 1.0 ? a->end[i] : a->start[i] + node * a->h[i];
        return;
    }
    for (int lane = 0; lane < c->lanes; lane++)
        a->t[lane] = mstmm_time_in(&c->group->runs[lane], node);
}

MSTMM_WIDE void mstmm_lanes_stages(const mstmm_cut_group *c, mstmm_attempt *a)
{
    const mstmm_tableau *tableau = c->tableau;
    double *last = c->k + tableau->n_stages * c->row;
    for (int i = 1; i < tableau->n_stages; i++) {
        combine(c, mstmm_stage_terms(tableau, i), a->h, c->y_stage);
        stage_times(c, a, tableau->c[i]);
        mstmm_lanes_evaluate(c, a, c->y_stage, c->k + i * c->row);
    }
    combine(c, mstmm_step_terms(tableau), a->h, c->y_new);
    stage_times(c, a, 1.0);
    mstmm_lanes_check(c, a, c->y_new);
    mstmm_lanes_evaluate(c, a, c->y_new, last);
    mstmm_lanes_check(c, a, last);
}

/* Scaled error of every lane. */
MSTMM_WIDE void mstmm_lanes_errors(const mstmm_cut_group *c, mstmm_attempt *a)
{
    const mstmm_tableau *tableau = c->tableau;
    const mstmm_run *problem = &c->group->many->problem;
    const int both = tableau->n_errors > 1, n = c->system->n_error;
    const mstmm_terms first = mstmm_error_terms(tableau, 0), second = mstmm_error_terms(tableau, 1);
    wide high[GROUP / WIDE] = {{0.0}}, low[GROUP / WIDE] = {{0.0}};
    if (!tableau->n_errors || !problem->atol) return;
    for (int64_t i = 0; i < (int64_t)n * c->lanes; i += WIDE) {
        wide e, e_low = {0.0}, old, new;
        mstmm_add_terms(&first, c->k + i, c->row, &e);
        if (both) mstmm_add_terms(&second, c->k + i, c->row, &e_low);
        mstmm_size(c->y + i, &old);
        mstmm_size(c->y_new + i, &new);
        const wide_mask older = old > new;
        mstmm_choose(&older, &old, &new, &new);
        const wide scale = 1.0 / (*(const wide *)(c->atol + i) + problem->rtol * new);
        high[i % GROUP / WIDE] += (e * scale) * (e * scale);
        low[i % GROUP / WIDE] += (e_low * scale) * (e_low * scale);
    }
    for (int lane = 0; lane < c->lanes; lane++) {
        double sum = 0.0, sum_low = 0.0;
        for (int j = lane; j < GROUP; j += c->lanes) {
            sum += high[j / WIDE][j % WIDE];
            sum_low += low[j / WIDE][j % WIDE];
        }
        a->error[lane] = mstmm_combined_error(c->group->runs[lane].real.h, sum, sum_low, n, both);
    }
}

int64_t mstmm_lanes_worst(const mstmm_cut_group *c, int lane)
{
    const mstmm_terms terms = mstmm_error_terms(c->tableau, 0);
    const mstmm_run *run = &c->group->runs[lane];
    int64_t worst = -1;
    double largest = -1.0;
    for (int64_t i = 0; i < c->system->n_error; i++) {
        const int64_t at = i * c->lanes + lane;
        double e = 0.0;
        for (int j = 0; j < terms.count; j++)
            e += terms.weights[j] * c->k[terms.columns[j] * c->row + at];
        e = fabs(e) / (run->atol[i] + run->rtol * fmax(fabs(c->y[at]), fabs(c->y_new[at])));
        if (e > largest || e != e) {
            largest = e == e ? e : INFINITY;
            worst = i;
        }
    }
    return worst;
}

MSTMM_WIDE void mstmm_lanes_dense(const mstmm_cut_group *c, mstmm_attempt *a)
{
    const mstmm_tableau *tableau = c->tableau;
    mstmm_attempt extra = *a;
    memcpy(extra.active, a->wants_dense, sizeof extra.active);
    for (int i = 0; i < tableau->n_extra; i++) {
        double *k = c->k + (tableau->n_stages + 1 + i) * c->row;
        combine(c, mstmm_extra_terms(tableau, i), a->h, c->y_stage);
        stage_times(c, &extra, tableau->c_extra[i]);
        mstmm_lanes_evaluate(c, &extra, c->y_stage, k);
        mstmm_lanes_check(c, &extra, k);
    }
    for (int lane = 0; lane < c->lanes; lane++)
        if (a->wants_dense[lane]) a->failed[lane] = extra.failed[lane];
    for (int j = 0; j < tableau->n_dense; j++) {
        const mstmm_terms terms = mstmm_dense_terms(tableau, j);
        for (int64_t i = 0; i < c->row; i += WIDE) {
            wide sum;
            mstmm_add_terms(&terms, c->k + i, c->row, &sum);
            *(wide *)(c->dense + j * c->row + i) = *(const wide *)(a->h + i % GROUP) * sum;
        }
    }
}

MSTMM_WIDE void mstmm_lanes_move(const mstmm_cut_group *c, const int *moved, const int *kept_stage)
{
    const double *last = c->k + c->tableau->n_stages * c->row;
    int64_t to_new[GROUP], to_last[GROUP];
    for (int i = 0; i < GROUP; i++) {
        to_new[i] = moved[i % c->lanes] ? -1 : 0;
        to_last[i] = kept_stage[i % c->lanes] ? -1 : 0;
    }
    for (int64_t i = 0; i < c->row; i += WIDE) {
        const int64_t place = i % GROUP;
        mstmm_choose((const wide_mask *)(to_new + place), (const wide *)(c->y_new + i),
                     (const wide *)(c->y + i), (wide *)(c->y + i));
        mstmm_choose((const wide_mask *)(to_last + place), (const wide *)(last + i),
                     (const wide *)(c->k + i), (wide *)(c->k + i));
    }
}
