/* Loads and efforts across the tree, and hinges that close loops, beside the tangent's elimination;
 * see across.h. */
#include "across.h"

#include "sparse_lu.h"
#include "sweep_steps.h"

/* What is not above it in parts of its column is no pivot. */
#define NO_PIVOT 1e-13

/* --- what there is --- */

/* So many unknowns are changes of loads and efforts; rows of hinges that close loops follow. */
static int n_changes(const mstmm_tangent *at)
{
    return at->n_coupled - at->couplings->n_rows;
}

static real *row_numbers(const mstmm_model *model, real *workspace, int row)
{
    return workspace + model->loops + MSTMM_ROW * (int64_t)row;
}

static int64_t place_of_row(const mstmm_model *model, const mstmm_coupled_row *one)
{
    if (one->frame < 0) return model->loops + MSTMM_ROW * (int64_t)one->row + MSTMM_ROW_KNOWN;
    const mstmm_closure *closure = model->looped[one->frame].closure;
    return model->loops + closure->numbers + MSTMM_CLOSURE_L + one->direction;
}

/* Imposed speeds do not change; a row without a multiplier says nothing of its own. */
static int is_unknown(const mstmm_tangent *at, int k)
{
    if (k < n_changes(at)) return 1;
    const mstmm_coupled_row *one = &at->couplings->rows[k - n_changes(at)];
    if (one->speed < 0)
        return row_numbers(at->model, at->workspace, one->row)[MSTMM_ROW_INVERSE] > 0;
    const mstmm_body *body = &at->model->bodies[one->frame];
    return !(mstmm_imposed(body, at->memory) && body->imposed_mask[one->direction]);
}

/* Number k of what loads and efforts change by, in the derivatives' workspace. */
static real *change_across(const mstmm_tangent *at, const mstmm_state *slope, int k)
{
    const mstmm_couplings *all = at->couplings;
    const mstmm_model *model = at->model;
    if (k < 6 * all->n_bodies)
        return mstmm_block(model, slope->workspace, all->bodies[k / 6]) + MSTMM_BLOCK_E + k % 6;
    return slope->workspace + all->efforts[k - 6 * all->n_bodies];
}

void mstmm_set_own_apart(const mstmm_tangent *at, real *a, real *own)
{
    memcpy(own, a, (size_t)at->model->nu * sizeof(real));
    for (int k = 0; k < at->couplings->n_rows; k++)
        if (at->couplings->rows[k].speed >= 0) a[at->couplings->rows[k].speed] = 0;
}

/* What has to vanish: of a rotor its inertia times its acceleration less the multiplier. */
void mstmm_rows_along(const mstmm_tangent *at, real *workspace, const real *own, real *rows)
{
    const mstmm_model *model = at->model;
    for (int k = 0; k < at->couplings->n_rows; k++) {
        const mstmm_coupled_row *one = &at->couplings->rows[k];
        const real softness = one->row < 0 ? 0 : model->rows[one->row].softness;
        if (softness > 0)
            rows[k] = own[model->bodies[one->frame].u + one->direction]
                      - softness * row_numbers(model, workspace, one->row)[MSTMM_ROW_X];
        else
            rows[k] = workspace[place_of_row(model, one)]
                      - (one->speed < 0 ? 0 : own[one->speed]);
    }
}

void mstmm_keep_multipliers(const mstmm_model *model, real *workspace)
{
    for (int r = 0; r < model->n_rows; r++) row_numbers(model, workspace, r)[MSTMM_ROW_X] = 0;
}

void mstmm_lacking(const mstmm_tangent *at, const real *workspace, const real *own,
                   real *required)
{
    for (int k = 0; at->model->looped && k < at->couplings->n_rows; k++) {
        const mstmm_coupled_row *one = &at->couplings->rows[k];
        if (one->speed >= 0)
            required[one->speed] = own[one->speed] - workspace[place_of_row(at->model, one)];
    }
}

/* --- along a direction --- */

/* Changes along the direction in `parts`, and by one of the multiplier of `row` (-1: of none). */
static int changes_of(mstmm_tangent *at, const mstmm_parts *parts, int row, real *changes)
{
    mstmm_state state = known_state(at, parts), slope = slope_of(at, parts, parts->required);
    state.slope = &slope;
    memset(slope.workspace, 0, MSTMM_BLOCK_FIXED * sizeof(real));
    mstmm_set_own_apart(at, parts->d_a, parts->answer);
    mstmm_keep_multipliers(at->model, slope.workspace);
    if (row >= 0) row_numbers(at->model, slope.workspace, row)[MSTMM_ROW_X] = 1;
    const int code = mstmm_run_applied_slope(&state);
    for (int k = 0; !code && k < n_changes(at); k++) changes[k] = *change_across(at, &slope, k);
    if (!code) mstmm_rows_along(at, slope.workspace, parts->answer, changes + n_changes(at));
    return code;
}

/* The same where rows are asked of positions: in a step those go by accelerations alone. */
static int changes_at_end(mstmm_tangent *at, const mstmm_parts *parts, int row, real *changes)
{
    const size_t speeds = (size_t)at->model->nu * sizeof(real);
    real *loads = mstmm_across_missing(at);
    memcpy(parts->still_efforts, parts->d_a, speeds);
    int code = changes_of(at, parts, row, changes);
    memcpy(loads, changes, (size_t)n_changes(at) * sizeof(real));
    memset(parts->d_q, 0, (size_t)at->model->nq * sizeof(real));
    memset(parts->d_u, 0, speeds);
    memcpy(parts->d_a, parts->still_efforts, speeds);
    if (!code) code = changes_of(at, parts, row, changes);
    memcpy(changes, loads, (size_t)n_changes(at) * sizeof(real));
    return code;
}

/* The same along x and increments that are known (NULL: none). */
static int changes_along(mstmm_tangent *at, const real *x, const mstmm_known *known, int row,
                         real *changes)
{
    const mstmm_model *model = at->model;
    const mstmm_parts parts = parts_of(at);
    const int code = mstmm_tangent_coordinates(at, x, NULL, parts.change);
    if (code) return code;
    memcpy(parts.d_q, parts.change, (size_t)model->nq * sizeof(real));
    for (int j = 0; j < model->nu; j++) {
        parts.d_u[j] = at->rate * x[j];
        parts.d_a[j] = at->s * x[j];
    }
    for (int i = 0; known && i < model->nq; i++) parts.d_q[i] += known->q[i];
    for (int j = 0; known && j < model->nu; j++) parts.d_a[j] += known->a[j];
    return at->on_positions ? changes_at_end(at, &parts, row, changes)
                            : changes_of(at, &parts, row, changes);
}

int mstmm_coupled_along(mstmm_tangent *at, const real *x, const real *d_u, const real *d_a,
                        real *changes)
{
    const mstmm_parts parts = parts_of(at);
    const int code = mstmm_tangent_coordinates(at, x, NULL, parts.change);
    if (code) return code;
    memcpy(parts.d_q, parts.change, (size_t)at->model->nq * sizeof(real));
    memcpy(parts.d_u, d_u, (size_t)at->model->nu * sizeof(real));
    memcpy(parts.d_a, d_a, (size_t)at->model->nu * sizeof(real));
    return changes_of(at, &parts, -1, changes);
}

/* --- answers of the tree alone --- */

int mstmm_hook_unit_load(mstmm_state *state)
{
    *state->tangents->unit = 1;
    return 0;
}

/* x to r beside increments that are known (NULL: none), and to one of change k (-1: of none). */
static int solve_alone(mstmm_tangent *at, const real *r, const mstmm_known *known, int k, real *x)
{
    const mstmm_parts parts = parts_of(at);
    mstmm_tangents step = {.numbers = at->numbers, .rate = at->rate, .s = at->s, .sq = at->sq,
                           .kappa = at->kappa, .kept = at->kept};
    mstmm_state state = known_state(at, &parts), slope = slope_of(at, &parts, parts.answer);
    const int loads = 6 * at->couplings->n_bodies;
    state.slope = &slope;
    state.tangents = &step;
    state.column = r;
    state.answer = x;
    if (k >= 0 && k < loads) step.unit = change_across(at, &slope, k);
    if (k >= loads) parts.column[at->couplings->speeds[k - loads]] = 1;
    memset(slope.workspace, 0, MSTMM_BLOCK_FIXED * sizeof(real));
    if (known) {
        memset(parts.d_u, 0, (size_t)at->model->nu * sizeof(real));
        slope.q = known->q;
        slope.given = known->a;
    }
    /* Hinges that close loops are no part of the tree. */
    for (int i = 0; i < at->couplings->n_rows; i++)
        if (at->couplings->rows[i].speed >= 0) x[at->couplings->rows[i].speed] = 0;
    const int code =
        known ? mstmm_run_tangent_beyond(&state) : mstmm_run_tangent_solution(&state);
    if (k >= loads) parts.column[at->couplings->speeds[k - loads]] = 0;
    return code;
}

/* The tree's answer to one of unknown k, and all that comes with both. */
static int answer_to(mstmm_tangent *at, int k, real *x, real *changes)
{
    const int first = n_changes(at);
    int row = -1;
    if (k < first) {
        const int code = solve_alone(at, parts_of(at).column, NULL, k, x);
        if (code) return code;
    } else {
        memset(x, 0, (size_t)at->model->nu * sizeof(real));
        row = at->couplings->rows[k - first].row;
        if (row < 0) x[at->couplings->rows[k - first].speed] = 1;
    }
    return changes_along(at, x, NULL, row, changes);
}

/* --- all together --- */

/* With changes c = G x and rows 0 = G x, and answers Y to each: x = x_0 + Y c, (1 - G Y) c = G x_0,
 * where rows have no 1. */
int mstmm_across_factor(mstmm_tangent *at, int negative)
{
    const int m = at->n_coupled, nu = at->model->nu, first = n_changes(at);
    real *changes = mstmm_across_changes(at), *exchanges = mstmm_across_exchanges(at);
    memset(parts_of(at).column, 0, (size_t)nu * sizeof(real));
    for (int k = 0; k < m; k++) {
        real *answer = at->answers + (int64_t)k * nu;
        const int unknown = is_unknown(at, k);
        const int code = unknown ? answer_to(at, k, answer, changes) : 0;
        if (code) return code;
        for (int i = 0; i < m; i++) {
            const int counts = unknown && is_unknown(at, i), one = i == k && (i < first || !unknown);
            at->closure[(int64_t)i * m + k] = one - (counts ? changes[i] : 0);
        }
    }
    const int code = mstmm_sparse_factor(m, at->closure, exchanges, changes, NO_PIVOT);
    if (code != 1 && (at->counts || (code == 2) == negative)) return 0;
    return mstmm_fail(&(mstmm_state){.failure = &at->failure}, MSTMM_FAILED_TANGENT, -1,
                      code == 1 ? 1 : MSTMM_NEGATIVE);
}

int mstmm_across_solve(mstmm_tangent *at, const real *r, const mstmm_known *known,
                       const real *missing, real *x)
{
    const int m = at->n_coupled, nu = at->model->nu, first = n_changes(at);
    real *amounts = mstmm_across_changes(at);
    int code = 0;
    if (known && !at->kept) { /* the first to ask for what is known: it will not be the last */
        at->keeps = 1;
        code = mstmm_tangent_factor(at, at->rate, at->s, at->sq, at->kappa);
    }
    if (!code) code = solve_alone(at, r, known, -1, x);
    if (code || !m) return code;
    code = changes_along(at, x, known, -1, amounts);
    if (code) return code;
    for (int k = first; k < m; k++)
        amounts[k] = is_unknown(at, k) ? amounts[k] - (missing ? missing[k - first] : 0) : 0;
    mstmm_sparse_solve(m, at->closure, mstmm_across_exchanges(at), amounts);
    for (int k = 0; k < m; k++)
        for (int j = 0; is_unknown(at, k) && j < nu; j++)
            x[j] += at->answers[(int64_t)k * nu + j] * amounts[k];
    return 0;
}
