/* Closed loops: initialisation of sums, and projection of states on the constraints. */
#include <math.h>
#include <string.h>

#include "loop_closure.h"
#include "sweep.h"
#include "sweep_steps.h"

/* Newton's method: from this gap (m, rad) on the next step leaves rounding; so many steps, and the
 * gap that is still none behind them, where a singular pose makes them slow. */
#define CLOSE 1e-7
#define STEPS 10
#define OPEN 1e-5
/* Where digits are lost: that gap, and so many corrections of the speeds. */
#define CLOSE_REFINED 1e-12
#define SLIPS_REFINED 3

static real *row_numbers(const mstmm_state *state, int row)
{
    return mstmm_row_numbers(state->model, state->workspace, row);
}

/* True if a row is inactive now. */
static int is_released(const mstmm_state *state, const mstmm_loop_row *row)
{
    if (row->of_speeds && state->level == MSTMM_GAP) return 1;
    return row->release >= 0 && fabs(state->memory[row->release]) > 0;
}

int mstmm_hook_begin_rows(mstmm_state *state)
{
    const mstmm_model *model = state->model;
    const int keeps = state->refined && !(state->closing > 0);
    real *first = row_numbers(state, 0), *sums = row_numbers(state, model->n_rows);
    real *end = state->workspace + model->loops + model->loops_summed;
    for (int r = 0; keeps && r < model->n_rows; r++) {
        real *numbers = row_numbers(state, r), previous = numbers[MSTMM_ROW_X];
        memset(numbers, 0, MSTMM_ROW * sizeof(real));
        numbers[MSTMM_ROW_PREVIOUS_X] = previous;
    }
    if (keeps) first = sums; /* else in one call: each call has a fixed cost */
    memset(first, 0, (size_t)(end - first) * sizeof(real));
    for (int r = 0; r < model->n_rows; r++) {
        const mstmm_loop_row *row = &model->rows[r];
        row_numbers(state, r)[MSTMM_ROW_PIVOT] =
            is_released(state, row) || mstmm_is_row_inactive(state, row)
                ? (real)INFINITY
                : row->softness + state->give * row->mobility;
    }
    return model->n_couplings ? mstmm_hook_evaluate_couplings(state) : 0;
}

int mstmm_hook_set_row_targets(mstmm_state *state)
{
    for (int r = 0; state->asked && r < state->model->n_rows; r++)
        row_numbers(state, r)[MSTMM_ROW_KNOWN] = state->asked[r];
    return 0;
}

int mstmm_self_stress(const mstmm_model *model, real *workspace, real give, const real *asked,
                      const real *q, const real *memory, real *multipliers, mstmm_failure *failure)
{
    mstmm_state state = {.model = model,
                         .workspace = workspace,
                         .q = q,
                         .memory = memory,
                         .observed = 1,
                         .level = MSTMM_SLIP,
                         .give = give,
                         .asked = asked,
                         .failure = failure};
    state.u = mstmm_spare_udot(&state);
    const int code = mstmm_run_correction_from_zero(&state, mstmm_spare_udot(&state));
    for (int r = 0; r < model->n_rows; r++) multipliers[r] = row_numbers(&state, r)[MSTMM_ROW_X];
    return code;
}

int mstmm_refine(mstmm_state *state, const real *q, const real *u)
{
    const mstmm_model *model = state->model;
    real *answer = state->workspace + model->answer;
    int code = 0;
    state->q = q;
    state->u = u;
    state->given = answer;
    state->linked = 0; /* links begin from no accelerations */
    state->residual = state->refined = 1;
    for (int k = 0; k < model->refines && !code; k++) {
        memcpy(answer, state->udot, (size_t)model->nu * sizeof(real));
        if (state->balance) state->balance->power = state->balance->potential = 0;
        mstmm_ground(state);
        code = mstmm_run_accelerations(state);
    }
    return code;
}

int mstmm_placing_accelerations(const mstmm_model *model, real *workspace, real closing, real t,
                                const real *q, const real *u, const real *a, const real *memory,
                                real *qdot, real *found, mstmm_failure *failure)
{
    mstmm_state state = {.model = model,
                         .workspace = workspace,
                         .t = t,
                         .q = q,
                         .u = u,
                         .memory = memory,
                         .given = a,
                         .qdot = qdot,
                         .udot = found,
                         .failure = failure,
                         .closing = closing,
                         .residual = 1,
                         .refined = 1};
    mstmm_ground(&state);
    return mstmm_run_accelerations(&state);
}

/* Errors of the rows in the last sweep, by row. */
static void write_row_errors(const mstmm_state *state, real *missing)
{
    const mstmm_model *model = state->model;
    for (int i = 0; i < model->n_bodies; i++) {
        const mstmm_closure *closure = model->looped[i].closure;
        if (!closure) continue;
        const real *known = state->workspace + model->loops + closure->numbers + MSTMM_CLOSURE_L;
        for (int c = 0; c < 6; c++)
            if (closure->rows[c] >= 0) missing[closure->rows[c]] = known[c];
    }
    for (int k = 0; k < model->n_couplings; k++)
        if (model->couplings[k].row >= 0)
            missing[model->couplings[k].row] = mstmm_coupling_lack(state, &model->couplings[k]);
}

int mstmm_correction(const mstmm_model *model, real *workspace, int level, real give, real t,
                     const real *q, const real *u, const real *memory, real *change, real *missing,
                     mstmm_failure *failure)
{
    mstmm_state state = {.model = model,
                         .workspace = workspace,
                         .t = t,
                         .q = q,
                         .u = u,
                         .memory = memory,
                         .level = level,
                         .give = give,
                         .failure = failure};
    const int code = mstmm_run_correction_from_zero(&state, change);
    if (!code && missing) write_row_errors(&state, missing);
    return code;
}

real mstmm_strain(const mstmm_model *model, const real *workspace)
{
    real found = 0;
    for (int r = 0; r < model->n_rows; r++) {
        const real *numbers = workspace + model->loops + MSTMM_ROW * (int64_t)r;
        found = fmax(found, model->rows[r].floor * numbers[MSTMM_ROW_INVERSE]);
    }
    return found;
}

int mstmm_fill_driven(const mstmm_model *model, real *workspace, real t, real *q, real *u,
                      const real *memory, mstmm_failure *failure)
{
    mstmm_state state = {.model = model,
                         .workspace = workspace,
                         .t = t,
                         .q = q,
                         .u = u,
                         .memory = memory,
                         .observed = 1,
                         .failure = failure};
    if (!model->n_drives) return 0;
    const int code = mstmm_run_prescribed_values(&state);
    if (code) return code;
    memcpy(q, state.q, (size_t)model->nq * sizeof(real));
    memcpy(u, state.u, (size_t)model->nu * sizeof(real));
    return 0;
}

int mstmm_move_positions(const mstmm_model *model, real *workspace, real t, real *q,
                         const real *change, const real *memory, int n_quaternions,
                         const int *quaternions, mstmm_failure *failure)
{
    mstmm_state state = {.model = model,
                         .workspace = workspace,
                         .t = t,
                         .q = q,
                         .u = change,
                         .memory = memory,
                         .observed = 1,
                         .failure = failure};
    real *qdot = mstmm_spare_qdot(&state);
    state.qdot = qdot;
    mstmm_ground(&state);
    for (int i = 0; i < model->n_bodies; i++) {
        const int code = mstmm_at_hinge_motion(&state, i);
        if (code) return code;
        const mstmm_modal *modal = mstmm_modal_of(&model->bodies[i]);
        if (modal) memcpy(qdot + modal->q, change + modal->u, (size_t)modal->n * sizeof(real));
    }
    for (int i = 0; i < model->nq; i++) q[i] += qdot[i];
    mstmm_unit_quaternions(n_quaternions, quaternions, q);
    return 0;
}

void mstmm_unit_quaternions(int count, const int *first, real *q)
{
    for (int k = 0; k < count; k++) {
        real *unit = q + first[k];
        const real norm =
            sqrt(unit[0] * unit[0] + unit[1] * unit[1] + unit[2] * unit[2] + unit[3] * unit[3]);
        for (int j = 0; j < 4; j++) unit[j] /= norm;
    }
}

/* Largest of what the rows lack that have a multiplier, and own speeds of hinges that close; where
 * `repeated`, of what the others lack: they say what some of these say, and follow by themselves.
 * *where is the frame of its hinge, or the number of a coupling behind those of all bodies. */
static real largest_row_error(const mstmm_state *state, int repeated, int *where)
{
    const mstmm_model *model = state->model;
    real found = 0;
    for (int i = 0; i < model->n_bodies; i++) {
        const mstmm_closure *closure = model->looped[i].closure;
        if (!closure) continue;
        const real *known = state->workspace + model->loops + closure->numbers + MSTMM_CLOSURE_L;
        for (int c = 0; c < 6; c++) {
            const int row = closure->rows[c];
            if (row < -1 || (row >= 0 && is_released(state, &model->rows[row]))) continue;
            const int counts =
                row >= 0 ? row_numbers(state, row)[MSTMM_ROW_INVERSE] > 0 : c < model->bodies[i].nu;
            if (counts == repeated || fabs(known[c]) <= found) continue;
            found = fabs(known[c]);
            *where = i;
        }
    }
    for (int k = 0; k < model->n_couplings; k++) {
        const mstmm_coupling *one = &model->couplings[k];
        const real lack = fabs(mstmm_coupling_lack(state, one));
        const int counts = one->row >= 0 && row_numbers(state, one->row)[MSTMM_ROW_INVERSE] > 0;
        if (counts == repeated || lack <= found) continue;
        found = lack;
        *where = model->n_bodies + k;
    }
    return found;
}

typedef struct {
    const mstmm_model *model;
    real *workspace, *q, *u, *change;
    real t;
    const real *memory;
    int n_quaternions;
    const int *quaternions;
    mstmm_failure *failure;
} looped_state;

static int looped_gaps(void *context, mstmm_gaps *found)
{
    const looped_state *at = context;
    const mstmm_state state = {
        .model = at->model, .workspace = at->workspace, .memory = at->memory, .level = MSTMM_GAP};
    int code = mstmm_correction(at->model, at->workspace, MSTMM_GAP, 0, at->t, at->q, at->u,
                                at->memory, at->change, NULL, at->failure);
    if (code) return code;
    found->met = largest_row_error(&state, 0, &found->where_met);
    found->repeated = largest_row_error(&state, 1, &found->where_repeated);
    return mstmm_move_positions(at->model, at->workspace, at->t, at->q, at->change, at->memory,
                                at->n_quaternions, at->quaternions, at->failure);
}

static int looped_slips(void *context)
{
    const looped_state *at = context;
    const int code = mstmm_correction(at->model, at->workspace, MSTMM_SLIP, 0, at->t, at->q, at->u,
                                      at->memory, at->change, NULL, at->failure);
    for (int i = 0; i < at->model->nu && !code; i++) at->u[i] += at->change[i];
    return code;
}

int mstmm_remove_gaps(const mstmm_closing *by, const mstmm_model *model, mstmm_failure *failure)
{
    const real close = model->refines || by->near ? CLOSE_REFINED : CLOSE;
    const int slips = !by->slips ? 0 : model->refines || by->near ? SLIPS_REFINED : 1;
    mstmm_gaps gaps = {.met = 1};
    for (int k = 0; k < STEPS && !(gaps.met < close); k++) {
        gaps = (mstmm_gaps){0};
        const int code = by->gaps(by->context, &gaps);
        if (code) return code;
    }
    const int met = gaps.met < OPEN;
    if (!met || !(gaps.repeated < model->loops_apart)) {
        const int where = met ? gaps.where_repeated : gaps.where_met;
        const int behind = where - model->n_bodies, coupled = behind >= 0;
        *failure = (mstmm_failure){coupled ? MSTMM_FAILED_COUPLING : MSTMM_FAILED_LOOP,
                                   coupled ? behind : where, 0};
        return failure->reason;
    }
    int code = 0;
    for (int k = 0; k < slips && !code; k++) code = by->slips(by->context);
    return code;
}

int mstmm_close_loops(const mstmm_model *model, real *workspace, real t, real *q, real *u,
                      const real *memory, int n_quaternions, const int *quaternions, int gaps_alone,
                      mstmm_failure *failure)
{
    const mstmm_state state = {.model = model, .workspace = workspace};
    looped_state at = {model,  workspace,     q,           u,      mstmm_spare_udot(&state), t,
                       memory, n_quaternions, quaternions, failure};
    const int near = model->strained >= 0 && memory[model->strained] > 0;
    const mstmm_closing by = {&at, looped_gaps, gaps_alone ? NULL : looped_slips, near};
    return mstmm_remove_gaps(&by, model, failure);
}
