/* Steps of several trajectories in SIMD lanes; see lanes.h.  Component i of a lane is at
 * [i * lanes + lane], so that all arithmetic but that of step control goes over whole vectors. */
#include <math.h>
#include <string.h>

#include "lanes_step.h"

static int64_t lanes_row(const mstmm_system *system)
{
    return ((int64_t)system->n_state * system->lanes + GROUP - 1) / GROUP * GROUP;
}

int64_t mstmm_group_size(const mstmm_system *system, const mstmm_tableau *tableau)
{
    const int sound = tableau->kind == MSTMM_EXPLICIT && system->lanes > 0 && system->n_state > 0 &&
                      !mstmm_n_watched(system) && !system->n_memory &&
                      mstmm_workspace_size(system, tableau) > 0;
    const int64_t rows = tableau->n_stages + 1 + tableau->n_extra + tableau->n_dense + 4;
    return sound ? rows * lanes_row(system) + system->n_state + GROUP : 0;
}

static mstmm_cut_group cut_group(mstmm_group *group)
{
    const mstmm_system *system = group->system;
    const mstmm_tableau *tableau = group->many->problem.tableau;
    const uintptr_t rest = (uintptr_t)group->workspace % 64;
    double *at = group->workspace + (rest ? (64 - rest) / sizeof(double) : 0);
    mstmm_cut_group c = {.group = group,
                         .system = system,
                         .tableau = tableau,
                         .lanes = system->lanes,
                         .n = system->n_state,
                         .row = lanes_row(system)};
    c.y = at;
    c.k = c.y + c.row;
    c.y_new = c.k + (tableau->n_stages + 1 + tableau->n_extra) * c.row;
    c.y_stage = c.y_new + c.row;
    c.dense = c.y_stage + c.row;
    c.atol = c.dense + tableau->n_dense * c.row;
    c.one = c.atol + c.row;
    return c;
}

/* ---- one lane ---- */

static void gather(const mstmm_cut_group *c, const double *from, int lane, double *to)
{
    for (int64_t i = 0; i < c->n; i++) to[i] = from[i * c->lanes + lane];
}

static void scatter(const mstmm_cut_group *c, const double *from, int lane, double *to)
{
    for (int64_t i = 0; i < c->n; i++) to[i * c->lanes + lane] = from[i];
}

static void finish(const mstmm_cut_group *c, int lane, int status)
{
    mstmm_group *group = c->group;
    const mstmm_run *run = &group->runs[lane];
    const int64_t trajectory = group->trajectory[lane];
    mstmm_outcome *out = &group->many->outcomes[trajectory];
    *out = (mstmm_outcome){.status = status,
                           .code = run->count.code,
                           .component = run->count.component,
                           .steps = run->count.steps,
                           .rejected = run->count.rejected,
                           .evaluations = run->count.evaluations,
                           .t = run->real.t,
                           .fail_time = run->real.fail_time};
    gather(c, c->y, lane, group->many->last + trajectory * c->n);
    group->trajectory[lane] = -1;
}

static double *sample(const mstmm_cut_group *c, int lane)
{
    const mstmm_many *many = c->group->many;
    const int64_t first = c->group->trajectory[lane] * many->problem.n_outputs;
    return many->samples + (first + c->group->runs[lane].count.output_index) * c->n;
}

static void sample_lane(const mstmm_cut_group *c, int lane)
{
    mstmm_run *run = &c->group->runs[lane];
    int64_t *i = &run->count.output_index;
    for (; *i < run->n_outputs && run->outputs[*i] <= run->real.t; (*i)++)
        gather(c, c->y, lane, sample(c, lane));
}

/* Puts the lane at the start of the next trajectory; 0 if there is none. */
static int start_next_trajectory(const mstmm_cut_group *c, int lane)
{
    mstmm_group *group = c->group;
    mstmm_many *many = group->many;
    mstmm_run *run = &group->runs[lane];
    const int64_t next = __atomic_fetch_add(&many->next, 1, __ATOMIC_RELAXED);
    if (next >= many->n) return 0;
    *run = many->problem;
    memset(&run->real, 0, sizeof run->real);
    memset(&run->count, 0, sizeof run->count);
    run->count.component = run->count.chatter = -1;
    run->real.t = run->t_start;
    run->real.smallest_step = INFINITY;
    mstmm_pass_breaks(run);
    group->trajectory[lane] = next;
    group->retries[lane] = 0;
    scatter(c, many->y0 + next * c->n, lane, c->y);
    if (group->enter) group->enter(c->system->context, lane, next);
    const int64_t bad = mstmm_lane_not_finite(c, c->y, lane);
    if (bad >= 0)
        finish(c, lane, mstmm_note(run, MSTMM_NOT_FINITE, 0, bad, run->t_start));
    else
        sample_lane(c, lane);
    return 1;
}

/* Idle lanes that never had a trajectory compute what the first one computes. */
static int refill(const mstmm_cut_group *c)
{
    mstmm_group *group = c->group;
    const int64_t before = __atomic_load_n(&group->many->next, __ATOMIC_RELAXED);
    int active = -1;
    for (int lane = 0; lane < c->lanes; lane++) {
        while (group->trajectory[lane] < 0 && start_next_trajectory(c, lane)) {
        }
        if (group->trajectory[lane] >= 0 && active < 0) active = lane;
    }
    for (int lane = 0; lane < c->lanes && active >= 0 && before < group->many->n; lane++) {
        if (group->trajectory[lane] >= 0 || group->runs[lane].tableau) continue;
        gather(c, c->y, active, c->one);
        scatter(c, c->one, lane, c->y);
        group->runs[lane].real.t = group->runs[lane].real.t_new = group->many->problem.t_start;
        if (group->enter) group->enter(c->system->context, lane, group->trajectory[active]);
    }
    return active >= 0;
}

static mstmm_slopes slopes(const mstmm_cut_group *c, int lane)
{
    const mstmm_run *run = &c->group->runs[lane];
    return (mstmm_slopes){.n = c->system->n_error,
                          .stride = c->lanes,
                          .y = c->y + lane,
                          .k = c->k + lane,
                          .atol = run->atol,
                          .rtol = run->rtol,
                          .interval = mstmm_interval(run)};
}

/* First step of the lanes in `fresh`, from an explicit Euler step. */
static void choose_first_steps(const mstmm_cut_group *c, const int *fresh)
{
    double *f1 = c->k + c->row;
    mstmm_attempt a = {.h = {0.0}};
    double guess[GROUP] = {0.0};
    for (int lane = 0; lane < c->lanes; lane++) {
        const mstmm_run *run = &c->group->runs[lane];
        const mstmm_slopes at = fresh[lane] ? slopes(c, lane) : (mstmm_slopes){.n = 0};
        const double end = run->real.t + at.interval;
        a.active[lane] = fresh[lane];
        guess[lane] = fresh[lane] ? mstmm_guess_step(&at) : 0.0;
        a.t[lane] =
            fresh[lane] ? fmin(run->real.t + guess[lane], nextafter(end, -INFINITY)) : run->real.t;
    }
    for (int64_t i = 0; i < c->n * c->lanes; i++)
        c->y_stage[i] = c->y[i] + guess[i % c->lanes] * c->k[i];
    mstmm_lanes_evaluate(c, &a, c->y_stage, f1);
    mstmm_lanes_check(c, &a, f1);
    for (int lane = 0; lane < c->lanes; lane++) {
        if (!fresh[lane]) continue;
        const mstmm_slopes at = slopes(c, lane);
        c->group->runs[lane].real.h_next =
            a.failed[lane] ? 1e-3 * guess[lane]
                           : mstmm_step_from(&at, guess[lane], f1 + lane, c->tableau->error_order);
    }
}

/* First stages that are not known yet; lanes where there is none end. */
static void first_stages(const mstmm_cut_group *c)
{
    mstmm_group *group = c->group;
    int missing[GROUP] = {0}, fresh[GROUP] = {0}, any = 0, any_fresh = 0;
    mstmm_attempt a = {.h = {0.0}};
    for (int lane = 0; lane < c->lanes; lane++) {
        const mstmm_run *run = &group->runs[lane];
        missing[lane] = group->trajectory[lane] >= 0 && !run->count.first_stage_valid;
        a.active[lane] = missing[lane];
        a.t[lane] = run->count.at_break ? nextafter(run->real.t, INFINITY) : run->real.t;
        any |= missing[lane];
    }
    if (!any) return;
    double *slope = c->k + c->row;
    mstmm_lanes_evaluate(c, &a, c->y, slope);
    mstmm_lanes_check(c, &a, slope);
    for (int lane = 0; lane < c->lanes; lane++) {
        mstmm_run *run = &group->runs[lane];
        if (!missing[lane]) continue;
        gather(c, slope, lane, c->one);
        scatter(c, c->one, lane, c->k);
        run->count.first_stage_valid = 1;
        if (a.failed[lane]) {
            finish(c, lane, a.failed[lane]);
        } else if (run->fixed_step == 0.0 && run->real.h_next == 0.0) {
            run->real.h_next = run->first_step;
            fresh[lane] = run->first_step == 0.0;
        }
        any_fresh |= fresh[lane];
    }
    if (any_fresh) choose_first_steps(c, fresh);
}

/* Where every lane's trial step ends; lanes that may not make one end. */
static int aim(const mstmm_cut_group *c, mstmm_attempt *a)
{
    mstmm_group *group = c->group;
    int any = 0;
    for (int lane = 0; lane < c->lanes; lane++) {
        mstmm_run *run = &group->runs[lane];
        run->real.h = 0.0;
        if (group->trajectory[lane] < 0) continue;
        if (!group->retries[lane]) run->count.rejected_last = 0;
        const int ended = group->retries[lane] ? 0 : mstmm_no_further(run);
        if (ended) {
            finish(c, lane, ended);
            continue;
        }
        a->failed[lane] = mstmm_aim(run);
        a->active[lane] = 1;
        any = 1;
    }
    for (int i = 0; i < GROUP; i++) {
        const mstmm_run *run = &group->runs[i % c->lanes];
        a->h[i] = run->real.h;
        a->start[i] = run->real.t;
        a->end[i] = run->real.t_new;
        a->meets_break |= run->count.at_break || run->count.lands_on_break;
    }
    return any;
}

/* True if the error of an active lane is small enough. */
static int is_lane_accepted(const mstmm_cut_group *c, const mstmm_attempt *a, int lane)
{
    return a->active[lane] && !a->failed[lane] &&
           (c->group->runs[lane].fixed_step > 0.0 || a->error[lane] < 1.0 ||
            mstmm_in_gap(&c->group->runs[lane]));
}

/* Samples between the ends of an accepted step. */
static void sample_inside(const mstmm_cut_group *c, int lane)
{
    mstmm_run *run = &c->group->runs[lane];
    while (mstmm_output_inside(run)) {
        const double theta = (run->outputs[run->count.output_index] - run->real.t) / run->real.h;
        double *out = sample(c, lane);
        for (int64_t i = 0; i < c->n; i++) {
            const int64_t at = i * c->lanes + lane;
            double sum = 0.0;
            for (int j = c->tableau->n_dense - 1; j >= 0; j--)
                sum = (j % 2 ? 1.0 - theta : theta) * (sum + c->dense[j * c->row + at]);
            out[i] = c->y[at] + sum;
        }
        run->count.output_index++;
    }
}

/* Calls accept on the lane's new state.  1 if the first stage is to be forgotten, a failure, 0. */
static int settle_lane_state(const mstmm_cut_group *c, int lane)
{
    mstmm_run *run = &c->group->runs[lane];
    if (!c->system->accept) return 0;
    gather(c, c->y_new, lane, c->one);
    const int code = c->system->accept(c->system->context, run->real.t_new, c->one);
    if (code > 0) return mstmm_note(run, MSTMM_ACCEPT_FAILED, code, -1, run->real.t_new);
    scatter(c, c->one, lane, c->y_new);
    if (c->group->accepted) c->group->accepted(c->system->context, lane);
    return code ? 1 : 0;
}

/* The lane's state becomes the end of the step.  Returns 1 if the last stage serves the next. */
static int accept_lane(const mstmm_cut_group *c, mstmm_attempt *a, int lane)
{
    mstmm_run *run = &c->group->runs[lane];
    if (run->fixed_step == 0.0) mstmm_propose(run, a->error[lane]);
    mstmm_count_step(run, a->error[lane], 0.0);
    c->group->retries[lane] = 0;
    sample_inside(c, lane);
    const int status = settle_lane_state(c, lane);
    if (status < 0) {
        finish(c, lane, status);
        a->failed[lane] = status;
        return 0;
    }
    run->real.t = run->real.t_new;
    if (run->count.lands_on_grid) run->count.grid_index++;
    mstmm_pass_breaks(run);
    run->count.first_stage_valid = status == 0 && !run->count.at_break;
    return (int)run->count.first_stage_valid;
}

/* Accepts or rejects the attempt of each lane. */
static void finish_attempts(const mstmm_cut_group *c, mstmm_attempt *a)
{
    mstmm_group *group = c->group;
    int moved[GROUP] = {0}, kept_stage[GROUP] = {0}, any_dense = 0;
    for (int lane = 0; lane < c->lanes; lane++) {
        mstmm_run *run = &group->runs[lane];
        if (a->active[lane] && !a->failed[lane] && !isfinite(a->error[lane]))
            a->failed[lane] =
                mstmm_note(run, MSTMM_NOT_FINITE, 0, mstmm_lanes_worst(c, lane), run->real.t_new);
        a->wants_dense[lane] = is_lane_accepted(c, a, lane) && mstmm_output_inside(run);
        any_dense |= a->wants_dense[lane];
    }
    if (any_dense) mstmm_lanes_dense(c, a);
    for (int lane = 0; lane < c->lanes; lane++) {
        if (!a->active[lane]) continue;
        if (is_lane_accepted(c, a, lane)) {
            kept_stage[lane] = accept_lane(c, a, lane);
            moved[lane] = !a->failed[lane];
            continue;
        }
        const int failed = a->failed[lane] != 0;
        const int status = mstmm_reject(&group->runs[lane], failed, a->error[lane]);
        if (status && !failed) group->runs[lane].count.component = mstmm_lanes_worst(c, lane);
        group->retries[lane]++;
        if (status) finish(c, lane, status);
    }
    mstmm_lanes_move(c, moved, kept_stage);
    for (int lane = 0; lane < c->lanes; lane++) {
        if (!moved[lane]) continue;
        sample_lane(c, lane);
        if (group->runs[lane].real.t >= group->many->problem.t_end) finish(c, lane, MSTMM_FINISHED);
    }
}

/* ---- the loop ---- */

int mstmm_group_start(mstmm_group *group)
{
    const mstmm_run *problem = &group->many->problem;
    const int64_t size = mstmm_group_size(group->system, problem->tableau);
    if (!size || problem->n_outputs < 0 || !(problem->t_end > problem->t_start))
        return MSTMM_BAD_ARGUMENT;
    memset(group->workspace, 0, (size_t)size * sizeof(double));
    memset(group->runs, 0, sizeof group->runs);
    for (int lane = 0; lane < GROUP; lane++) group->trajectory[lane] = -1;
    const mstmm_cut_group c = cut_group(group);
    for (int64_t i = 0; i < c.row; i++) {
        const int64_t component = i / c.lanes;
        const int counts = problem->atol && component < c.system->n_error;
        c.atol[i] = counts ? problem->atol[component] : INFINITY;
    }
    return 0;
}

int mstmm_group_advance(mstmm_group *group, double wall_seconds)
{
    const mstmm_cut_group c = cut_group(group);
    const double deadline = mstmm_seconds() + wall_seconds;
    for (int turn = 1; refill(&c); turn++) {
        mstmm_attempt a = {.h = {0.0}};
        first_stages(&c);
        if (aim(&c, &a)) {
            mstmm_lanes_stages(&c, &a);
            mstmm_lanes_errors(&c, &a);
            finish_attempts(&c, &a);
        }
        if (turn % 64 == 0 && mstmm_seconds() >= deadline) return MSTMM_RUNNING;
    }
    return MSTMM_FINISHED;
}
