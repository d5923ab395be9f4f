/* Couplings: rows between coordinates of hinges, whose numbers one tape gives; see sweep.h. */
#include "loop_closure.h"
#include "sweep_steps.h"

static real *loop_numbers(const mstmm_state *state)
{
    return state->workspace + state->model->loops;
}

/* Which number of a coupling is the known part of its row. */
static int known_number_index(const mstmm_state *state)
{
    if (state->level == MSTMM_GAP) return MSTMM_COUPLING_GAP;
    return state->level == MSTMM_SLIP ? MSTMM_COUPLING_SLIP : MSTMM_COUPLING_DRIFT;
}

int mstmm_hook_evaluate_couplings(mstmm_state *state)
{
    const mstmm_model *model = state->model;
    real *loops = loop_numbers(state);
    const real *inputs[] = {&state->t, state->q, state->u};
    real *outputs[] = {loops + model->coupling_numbers};
    const int code = mstmm_tape_run(model->coupling_tape, inputs, mstmm_slots(state), outputs);
    if (code) return mstmm_fail(state, MSTMM_FAILED_EXPRESSION, -1, code);
    for (int k = 0; k < model->n_couplings; k++) {
        const mstmm_coupling *one = &model->couplings[k];
        real *numbers = loops + one->numbers;
        numbers[MSTMM_COUPLING_GAP] -= one->kept;
        if (one->row < 0) continue;
        mstmm_row_numbers(model, state->workspace, one->row)[MSTMM_ROW_KNOWN] =
            numbers[known_number_index(state)];
    }
    return 0;
}

int mstmm_hook_coupling_slopes(mstmm_state *state)
{
    const mstmm_model *model = state->model;
    mstmm_state *slope = state->slope;
    real *loops = loop_numbers(slope);
    const real *inputs[] = {&state->t, state->q, state->u, &slope->t, slope->q, slope->u};
    real *outputs[] = {loops + model->coupling_numbers};
    const int code = mstmm_tape_run(model->coupling_slopes, inputs, mstmm_slots(slope), outputs);
    if (code) return mstmm_fail(state, MSTMM_FAILED_EXPRESSION, -1, code);
    for (int k = 0; k < model->n_couplings; k++) {
        const mstmm_coupling *one = &model->couplings[k];
        if (one->row >= 0)
            mstmm_row_numbers(model, slope->workspace, one->row)[MSTMM_ROW_KNOWN] =
                loops[one->numbers + MSTMM_COUPLING_DRIFT];
    }
    return 0;
}

real mstmm_coupling_lack(const mstmm_state *state, const mstmm_coupling *one)
{
    if (one->of_speeds && state->level == MSTMM_GAP) return 0;
    return loop_numbers(state)[one->numbers + known_number_index(state)];
}

void mstmm_efforts_without_couplings(const mstmm_state *state, int index, real *efforts)
{
    const mstmm_looped *looped = &state->model->looped[index];
    const int nu = state->model->bodies[index].nu;
    const real *loops = loop_numbers(state);
    for (int k = 0; k < looped->n_pending + looped->n_own; k++) {
        const int own = k - looped->n_pending;
        const int64_t row = own < 0 ? looped->pending[k].row : looped->own[own].row;
        const int64_t tau = own < 0 ? looped->pending[k].tau : looped->own[own].tau;
        for (int j = 0; tau >= 0 && j < nu; j++)
            efforts[j] -= loops[tau + j] * loops[MSTMM_ROW * row + MSTMM_ROW_X];
    }
}
