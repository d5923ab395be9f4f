/* Choice of the satisfied rows of a closure with redundant rows: pivoting with pivots relative to
 * the mobility, before the first of them is closed. */
#include <math.h>
#include <string.h>

#include "loop_closure.h"
#include "sweep.h"

#define MOST 6
/* A choice is kept while its smallest pivot exceeds this fraction of the best one's, and if even
 * that one is as small as that of redundant rows. */
#define WORSE 0.5
#define REPEATED 1e-6
/* Where none has been made, the first rows that say something are taken, as compiled code takes
 * them, unless they are worse than this. */
#define BAD 1e-2
/* A later row is preferred if its pivot is larger by this factor: symmetry makes some equal up to
 * rounding. */
#define LARGER 1.1

/* The entries of L between the rows, in parts of their mobilities; those of rows of which nothing
 * is asked now are zero. */
static void scaled_entries(const mstmm_state *state, const mstmm_choice *one, real (*found)[MOST])
{
    const real *loops = state->workspace + state->model->loops;
    real scale[MOST];
    for (int i = 0; i < one->n; i++) {
        const real own =
            mstmm_row_numbers(state->model, state->workspace, one->rows[i])[MSTMM_ROW_PIVOT];
        const real mobility = state->model->rows[one->rows[i]].mobility;
        scale[i] = isfinite(own) && mobility > 0 ? 1 / sqrt(mobility) : 0;
        found[i][i] = isfinite(own) ? own * scale[i] * scale[i] : 0;
        for (int j = 0; j < i; j++)
            found[i][j] = found[j][i] =
                loops[one->pairs[i * (i - 1) / 2 + j]] * scale[i] * scale[j];
    }
}

/* So many of the rows that `met` marks, by the largest pivots; the others are no longer marked.
 * Returns the smallest of these pivots. */
static real select_largest_pivots(int n, int count, real (*entries)[MOST], int *met)
{
    real left[MOST][MOST], smallest = INFINITY;
    int open[MOST];
    memcpy(left, entries, sizeof left);
    memcpy(open, met, sizeof open);
    memset(met, 0, MOST * sizeof *met);
    for (int k = 0; k < count; k++) {
        int best = -1;
        for (int i = 0; i < n; i++)
            if (open[i] && (best < 0 || left[i][i] > LARGER * left[best][best])) best = i;
        if (best < 0) return 0;
        const real pivot = left[best][best];
        open[best] = 0;
        met[best] = 1;
        smallest = fmin(smallest, pivot);
        for (int i = 0; i < n && pivot > 0; i++)
            for (int j = 0; j < n; j++)
                if (i != best && j != best) left[i][j] -= left[i][best] * left[best][j] / pivot;
    }
    return smallest;
}

/* The first so many independent rows, in the order in which they are closed. */
static void select_first_independent(int n, int count, real (*entries)[MOST], int *met)
{
    real left[MOST][MOST];
    memcpy(left, entries, sizeof left);
    for (int k = 0; k < n; k++) {
        const real pivot = left[k][k];
        met[k] = count > 0 && pivot > REPEATED;
        count -= met[k];
        for (int i = k + 1; i < n && met[k]; i++)
            for (int j = k + 1; j < n; j++) left[i][j] -= left[i][k] * left[k][j] / pivot;
    }
}

static int is_resting(const mstmm_state *state, int row)
{
    return state->memory[state->model->rows[row].rest] > 0;
}

static void choose_independent_rows(mstmm_state *state, const mstmm_choice *one)
{
    const mstmm_model *model = state->model;
    real entries[MOST][MOST] = {{0}};
    int best[MOST] = {1, 1, 1, 1, 1, 1}, now[MOST] = {0}, known = 0;
    scaled_entries(state, one, entries);
    for (int i = 0; i < one->n; i++) {
        now[i] = !is_resting(state, one->rows[i]);
        known |= !now[i];
    }
    const real most = select_largest_pivots(one->n, one->count, entries, best);
    if (!known) select_first_independent(one->n, one->count, entries, now);
    const real least = known || state->chosen ? WORSE : BAD;
    int stays = select_largest_pivots(one->n, one->count, entries, now) > least * most;
    if (known) stays |= most < REPEATED;
    const int *met = stays ? now : best;
    for (int i = 0; i < one->n; i++) {
        const mstmm_loop_row *row = &model->rows[one->rows[i]];
        if (!met[i])
            mstmm_row_numbers(model, state->workspace, one->rows[i])[MSTMM_ROW_PIVOT] = INFINITY;
        if (state->chosen) state->chosen[row->rest] = !met[i];
    }
    state->changed |= !stays || !known;
}

const real *mstmm_row_floor(mstmm_state *state, const mstmm_loop_row *row)
{
    const mstmm_choice *one = row->choice;
    int known = 0;
    for (int i = 0; one && i < one->n; i++) known |= is_resting(state, one->rows[i]);
    if (one && (state->chosen || !known)) choose_independent_rows(state, one);
    return &row->floor;
}

int mstmm_is_row_inactive(const mstmm_state *state, const mstmm_loop_row *row)
{
    return !state->chosen && row->rest >= 0 && state->memory[row->rest] > 0;
}

int mstmm_choose_rows(const mstmm_model *model, real *workspace, real t, const real *q,
                      real *memory, int *changed, mstmm_failure *failure)
{
    mstmm_state state = {.model = model,
                         .workspace = workspace,
                         .t = t,
                         .q = q,
                         .memory = memory,
                         .level = MSTMM_SLIP,
                         .failure = failure,
                         .chosen = memory};
    *changed = 0;
    if (!model->n_choices) return 0;
    state.u = mstmm_spare_udot(&state);
    const int code = mstmm_run_correction_from_zero(&state, mstmm_spare_udot(&state));
    *changed = state.changed;
    return code;
}
