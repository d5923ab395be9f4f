/* What calls the passes: states begun, expressions evaluated, entries for Python; see sweep.h.  The
 * passes themselves are printed from the schedule (sweep_steps.c). */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "hinge.h"
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

int mstmm_hinge_interpreted(mstmm_state *state, const mstmm_body *body,
                            struct mstmm_hinge_hinge to)
{
    const real *inputs[MSTMM_HINGE_HINGE_INPUTS];
    real *outputs[MSTMM_HINGE_HINGE_OUTPUTS];
    mstmm_hinge_hinge_arrays(to, inputs, outputs);
    return mstmm_tape_run(body->tape, inputs, state->slots, outputs);
}

int mstmm_given_effort(mstmm_state *state, const mstmm_tape *effort, const real *length, real *value)
{
    const real *inputs[] = {&state->t, state->q, state->u, length};
    real *outputs[] = {value};
    return mstmm_tape_run(effort, inputs, state->slots, outputs);
}

int mstmm_hook_drive_values(mstmm_state *state)
{
    const mstmm_model *model = state->model;
    const real *inputs[] = {&state->t};
    real *outputs[] = {state->drive_values};
    memcpy(state->filled_q, state->q, (size_t)model->nq * sizeof(real));
    memcpy(state->filled_u, state->u, (size_t)model->nu * sizeof(real));
    const int code = mstmm_tape_run(model->drive_tape, inputs, state->slots, outputs);
    if (code) return mstmm_fail(state, MSTMM_FAILED_EXPRESSION, -1, code);
    state->q = state->filled_q;
    state->u = state->filled_u;
    return 0;
}

int mstmm_hook_expression_values(mstmm_state *state)
{
    const mstmm_model *model = state->model;
    const real *inputs[] = {&state->t, state->q, state->u};
    real *outputs[] = {state->values};
    if (!model->n_values) return 0;
    const int code = mstmm_tape_run(model->value_tape, inputs, state->slots, outputs);
    return code ? mstmm_fail(state, MSTMM_FAILED_EXPRESSION, -1, code) : 0;
}

void mstmm_lay_out(mstmm_state *state)
{
    const mstmm_model *model = state->model;
    real *ground = state->workspace;
    state->filled_q = state->workspace + model->scratch;
    state->filled_u = state->filled_q + model->nq;
    state->values = state->filled_u + model->nu;
    state->drive_values = state->values + model->n_values;
    state->slots = state->drive_values + 3 * model->n_drives;
    state->spare_qdot = state->slots + model->tape_slots;
    state->spare_udot = state->spare_qdot + model->nq;
    memset(ground, 0, MSTMM_BLOCK_FIXED * sizeof(real));
    for (int i = 0; i < 3; i++) {
        ground[MSTMM_BLOCK_MOTION + 6 + i] = -model->gravity[i];
        ground[MSTMM_BLOCK_A + 4 * i] = 1;
    }
}

int mstmm_begin(mstmm_state *state, const real *q, const real *u)
{
    mstmm_lay_out(state);
    state->q = q;
    state->u = u;
    return mstmm_run_given(state);
}

int mstmm_accelerations(const mstmm_model *model, real *workspace, real t, const real *q,
                        const real *u, const real *memory, const real *efforts, real *qdot,
                        real *udot, mstmm_balance *balance, mstmm_failure *failure)
{
    mstmm_state state = {.model = model, .workspace = workspace, .t = t, .memory = memory,
                         .efforts = efforts, .qdot = qdot, .udot = udot, .balance = balance,
                         .linked = !(model->needs_pose || model->product), .failure = failure};
    if (balance) balance->power = balance->potential = 0;
    const int code = mstmm_begin(&state, q, u);
    return code ? code : mstmm_run_accelerations(&state);
}

int mstmm_accelerations_kept(const mstmm_model *model, real *workspace, real t, const real *q,
                             const real *u, const real *memory, real *qdot, real *udot,
                             mstmm_balance *balance, mstmm_failure *failure)
{
    mstmm_state state = {.model = model, .workspace = workspace, .t = t, .memory = memory,
                         .qdot = qdot, .udot = udot, .balance = balance, .observed = 1,
                         .failure = failure};
    if (balance) balance->power = balance->potential = 0;
    const int code = mstmm_begin(&state, q, u);
    return code ? code : mstmm_run_accelerations(&state);
}

int mstmm_inverse_dynamics(const mstmm_model *model, real *workspace, real t, const real *q,
                           const real *u, const real *memory, const real *udot, real *efforts,
                           mstmm_failure *failure)
{
    mstmm_state state = {.model = model, .workspace = workspace, .t = t, .memory = memory,
                         .given = udot, .required = efforts, .failure = failure};
    const int code = mstmm_begin(&state, q, u);
    state.qdot = state.spare_qdot;
    return code ? code : mstmm_run_inverse_dynamics(&state);
}

int mstmm_solve(const mstmm_model *model, real *workspace, int64_t n, const real *q,
                const real *memory, const real *columns, real *answers, mstmm_failure *failure)
{
    mstmm_state state = {.model = model, .workspace = workspace, .memory = memory, .q = q,
                         .failure = failure};
    mstmm_lay_out(&state);
    state.qdot = state.spare_qdot;
    state.u = state.filled_u;
    memset(state.filled_u, 0, (size_t)model->nu * sizeof(real));
    int code = mstmm_run_factorisation(&state);
    for (int64_t k = 0; !code && k < n; k++) {
        state.column = columns + k * model->nu;
        state.answer = answers + k * model->nu;
        code = mstmm_run_solution(&state);
    }
    return code;
}
