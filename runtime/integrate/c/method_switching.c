/* Signs that another kind of method suits a run better, the change to it between steps, and the
 * continuation of a run after its end. */
#include <math.h>
#include <string.h>

#include "step.h"

/* After so many other steps in a row, earlier signs for a change no longer count (as in the
 * codes of E. Hairer, G. Wanner, Solving Ordinary Differential Equations II (1996), section
 * IV.2). */
enum { FORGOTTEN_AFTER = 6 };

void mstmm_watch_sign(mstmm_run *run, int limited)
{
    mstmm_run_count *count = &run->count;
    const int implicit = run->tableau->kind != MSTMM_EXPLICIT;
    if (implicit && run->count.cut_short) return; /* its length is no sign */
    if (implicit ? run->real.h < run->short_step : limited) {
        count->sign++;
        count->sign_against = 0;
    } else if (++count->sign_against >= FORGOTTEN_AFTER) {
        count->sign = 0;
    }
}

int mstmm_is_asked(mstmm_run *run)
{
    const mstmm_run_count *count = &run->count;
    const int signs = run->sign_steps && count->sign >= run->sign_steps;
    run->count.asked = signs || (run->look_steps && count->steps == run->look_steps);
    return (int)run->count.asked;
}

/* Between two steps, or after an impossible step: then as at a start. */
static int can_continue(mstmm_run *run)
{
    if (run->count.phase <= PHASE_STEP) return 1;
    if (!run->count.no_step) return 0;
    run->count.no_step = 0;
    run->count.phase = PHASE_STEP;
    run->count.status = MSTMM_RUNNING;
    run->real.h_next = 0.0;
    return 1;
}

/* Data of the method are reset as at a start; the rest of the run is unchanged. */
static void forget_method(mstmm_run *run)
{
    mstmm_run_count *count = &run->count;
    run->real.h_previous = run->real.error_previous = 0.0;
    run->real.contraction = -1.0;
    run->real.tangent_t = run->real.tangent_s = run->real.tangent_sq = 0.0;
    count->n_stages = run->tableau->n_stages;
    count->n_extra = run->tableau->n_extra;
    count->n_dense = run->tableau->n_dense;
    count->first_stage_valid = count->rejected_last = 0;
    count->tangent_valid = count->tangent_held = count->history = 0;
    count->evaluated_left = count->evaluated_row = 0;
    count->by_laws = count->by_positions = count->exact_left = count->exact_row = 0;
    count->sign = count->sign_against = count->asked = 0;
}

int mstmm_run_change(mstmm_run *run, const mstmm_tableau *tableau, double *workspace)
{
    const int64_t size = mstmm_workspace_size(run->system, tableau);
    const size_t watched = (size_t)mstmm_n_watched(run->system) * sizeof(double);
    mstmm_run changed = *run;
    mstmm_work from, to;
    if (!size || run->fixed_step > 0.0 || !tableau->n_errors || !can_continue(&changed))
        return MSTMM_BAD_ARGUMENT;
    memset(workspace, 0, (size_t)size * sizeof(double));
    changed.tableau = tableau;
    changed.workspace = workspace;
    mstmm_work_cut(run, &from);
    mstmm_work_cut(&changed, &to);
    memcpy(to.y, from.y, (size_t)run->system->n_state * sizeof(double));
    if (watched) {
        memcpy(to.truth, from.truth, watched);
        memcpy(to.last_fire, from.last_fire, watched);
        memcpy(to.side, from.side, watched);
    }
    forget_method(&changed);
    *run = changed;
    return 0;
}

int mstmm_run_go_on(mstmm_run *run, double t_end, int changed)
{
    mstmm_run_count *count = &run->count;
    const int ended = count->phase == PHASE_END;
    if (!(t_end >= run->real.t) || isinf(t_end) || count->status == MSTMM_BAD_ARGUMENT ||
        count->status == MSTMM_STOPPED || (!ended && count->phase > PHASE_STEP))
        return MSTMM_BAD_ARGUMENT;
    const int failed = count->status < 0;
    run->t_end = t_end;
    if (changed || failed) count->first_stage_valid = 0;
    if (failed) run->real.h_next = 0.0;
    if (count->phase != PHASE_START && (ended || changed))
        count->phase = changed ? PHASE_HERE : PHASE_SAMPLE;
    count->no_step = 0;
    count->status = MSTMM_RUNNING;
    return 0;
}

void mstmm_run_map(mstmm_run *run, int64_t n_breaks, const double *breaks, int64_t n_bounds,
                   const double *bound_starts, const double *bounds, const double *pole)
{
    const int64_t at_break =
        run->count.at_break; /* of a break that the new ones may begin behind */
    run->n_breaks = n_breaks;
    run->breaks = breaks;
    run->n_bounds = n_bounds;
    run->bound_starts = bound_starts;
    run->bounds = bounds;
    run->pole = pole;
    run->count.break_index = run->count.bound_index = 0;
    mstmm_pass_breaks(run);
    run->count.at_break = at_break;
}
