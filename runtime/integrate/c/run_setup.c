/* Set-up and state of a run: sizes, workspace, arguments, and its state as plain numbers. */
#include <math.h>
#include <string.h>

#include "step.h"

/* ---- sizes and workspace ---- */

enum { ALIGNMENT = 64 };

/* Memory that is divided, and its used part; base NULL only counts. */
typedef struct cutting {
    double *base;
    int64_t used;
} cutting;

static double *cut_array(cutting *at, int64_t count)
{
    double *const start = at->base ? at->base + at->used : NULL;
    at->used += (count + GROUP - 1) / GROUP * GROUP;
    return start;
}

static double *align_workspace(double *workspace)
{
    const uintptr_t rest = (uintptr_t)workspace % ALIGNMENT;
    return rest ? workspace + (ALIGNMENT - rest) / sizeof(double) : workspace;
}

static int uses_newton(const mstmm_tableau *tableau)
{
    return tableau->kind == MSTMM_DIRK || tableau->kind == MSTMM_ALPHA;
}

/* Numbers behind the components of a state, in the rows of implicit methods */
static int64_t n_accelerations(const mstmm_implicit *implicit, const mstmm_tableau *tableau)
{
    if (!implicit) return 0;
    return (int64_t)implicit->n_u * (tableau->kind != MSTMM_ALPHA ? 1 : tableau->backward ? 3 : 2);
}

static void cut_exponential(cutting *at, mstmm_work *work)
{
    const int64_t n_u = work->implicit->n_u, n = work->implicit->n_q + n_u;
    work->jacobian = cut_array(at, n * n);
    work->inverse_mass = cut_array(at, n_u * n_u);
    work->time_slope = cut_array(at, n);
    work->motion = cut_array(at, 4 * n);
    work->phi = mstmm_phi_lay((int)n, cut_array(at, mstmm_phi_size((int)n)));
}

static void cut_implicit(cutting *at, mstmm_work *work)
{
    const int64_t n_q = work->implicit->n_q, n_u = work->implicit->n_u;
    double **of_row[] = {&work->y_star, &work->y_first, &work->error};
    double **of_q[] = {&work->rho_q, &work->dq};
    double **of_u[] = {&work->residual, &work->residual_rate, &work->rho_u, &work->du,
                       &work->da,       &work->map_q,         &work->map_u};
    for (size_t i = 0; i < sizeof of_row / sizeof *of_row; i++)
        *of_row[i] = cut_array(at, work->row);
    for (size_t i = 0; i < sizeof of_q / sizeof *of_q; i++) *of_q[i] = cut_array(at, n_q);
    for (size_t i = 0; i < sizeof of_u / sizeof *of_u; i++) *of_u[i] = cut_array(at, n_u);
    work->flow = cut_array(at, 3 * n_q);
    work->nodes = cut_array(at, (work->tableau->n_inner + 2) * (int64_t)mstmm_n_rest(work));
    if (work->tableau->kind == MSTMM_EXPONENTIAL) cut_exponential(at, work);
}

/* Cuts `base` into the arrays of *work, whose sizes are there.  Returns the doubles needed; *kept
 * is what must be kept between steps. */
static int64_t cut_work(double *base, mstmm_work *work, int64_t *kept)
{
    const mstmm_system *system = work->system;
    const mstmm_tableau *tableau = work->tableau;
    const mstmm_implicit *implicit = tableau->kind == MSTMM_EXPLICIT ? NULL : system->implicit;
    const int64_t wide_state = system->n_state + n_accelerations(implicit, tableau);
    const int64_t ne = mstmm_n_watched(system), row = (wide_state + GROUP - 1) / GROUP * GROUP;
    const int64_t lanes = tableau->n_nodes ? GROUP * row : 0;
    cutting at = {.base = base, .used = 0};
    work->row = row;
    work->implicit = implicit;
    work->y = cut_array(&at, row);
    work->truth = cut_array(&at, ne);
    work->last_fire = cut_array(&at, ne);
    work->side = cut_array(&at, ne);
    if (uses_newton(tableau)) work->base = cut_array(&at, row);
    work->k = cut_array(&at, row);
    *kept = at.used;
    cut_array(&at, (tableau->n_stages + tableau->n_extra) * row);
    work->y_new = cut_array(&at, row);
    work->y_stage = cut_array(&at, row);
    work->y_event = cut_array(&at, row);
    work->dense = cut_array(&at, tableau->n_dense * row);
    work->atol = cut_array(&at, row);
    work->lanes_y = cut_array(&at, lanes);
    work->lanes_k = cut_array(&at, lanes);
    work->g_before = cut_array(&at, ne);
    work->g_left = cut_array(&at, ne);
    work->g_right = cut_array(&at, ne);
    work->g_trial = cut_array(&at, ne);
    work->memory = cut_array(&at, system->n_memory);
    work->seen_row = (system->n_seen + GROUP - 1) / GROUP * GROUP;
    work->seen = cut_array(&at, system->n_seen ? (3 + MSTMM_DEPTH) * work->seen_row : 0);
    work->rates = cut_array(&at, system->n_seen ? row : 0);
    work->bounds = (mstmm_bounds *)cut_array(&at, system->n_seen ? 4 * ne : 0);
    work->first_bounds = (mstmm_bounds *)cut_array(&at, system->n_seen ? 4 * ne : 0);
    if (implicit) cut_implicit(&at, work);
    return at.used;
}

void mstmm_work_cut(mstmm_run *run, mstmm_work *work)
{
    const int64_t n = run->system->n_error;
    int64_t kept;
    *work = (mstmm_work){.run = run, .system = run->system, .tableau = run->tableau};
    cut_work(align_workspace(run->workspace), work, &kept);
    for (int64_t i = 0; i < n; i++) work->atol[i] = run->atol ? run->atol[i] : 0.0;
}

static int implicit_is_sound(const mstmm_system *system, const mstmm_tableau *tableau)
{
    const mstmm_implicit *at = system->implicit;
    if (tableau->kind == MSTMM_EXPLICIT) return 1;
    return at && at->n_q >= 0 && at->n_u >= 0 && at->n_q + at->n_u <= system->n_state &&
           ((at->coordinates && at->rates) || at->n_q == at->n_u) && at->residual && at->tangent &&
           at->solve && (at->residual_rate || uses_newton(tableau)) &&
           (at->slope || tableau->kind != MSTMM_EXPONENTIAL) && tableau->n_extra == 0 &&
           tableau->n_nodes == 0 && tableau->n_inner >= 0;
}

static int sizes_are_sound(const mstmm_system *system, const mstmm_tableau *tableau)
{
    const int lanes = system->lanes;
    return system->n_state >= 0 && system->n_error >= 0 && system->n_error <= system->n_state &&
           system->n_events >= 0 && system->n_switches >= 0 && system->n_memory >= 0 &&
           (system->n_seen == 0 || (system->n_seen > 0 && system->see && system->enclose)) &&
           system->rhs && implicit_is_sound(system, tableau) &&
           (!system->n_events || system->fire) && (!mstmm_n_watched(system) || system->events) &&
           (!system->n_memory || system->memory) &&
           (lanes == 0 || ((lanes == 2 || lanes == 4 || lanes == GROUP) && system->rhs_lanes)) &&
           tableau->n_stages >= 1 && tableau->n_extra >= 0 && tableau->n_dense >= 1 &&
           tableau->n_nodes >= 0 && tableau->n_nodes <= GROUP &&
           (!tableau->n_nodes || tableau->n_stages == 1 + tableau->n_nodes * tableau->n_iterations);
}

int64_t mstmm_workspace_size(const mstmm_system *system, const mstmm_tableau *tableau)
{
    mstmm_work work = {.system = system, .tableau = tableau};
    int64_t kept;
    if (!sizes_are_sound(system, tableau)) return 0;
    return cut_work(NULL, &work, &kept) + ALIGNMENT / (int64_t)sizeof(double);
}

void mstmm_pass_breaks(mstmm_run *run)
{
    int64_t *i = &run->count.break_index;
    while (*i < run->n_breaks && run->breaks[*i] <= run->real.t) (*i)++;
    run->count.at_break = *i > 0 && run->breaks[*i - 1] == run->real.t;
}

/* ---- starting ---- */

static int is_increasing(int64_t n, const double *x)
{
    for (int64_t i = 0; i < n; i++)
        if (!isfinite(x[i]) || (i && !(x[i] > x[i - 1]))) return 0;
    return 1;
}

/* Number of the first invalid argument, 0 if none */
static int bad_argument(const mstmm_run *run)
{
    const mstmm_system *system = run->system;
    if (!sizes_are_sound(system, run->tableau) || !run->workspace) return 1;
    if (!isfinite(run->t_start) || !isfinite(run->t_end) || run->t_end < run->t_start) return 2;
    if (!(run->fixed_step >= 0.0) || !(run->rtol >= 0.0) || !(run->first_step >= 0.0) ||
        !(run->min_step >= 0.0) || !(run->max_step >= 0.0) || run->max_steps < 0)
        return 3;
    if (run->fixed_step == 0.0 && (!run->tableau->n_errors || (system->n_error && !run->atol)))
        return 3;
    if (uses_newton(run->tableau) && !run->atol) return 3; /* it says when the iteration may stop */
    for (int i = 0; run->atol && i < system->n_error; i++)
        if (!(run->atol[i] > 0.0)) return 3;
    if (run->n_breaks < 0 || !is_increasing(run->n_breaks, run->breaks)) return 4;
    if (run->n_bounds < 0 || !is_increasing(run->n_bounds, run->bound_starts)) return 4;
    for (int64_t i = 0; i < run->n_bounds; i++)
        if (!(run->bounds[i] > 0.0)) return 4;
    if (!is_increasing(run->n_outputs, run->outputs)) return 5;
    if (run->n_outputs > 0 &&
        (run->outputs[0] < run->t_start || run->outputs[run->n_outputs - 1] > run->t_end))
        return 5;
    if (run->sample_capacity < 2 || !run->sample_t || !run->sample_event) return 6;
    if ((system->n_state && !run->sample_y) || (system->n_memory && !run->sample_memory)) return 6;
    return 0;
}

static void clear(mstmm_run *run)
{
    memset(&run->real, 0, sizeof run->real);
    memset(&run->count, 0, sizeof run->count);
    run->count.n_state = run->system->n_state;
    run->count.n_events = run->system->n_events;
    run->count.n_switches = run->system->n_switches;
    run->count.n_memory = run->system->n_memory;
    run->count.n_stages = run->tableau->n_stages;
    run->count.n_extra = run->tableau->n_extra;
    run->count.n_dense = run->tableau->n_dense;
    run->count.lanes = run->system->lanes;
    run->count.component = -1;
    run->count.event = -1;
    run->count.chatter = -1;
    run->count.unseen = -1;
    run->count.restarted = 1; /* an event that holds may come to hold again in no time */
    run->real.t = run->t_start;
    run->real.contraction = -1.0;
    run->real.smallest_step = INFINITY;
}

static void clear_workspace(mstmm_run *run)
{
    const int64_t size = mstmm_workspace_size(run->system, run->tableau);
    memset(run->workspace, 0, (size_t)size * sizeof(double));
}

int mstmm_run_start(mstmm_run *run, const double *y0)
{
    mstmm_work work;
    clear(run);
    run->n_samples = 0;
    const int bad = bad_argument(run);
    if (bad) {
        run->count.phase = PHASE_END;
        run->count.status = mstmm_note(run, MSTMM_BAD_ARGUMENT, bad, -1, run->t_start);
        return MSTMM_BAD_ARGUMENT;
    }
    clear_workspace(run);
    mstmm_work_cut(run, &work);
    memcpy(work.y, y0, (size_t)run->system->n_state * sizeof *y0);
    for (int i = 0; i < mstmm_n_watched(run->system); i++) {
        work.side[i] = 1.0;
        work.truth[i] = UNTRUE;
        work.last_fire[i] = NAN;
    }
    mstmm_pass_breaks(run);
    run->count.phase = PHASE_START;
    if (!mstmm_all_finite(run->system->n_state, work.y)) {
        run->count.phase = PHASE_END;
        run->count.status =
            mstmm_note(run, MSTMM_NOT_FINITE, 0, mstmm_first_not_finite(run->system->n_state, y0),
                       run->t_start);
    }
    return (int)run->count.status;
}

const double *mstmm_run_y(const mstmm_run *run) { return align_workspace(run->workspace); }

/* ---- the state as numbers ---- */

static int is_between_steps(const mstmm_run *run)
{
    const int64_t phase = run->count.phase;
    return phase <= PHASE_STEP || phase == PHASE_END;
}

/* Doubles of workspace in a saved state: all of it within a step, little between steps. */
static int64_t saved_workspace(const mstmm_run *run)
{
    mstmm_work work = {.system = run->system, .tableau = run->tableau};
    int64_t kept;
    const int64_t all = cut_work(NULL, &work, &kept);
    return is_between_steps(run) ? kept : all;
}

int64_t mstmm_run_pack_integers(const mstmm_run *run)
{
    return (int64_t)(sizeof run->count / sizeof(int64_t));
}

int64_t mstmm_run_pack_reals(const mstmm_run *run)
{
    const int64_t numbers = (int64_t)(sizeof run->real / sizeof(double));
    return numbers + run->system->n_memory + saved_workspace(run);
}

void mstmm_run_pack(const mstmm_run *run, double *reals, int64_t *integers)
{
    const int64_t nm = run->system->n_memory;
    memcpy(integers, &run->count, sizeof run->count);
    memcpy(reals, &run->real, sizeof run->real);
    reals += sizeof run->real / sizeof(double);
    if (nm) memcpy(reals, run->system->memory, (size_t)nm * sizeof(double));
    memcpy(reals + nm, align_workspace(run->workspace),
           (size_t)saved_workspace(run) * sizeof(double));
}

static int is_compatible_count(const mstmm_run *run, const mstmm_run_count *saved)
{
    const mstmm_run_count *c = &run->count;
    return saved->n_state == c->n_state && saved->n_events == c->n_events &&
           saved->n_switches == c->n_switches && saved->n_memory == c->n_memory &&
           saved->n_stages == c->n_stages && saved->n_extra == c->n_extra &&
           saved->n_dense == c->n_dense && saved->lanes == c->lanes && saved->history >= 0 &&
           saved->history <= 2 && saved->phase >= PHASE_START && saved->phase <= PHASE_END &&
           saved->event >= -1 && saved->event < c->n_events + c->n_switches &&
           saved->break_index >= 0 && saved->next_switch >= 0 &&
           saved->next_switch <= c->n_events + c->n_switches && saved->bound_index >= 0 &&
           saved->bound_index <= run->n_bounds && saved->break_index <= run->n_breaks &&
           saved->output_index >= 0 &&
           saved->output_index <= (run->n_outputs > 0 ? run->n_outputs : 0);
}

int mstmm_run_restore(mstmm_run *run, int64_t n_reals, const double *reals, int64_t n_integers,
                      const int64_t *integers)
{
    mstmm_run restored = *run;
    mstmm_run_count saved;
    clear(&restored);
    if (bad_argument(run) || n_integers != mstmm_run_pack_integers(run)) return MSTMM_BAD_ARGUMENT;
    memcpy(&saved, integers, sizeof saved);
    if (!is_compatible_count(&restored, &saved)) return MSTMM_BAD_ARGUMENT;
    restored.count = saved;
    if (n_reals != mstmm_run_pack_reals(&restored)) return MSTMM_BAD_ARGUMENT;
    memcpy(&restored.real, reals, sizeof restored.real);
    reals += sizeof restored.real / sizeof(double);
    restored.n_samples = 0;
    *run = restored;
    const int64_t nm = run->system->n_memory;
    if (nm) memcpy(run->system->memory, reals, (size_t)nm * sizeof(double));
    clear_workspace(run);
    memcpy(align_workspace(run->workspace), reals + nm,
           (size_t)saved_workspace(run) * sizeof(double));
    return 0;
}
