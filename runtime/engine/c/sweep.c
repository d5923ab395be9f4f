/* What passes call: the record of a failure, and the expressions of a scene, at a state and along a
 * direction; see sweep.h.  The passes themselves are printed from the schedule (sweep_steps.c). */
#include <string.h>

#include "sweep.h"
#include "sweep_steps.h"

int mstmm_fail(mstmm_state *state, int reason, int element, int code)
{
    if (state->failure) {
        state->failure->reason = reason;
        state->failure->element = element;
        state->failure->code = code;
    }
    return reason;
}

int mstmm_hook_drive_values(mstmm_state *state)
{
    const mstmm_model *model = state->model;
    const real *inputs[] = {&state->t, mstmm_input_numbers(state)};
    real *outputs[] = {mstmm_drive_values(state)};
    memcpy(mstmm_filled_q(state), state->q, (size_t)model->nq * sizeof(real));
    memcpy(mstmm_filled_u(state), state->u, (size_t)model->nu * sizeof(real));
    const int code = mstmm_tape_run(model->drive_tape, inputs, mstmm_slots(state), outputs);
    if (code) return mstmm_fail(state, MSTMM_FAILED_EXPRESSION, -1, code);
    state->q = mstmm_filled_q(state);
    state->u = mstmm_filled_u(state);
    return 0;
}

int mstmm_hook_expression_values(mstmm_state *state)
{
    const mstmm_model *model = state->model;
    const real *inputs[] = {&state->t, state->q, state->u, mstmm_input_numbers(state)};
    real *outputs[] = {mstmm_values(state)};
    const int code = mstmm_tape_run(model->value_tape, inputs, mstmm_slots(state), outputs);
    return code ? mstmm_fail(state, MSTMM_FAILED_EXPRESSION, -1, code) : 0;
}

int mstmm_given_effort(mstmm_state *state, const mstmm_tape *effort, const real *length,
                       real *value)
{
    const real *inputs[] = {&state->t, state->q, state->u, length, mstmm_input_numbers(state)};
    real *outputs[] = {value};
    return mstmm_tape_run(effort, inputs, mstmm_slots(state), outputs);
}

int mstmm_hook_drive_slopes(mstmm_state *state)
{
    mstmm_state *slope = state->slope;
    const mstmm_model *model = state->model;
    const real *inputs[] = {&state->t, mstmm_input_numbers(state), &slope->t};
    real *outputs[] = {mstmm_drive_values(slope)};
    memcpy(mstmm_filled_q(slope), slope->q, (size_t)model->nq * sizeof(real));
    memcpy(mstmm_filled_u(slope), slope->u, (size_t)model->nu * sizeof(real));
    const int code = mstmm_tape_run(model->drive_slopes, inputs, mstmm_slots(slope), outputs);
    if (code) return mstmm_fail(state, MSTMM_FAILED_EXPRESSION, -1, code);
    slope->q = mstmm_filled_q(slope);
    slope->u = mstmm_filled_u(slope);
    return 0;
}

int mstmm_hook_expression_slopes(mstmm_state *state)
{
    mstmm_state *slope = state->slope;
    const real *inputs[] = {&state->t, state->q, state->u, mstmm_input_numbers(state),
                            &slope->t, slope->q, slope->u};
    real *outputs[] = {mstmm_values(slope)};
    const int code =
        mstmm_tape_run(state->model->value_slopes, inputs, mstmm_slots(slope), outputs);
    return code ? mstmm_fail(state, MSTMM_FAILED_EXPRESSION, -1, code) : 0;
}

int mstmm_given_effort_slope(mstmm_state *state, const mstmm_tape *tape, const real *length,
                             const real *d_length, real *d_value)
{
    mstmm_state *slope = state->slope;
    const real *inputs[] = {&state->t, state->q, state->u, length,  mstmm_input_numbers(state),
                            &slope->t, slope->q, slope->u, d_length};
    real *outputs[] = {d_value};
    return mstmm_tape_run(tape, inputs, mstmm_slots(slope), outputs);
}
