/* Step control: end of the trial step, test of its error, length of the next step. */
#include <math.h>

#include "implicit_step.h"
#include "step.h"

static const double SAFETY = 0.9, SMALLEST_FACTOR = 0.2, LARGEST_FACTOR = 10.0;
static const double LARGEST_IMPLICIT = 6.0; /* the same for implicit methods */
static const double WORTH = 1.2; /* step ratio that justifies a new tangent of Newton's iteration */
static const double AFTER_FAILURE = 0.25; /* of the step whose stages could not be evaluated */
static const double SAME = 1e-9; /* of a step: a grid point so near to a break is the break */
static const double STRETCH = 1.01; /* a step may be this much longer to end at a stop */
static const double HOPELESS = 1e-24; /* of the run: smallest step where t is near 0 */
static const double NEAR_LIMIT = 0.9; /* of the stability limit: the step goes no further */
static const double GAP = 0x1p-39; /* of the time or the run: two breaks that are one */
static const double NO_END = 1e10; /* steps of a run that have no end in sight */
enum { MANY_STEPS = 50, LARGE_PART = 10, MOST_REJECTIONS = 200 };
enum { SOME_STEPS = 1 << 17, SOON = 1 << 12 }; /* between checks of the progress of the run */

static double next_stop(const mstmm_run *run, int *is_break)
{
    const int64_t i = run->count.break_index;
    *is_break = i < run->n_breaks && run->breaks[i] <= run->t_end;
    return *is_break ? run->breaks[i] : run->t_end;
}

/* Of the time, with a margin */
static double rounding(const mstmm_run *run)
{
    return 10.0 * (nextafter(run->real.t, INFINITY) - run->real.t);
}

static double smallest_step(const mstmm_run *run)
{
    return fmax(run->min_step, fmax(rounding(run), HOPELESS * (run->t_end - run->t_start)));
}

/* Chooses t_new: on the grid t_start + i fixed_step, which breaks and events do not shift */
static void aim_fixed(mstmm_run *run, double stop, int is_break)
{
    const double h = run->fixed_step;
    const double grid = run->t_start + (double)(run->count.grid_index + 1) * h;
    const int reaches = grid >= stop - SAME * h;
    run->real.t_new = reaches ? stop : grid;
    run->count.lands_on_break = reaches && is_break;
    run->count.lands_on_grid = !reaches || grid - stop <= SAME * h;
    run->count.cut_short = run->real.t_new - run->real.t < (1.0 - 4.0 * SAME) * h - rounding(run);
}

/* h, or the longest step that max_step and the bounds allow: one that ends before a shorter bound
 * begins, or is no longer than it. */
static double longest_step(mstmm_run *run, double h)
{
    int64_t *i = &run->count.bound_index;
    const double t = run->real.t;
    if (run->max_step > 0.0) h = fmin(h, run->max_step);
    if (!run->n_bounds) return h;
    while (*i + 1 < run->n_bounds && run->bound_starts[*i + 1] <= t) (*i)++;
    h = fmin(h, run->bounds[*i]);
    for (int64_t j = *i + 1; j < run->n_bounds && run->bound_starts[j] < t + h; j++)
        h = fmin(h, fmax(run->bounds[j], run->bound_starts[j] - t));
    return h;
}

static void aim_adaptive(mstmm_run *run, double stop, int is_break)
{
    const double wanted = fmax(run->real.h_next, smallest_step(run));
    const double most = longest_step(run, STRETCH * wanted), h = fmin(wanted, most);
    const int reaches = run->real.t + most >= stop;
    run->real.t_new = reaches ? stop : run->real.t + h;
    run->count.lands_on_break = reaches && is_break;
    run->count.cut_short = reaches && stop - run->real.t < h;
}

static double factor_from(const mstmm_run *run, double error)
{
    const double beta = run->tableau->beta, order = run->tableau->error_order + 1.0;
    if (error == 0.0) return LARGEST_FACTOR;
    double factor = SAFETY * pow(error, -1.0 / order + 0.75 * beta);
    if (beta > 0.0 && run->real.error_previous > 0.0) factor *= pow(run->real.error_previous, beta);
    return fmin(LARGEST_FACTOR, factor);
}

/* The recent growth of errors is extrapolated (K. Gustafsson, ACM Transactions on
 * Mathematical Software 20 (1994) 496-517). */
static double predicted_factor(const mstmm_run *run, double error)
{
    const double order = run->tableau->error_order + 1.0, before = run->real.error_previous;
    double factor = error == 0.0 ? LARGEST_IMPLICIT : SAFETY * pow(error, -1.0 / order);
    if (run->real.h_previous > 0.0 && before > 0.0 && error > 0.0)
        factor = fmin(factor, SAFETY * (run->real.h / run->real.h_previous) *
                                  pow(before / (error * error), 1.0 / order));
    factor = fmin(factor, LARGEST_IMPLICIT);
    return run->tableau->kind != MSTMM_ROSENBROCK && factor >= 1.0 && factor < WORTH ? 1.0 : factor;
}

void mstmm_propose(mstmm_run *run, double error)
{
    const int implicit = run->tableau->kind != MSTMM_EXPLICIT;
    const double found = implicit ? predicted_factor(run, error) : factor_from(run, error);
    double factor = fmax(SMALLEST_FACTOR, found);
    if (run->count.rejected_last) factor = fmin(1.0, factor);
    const double proposal = run->real.h * factor;
    run->real.h_next = run->count.cut_short ? fmax(run->real.h_next, proposal) : proposal;
    run->real.error_previous = fmax(error, implicit ? 1e-2 : 1e-4);
}

int mstmm_reject(mstmm_run *run, int failed, double error)
{
    const double factor = failed ? AFTER_FAILURE : fmax(SMALLEST_FACTOR, factor_from(run, error));
    if (!failed) mstmm_note(run, MSTMM_STEP_TOO_SMALL, 0, -1, run->real.t);
    run->count.rejected++;
    run->count.rejected_last++;
    run->real.h_next = run->real.h * fmin(factor, 0.95);
    const int small = run->real.h_next < smallest_step(run);
    const int enough = run->count.rejected_last > MOST_REJECTIONS;
    return run->fixed_step > 0.0 || small || enough ? (int)run->count.fail_status : 0;
}

void mstmm_count_step(mstmm_run *run, double error, double absolute)
{
    run->count.steps++;
    run->real.sum_local_error += absolute;
    run->real.sum_scaled_error += error;
    if (run->count.cut_short) return;
    run->real.smallest_step = fmin(run->real.smallest_step, run->real.h);
    run->real.largest_step = fmax(run->real.largest_step, run->real.h);
}

/* True if the step was as long as stability permits. */
static int watch_stability(const mstmm_work *work)
{
    mstmm_run *run = work->run;
    mstmm_run_count *count = &run->count;
    run->real.stiffness = mstmm_stiffness(work);
    run->real.largest_stiffness = fmax(run->real.largest_stiffness, run->real.stiffness);
    const int limited = run->real.stiffness > NEAR_LIMIT * work->tableau->stability_limit;
    count->stability_limited_steps += limited;
    count->stability_limited = count->stability_limited_steps >= MANY_STEPS &&
                               LARGE_PART * count->stability_limited_steps >= count->steps;
    return limited;
}

int mstmm_aim(mstmm_run *run)
{
    int is_break;
    const double stop = next_stop(run, &is_break);
    if (run->fixed_step > 0.0)
        aim_fixed(run, stop, is_break);
    else
        aim_adaptive(run, stop, is_break);
    if (run->real.h_cut > 0.0 && run->real.t + run->real.h_cut < run->real.t_new) {
        run->real.t_new = run->real.t + run->real.h_cut;
        run->count.lands_on_break = run->count.lands_on_grid = 0;
        run->count.cut_short = 1;
    }
    run->real.h = run->real.t_new - run->real.t;
    return run->real.h > 0.0 ? 0 : mstmm_note(run, MSTMM_STEP_TOO_SMALL, 0, -1, run->real.t);
}

int mstmm_in_gap(const mstmm_run *run)
{
    const double size = fmax(fabs(run->real.t), run->t_end - run->t_start);
    return run->count.at_break && run->count.lands_on_break && run->real.h <= GAP * size;
}

int mstmm_no_further(mstmm_run *run)
{
    const int64_t steps = run->count.steps;
    if (run->pole && run->real.t >= *run->pole)
        return mstmm_note(run, MSTMM_POLE, 0, -1, run->real.t);
    if (run->max_steps && steps >= run->max_steps)
        return mstmm_note(run, MSTMM_TOO_MANY_STEPS, 0, -1, run->real.t);
    const int64_t some = run->count.chatter < 0 ? SOME_STEPS : SOON;
    if (run->max_steps || run->fixed_step > 0.0 || steps % some) return 0;
    const double gone = run->real.t - run->real.pace_time, left = run->t_end - run->real.t;
    run->real.pace_time = run->real.t;
    if (!steps || gone == 0.0 || left / gone * (double)some < NO_END) return 0;
    return mstmm_note(run, MSTMM_TOO_MANY_STEPS, 1, -1, run->real.t);
}

double mstmm_interval(const mstmm_run *run)
{
    int is_break;
    return next_stop(run, &is_break) - run->real.t;
}

int mstmm_output_inside(const mstmm_run *run)
{
    const int64_t i = run->count.output_index;
    return i < run->n_outputs && run->outputs[i] < run->real.t_new;
}

/* One attempt; *error < 1 on success.  0, or the status of a stage that could not be evaluated. */
static int attempt_step(const mstmm_work *work, double *error, double *absolute)
{
    mstmm_run *run = work->run;
    *error = *absolute = 0.0;
    int status = mstmm_aim(run);
    if (!status) status = mstmm_stages(work);
    if (status) return status;
    if (work->tableau->n_errors) *error = mstmm_error_norm(work, absolute);
    if (isnan(*error) || isinf(*error))
        return mstmm_note(run, MSTMM_NOT_FINITE, 0, mstmm_worst_component(work), run->real.t_new);
    if (mstmm_in_gap(run)) *error = 0.0;
    if (run->fixed_step == 0.0 && *error >= 1.0) return 0;
    const int dense = mstmm_output_inside(run) || mstmm_n_watched(work->system);
    if (run->fixed_step > 0.0) run->real.error_previous = *error; /* of the motion alone */
    if (!work->implicit) return dense ? mstmm_build_dense(work) : 0;
    status = mstmm_implicit_finish(work, dense);
    if (!status && work->tableau->n_errors && !mstmm_in_gap(run))
        *error = mstmm_error_norm(work, absolute); /* the error of quadratures is known now */
    return status;
}

int mstmm_try_step(const mstmm_work *work)
{
    mstmm_run *run = work->run;
    const int fixed = run->fixed_step > 0.0;
    double error, absolute;
    int status = mstmm_no_further(run);
    if (!status) status = mstmm_first_stage(work);
    if (status) return status;
    if (!fixed && run->real.h_next == 0.0)
        run->real.h_next =
            run->first_step > 0.0 ? run->first_step : mstmm_initial_step(work, mstmm_interval(run));
    run->count.rejected_last = 0;
    for (;;) {
        const int failed = attempt_step(work, &error, &absolute) != 0;
        if (!failed && (fixed || error < 1.0)) break;
        status = mstmm_reject(run, failed, error);
        if (status && !failed) run->count.component = mstmm_worst_component(work);
        if (status) return status;
    }
    if (!fixed) mstmm_propose(run, error);
    mstmm_count_step(run, error, absolute);
    mstmm_watch_sign(run, work->implicit ? 0 : watch_stability(work));
    run->real.t_scan = run->real.t;
    run->count.phase = work->system->n_switches ? PHASE_SWITCH : PHASE_SCAN;
    run->real.t_switch = INFINITY;
    return 0;
}
