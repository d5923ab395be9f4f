/* Loads and efforts that couple distant bodies, and closing hinges, in addition to the tangent's
 * elimination along the tree; see off_tree_coupling.h. */
#include "off_tree_coupling.h"

#include "sweep_steps.h"

/* Smallest pivot relative to its column. */
#define NO_PIVOT 1e-13

/* --- rows and own accelerations of closing hinges --- */

static int64_t row_place(const mstmm_model *model, const mstmm_coupled_row *one)
{
    if (one->frame < 0) return model->loops + MSTMM_ROW * (int64_t)one->row + MSTMM_ROW_KNOWN;
    const mstmm_closure *closure = model->looped[one->frame].closure;
    return model->loops + closure->numbers + MSTMM_CLOSURE_L + one->direction;
}

void mstmm_set_own_apart(const mstmm_tangent *at, real *a, real *own)
{
    memcpy(own, a, (size_t)at->model->nu * sizeof(real));
    for (int k = 0; k < at->couplings->n_rows; k++)
        if (at->couplings->rows[k].speed >= 0) a[at->couplings->rows[k].speed] = 0;
}

/* Residual; for a rotor its inertia times its acceleration minus the multiplier. */
void mstmm_rows_along(const mstmm_tangent *at, real *workspace, const real *own, real *rows)
{
    const mstmm_model *model = at->model;
    for (int k = 0; k < at->couplings->n_rows; k++) {
        const mstmm_coupled_row *one = &at->couplings->rows[k];
        const real softness = one->row < 0 ? 0 : model->rows[one->row].softness;
        if (softness > 0)
            rows[k] = own[model->bodies[one->frame].u + one->direction] -
                      softness * mstmm_row_numbers(model, workspace, one->row)[MSTMM_ROW_X];
        else
            rows[k] = workspace[row_place(model, one)] - (one->speed < 0 ? 0 : own[one->speed]);
    }
}

void mstmm_keep_multipliers(const mstmm_model *model, real *workspace)
{
    for (int r = 0; r < model->n_rows; r++) mstmm_row_numbers(model, workspace, r)[MSTMM_ROW_X] = 0;
}

void mstmm_lacking(const mstmm_tangent *at, const real *workspace, const real *own, real *required)
{
    for (int k = 0; at->model->looped && k < at->couplings->n_rows; k++) {
        const mstmm_coupled_row *one = &at->couplings->rows[k];
        if (one->speed >= 0)
            required[one->speed] = own[one->speed] - workspace[row_place(at->model, one)];
    }
}

/* --- unknowns --- */

/* Number of unknown changes of loads and efforts; rows of closing hinges follow them. */
static int n_changes(const mstmm_tangent *at) { return at->n_coupled - at->couplings->n_rows; }

/* Entries of a list that are of pass or group k (-1: none). */
static int first_in_list(const int *firsts, int k) { return k < 0 ? 0 : firsts[k]; }

static int end_of_list(const int *firsts, int k)
{
    return firsts[k + 1]; /* none before the first */
}

/* Prescribed speeds do not change; a row without a multiplier is redundant. */
static int is_unknown(const mstmm_tangent *at, int k)
{
    if (k < n_changes(at)) return 1;
    const mstmm_coupled_row *one = &at->couplings->rows[k - n_changes(at)];
    if (one->speed < 0)
        return mstmm_row_numbers(at->model, at->workspace, one->row)[MSTMM_ROW_INVERSE] > 0;
    const mstmm_body *body = &at->model->bodies[one->frame];
    return !(mstmm_imposed_count(body, at->memory) && body->imposed_mask[one->direction]);
}

/* Change number k of loads and efforts, in the derivatives' workspace. */
static real *change_place(const mstmm_tangent *at, const mstmm_state *slope, int k)
{
    const mstmm_couplings *all = at->couplings;
    const mstmm_model *model = at->model;
    if (k < 6 * all->n_bodies)
        return mstmm_block(model, slope->workspace, all->bodies[k / 6]) + MSTMM_BLOCK_E + k % 6;
    return slope->workspace + all->efforts[k - 6 * all->n_bodies];
}

/* --- along a direction --- */

/* Index of the multiplier of an unknown; -1: it is no multiplier. */
static int multiplier(const mstmm_tangent *at, int k)
{
    return k < n_changes(at) ? -1 : at->couplings->rows[k - n_changes(at)].row;
}

/* Changes along the direction in `parts`, and by one of the multipliers of a pass (-1: of none). */
static int direction_changes(mstmm_tangent *at, const mstmm_parts *parts, int pass, real *changes)
{
    const mstmm_couplings *all = at->couplings;
    mstmm_state state = known_state(at, parts), slope = tangent_slope(at, parts, parts->required);
    state.slope = &slope;
    memset(slope.workspace, 0, MSTMM_BLOCK_FIXED * sizeof(real));
    mstmm_set_own_apart(at, parts->d_a, parts->answer);
    mstmm_keep_multipliers(at->model, slope.workspace);
    for (int s = first_in_list(all->first_seed, pass); s < end_of_list(all->first_seed, pass);
         s++) {
        const int row = multiplier(at, all->seed[s]);
        if (row >= 0 && is_unknown(at, all->seed[s]))
            mstmm_row_numbers(at->model, slope.workspace, row)[MSTMM_ROW_X] = 1;
    }
    const int code = mstmm_run_applied_slope(&state);
    for (int k = 0; !code && k < n_changes(at); k++) changes[k] = *change_place(at, &slope, k);
    if (!code) mstmm_rows_along(at, slope.workspace, parts->answer, changes + n_changes(at));
    return code;
}

/* The same for rows of positions: in a step these depend on accelerations only, for a small motion
 * x on the accelerations along it, whatever s is. */
static int changes_at_end(mstmm_tangent *at, const mstmm_parts *parts, const real *x, int pass,
                          real *changes)
{
    const size_t speeds = (size_t)at->model->nu * sizeof(real);
    real *loads = mstmm_across_missing(at);
    memcpy(parts->still_efforts, parts->d_a, speeds);
    for (int j = 0; at->rows_of_motion && j < at->model->nu; j++)
        parts->still_efforts[j] = (1 + at->s) * x[j];
    int code = direction_changes(at, parts, pass, changes);
    memcpy(loads, changes, (size_t)n_changes(at) * sizeof(real));
    memset(parts->d_q, 0, (size_t)at->model->nq * sizeof(real));
    memset(parts->d_u, 0, speeds);
    memcpy(parts->d_a, parts->still_efforts, speeds);
    if (!code) code = direction_changes(at, parts, pass, changes);
    memcpy(changes, loads, (size_t)n_changes(at) * sizeof(real));
    return code;
}

/* The same along x and increments that are known (NULL: none). */
static int changes_along(mstmm_tangent *at, const real *x, const mstmm_known *known, int pass,
                         real *changes)
{
    const mstmm_model *model = at->model;
    const mstmm_parts parts = tangent_parts(at);
    const int code = mstmm_tangent_coordinates(at, x, NULL, parts.change);
    if (code) return code;
    memcpy(parts.d_q, parts.change, (size_t)model->nq * sizeof(real));
    for (int j = 0; j < model->nu; j++) {
        parts.d_u[j] = at->rate * x[j];
        parts.d_a[j] = at->s * x[j];
    }
    for (int i = 0; known && i < model->nq; i++) parts.d_q[i] += known->q[i];
    for (int j = 0; known && j < model->nu; j++) parts.d_a[j] += known->a[j];
    return at->on_positions || at->rows_of_motion ? changes_at_end(at, &parts, x, pass, changes)
                                                  : direction_changes(at, &parts, pass, changes);
}

int mstmm_coupled_along(mstmm_tangent *at, const real *x, const real *d_u, const real *d_a,
                        real *changes)
{
    const mstmm_parts parts = tangent_parts(at);
    const int code = mstmm_tangent_coordinates(at, x, NULL, parts.change);
    if (code) return code;
    memcpy(parts.d_q, parts.change, (size_t)at->model->nq * sizeof(real));
    memcpy(parts.d_u, d_u, (size_t)at->model->nu * sizeof(real));
    memcpy(parts.d_a, d_a, (size_t)at->model->nu * sizeof(real));
    return direction_changes(at, &parts, -1, changes);
}

/* --- solutions of the tree only --- */

int mstmm_hook_unit_load(mstmm_state *state)
{
    const mstmm_tangents *step = state->tangents;
    for (int k = 0; k < step->n_unit; k++) state->slope->workspace[step->unit[k]] = 1;
    return 0;
}

/* Efforts of a pass in a right-hand side. */
static void set_efforts(const mstmm_tangent *at, int pass, real value, real *column)
{
    const mstmm_couplings *all = at->couplings;
    const int loads = 6 * all->n_bodies;
    for (int s = first_in_list(all->first_seed, pass); s < end_of_list(all->first_seed, pass); s++)
        if (all->seed[s] >= loads && all->seed[s] < n_changes(at))
            column[all->speeds[all->seed[s] - loads]] = value;
}

/* Solution x for r with known increments (NULL: none), and for a unit of each change of a pass (-1:
 * none). */
static int solve_tree(mstmm_tangent *at, const real *r, const mstmm_known *known, int pass, real *x)
{
    const mstmm_parts parts = tangent_parts(at);
    const mstmm_couplings *all = at->couplings;
    mstmm_tangents step = tangent_steps(at);
    mstmm_state state = known_state(at, &parts), slope = tangent_slope(at, &parts, parts.answer);
    state.slope = &slope;
    state.tangents = &step;
    state.column = r;
    state.answer = x;
    if (pass >= 0) {
        step.unit = all->unit + all->first_unit[pass];
        step.n_unit = all->first_unit[pass + 1] - all->first_unit[pass];
    }
    set_efforts(at, pass, 1, parts.column);
    memset(slope.workspace, 0, MSTMM_BLOCK_FIXED * sizeof(real));
    if (known) {
        memset(parts.d_u, 0, (size_t)at->model->nu * sizeof(real));
        slope.q = known->q;
        slope.given = known->a;
    }
    /* Hinges that close loops are no part of the tree. */
    for (int i = 0; i < all->n_rows; i++)
        if (all->rows[i].speed >= 0) x[all->rows[i].speed] = 0;
    const int code =
        known ? mstmm_run_tangent_with_increments(&state) : mstmm_run_tangent_solution(&state);
    set_efforts(at, pass, 0, parts.column);
    return code;
}

/* Solution of the tree for a unit of each unknown of a pass, and the resulting changes. */
static int unit_solution(mstmm_tangent *at, int pass, real *x, real *changes)
{
    const mstmm_couplings *all = at->couplings;
    const int first = n_changes(at), *seeds = all->seed + all->first_seed[pass];
    memset(x, 0, (size_t)at->model->nu * sizeof(real));
    if (seeds[0] < first) { /* loads and efforts stand before the rest */
        const int code = solve_tree(at, tangent_parts(at).column, NULL, pass, x);
        if (code) return code;
    }
    for (int s = 0; s < all->first_seed[pass + 1] - all->first_seed[pass]; s++)
        if (seeds[s] >= first && multiplier(at, seeds[s]) < 0 && is_unknown(at, seeds[s]))
            x[all->rows[seeds[s] - first].speed] = 1;
    return changes_along(at, x, NULL, pass, changes);
}

/* --- all together --- */

/* True if a pass contains an unknown. */
static int has_unknown(const mstmm_tangent *at, int pass)
{
    const mstmm_couplings *all = at->couplings;
    for (int s = all->first_seed[pass]; s < all->first_seed[pass + 1]; s++)
        if (is_unknown(at, all->seed[s])) return 1;
    return 0;
}

/* Column k of 1 - G Y (without 1 for rows), from the changes caused by its pass. */
static void set_column(const mstmm_tangent *at, const mstmm_band *matrix, int k,
                       const real *changes)
{
    const mstmm_couplings *all = at->couplings;
    const int column = all->rank[k], group = all->group[k], unknown = is_unknown(at, k);
    for (int s = all->first_reader[group]; unknown && s < all->first_reader[group + 1]; s++) {
        const int i = all->reader[s];
        if (is_unknown(at, i)) *mstmm_band_at(matrix, all->rank[i], column) = -changes[i];
    }
    if (k < n_changes(at) || !unknown) *mstmm_band_at(matrix, column, column) += 1;
}

/* Changes c = G x, rows 0 = G x, unit solutions Y: x = x_0 + Y c, (1 - G Y) c = G x_0. */
int mstmm_across_factor(mstmm_tangent *at, int negative)
{
    const mstmm_couplings *all = at->couplings;
    const mstmm_band matrix = mstmm_across_band(at);
    real *changes = mstmm_across_changes(at), *exchanges = mstmm_across_exchanges(at);
    memset(tangent_parts(at).column, 0, (size_t)at->model->nu * sizeof(real));
    memset(matrix.a, 0, (size_t)(matrix.n * matrix.width) * sizeof(real));
    for (int pass = 0; pass < all->n_passes; pass++) {
        real *answer = at->answers + (int64_t)pass * at->model->nu;
        const int code = has_unknown(at, pass) ? unit_solution(at, pass, answer, changes) : 0;
        if (code) return code;
        for (int s = all->first_seed[pass]; s < all->first_seed[pass + 1]; s++)
            set_column(at, &matrix, all->seed[s], changes);
    }
    const int code = mstmm_band_factor(&matrix, exchanges, changes, NO_PIVOT);
    if (code != 1 && (at->counts || (code == 2) == negative)) return 0;
    return mstmm_fail(&(mstmm_state){.failure = &at->failure}, MSTMM_FAILED_TANGENT, -1,
                      code == 1 ? 1 : MSTMM_NEGATIVE);
}

/* Adds the unit solutions times the unknowns, in the order of the matrix. */
static void add_unit_solutions(const mstmm_tangent *at, const real *amounts, real *x)
{
    const mstmm_couplings *all = at->couplings;
    for (int pass = 0; pass < all->n_passes; pass++) {
        const real *answer = at->answers + (int64_t)pass * at->model->nu;
        for (int s = all->first_seed[pass]; s < all->first_seed[pass + 1]; s++) {
            const int k = all->seed[s], *end = all->moved + all->first_moved[all->group[k] + 1];
            if (!is_unknown(at, k)) continue;
            for (const int *j = all->moved + all->first_moved[all->group[k]]; j < end; j++)
                x[*j] += answer[*j] * amounts[all->rank[k]];
        }
    }
}

int mstmm_across_solve(mstmm_tangent *at, const real *r, const mstmm_known *known,
                       const real *missing, real *x)
{
    const mstmm_band matrix = mstmm_across_band(at);
    const int m = at->n_coupled, first = n_changes(at);
    real *changes = mstmm_across_changes(at), *amounts = mstmm_across_ordered(at);
    int code = solve_tree(at, r, known, -1, x);
    if (code || !m) return code;
    code = changes_along(at, x, known, -1, changes);
    if (code) return code;
    for (int k = 0; k < m; k++) {
        const real lacks = k < first || !missing ? 0 : missing[k - first];
        amounts[at->couplings->rank[k]] = is_unknown(at, k) ? changes[k] - lacks : 0;
    }
    mstmm_band_solve(&matrix, mstmm_across_exchanges(at), amounts);
    add_unit_solutions(at, amounts, x);
    return 0;
}
