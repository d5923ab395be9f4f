/* Entries of the passes: accelerations, inverse dynamics and solutions with the mass matrix; see
 * sweep.h. */
#include <string.h>

#include "loop_closure.h"
#include "sweep.h"
#include "sweep_steps.h"

/* Accelerations with their balance, refined where digits are lost. */
static int run_refined(mstmm_state *state)
{
    const real *q = state->q, *u = state->u; /* the passes fill in what is driven */
    if (state->balance) state->balance->power = state->balance->potential = 0;
    mstmm_ground(state);
    const int code = mstmm_run_accelerations(state);
    return code || !state->model->refines ? code : mstmm_refine(state, q, u);
}

int mstmm_accelerations(const mstmm_model *model, real *workspace, real t, const real *q,
                        const real *u, const real *memory, const real *efforts, real *qdot,
                        real *udot, mstmm_balance *balance, mstmm_failure *failure)
{
    /* Every field by name, so that no memset is needed: this is called a million times. */
    mstmm_state state = {.model = model,
                         .workspace = workspace,
                         .t = t,
                         .q = q,
                         .u = u,
                         .memory = memory,
                         .given = NULL,
                         .efforts = efforts,
                         .column = NULL,
                         .qdot = qdot,
                         .udot = udot,
                         .required = NULL,
                         .answer = NULL,
                         .balance = balance,
                         .failure = failure,
                         .linked = !(model->needs_pose || model->product || model->qr),
                         .observed = 0,
                         .hinges_known = 0,
                         .level = 0,
                         .give = 0,
                         .closing = 0,
                         .refined = 0,
                         .asked = NULL,
                         .strike = NULL};
    if (model->flat && !balance && !(model->refines || model->product || model->qr)) {
        mstmm_flat_ground(&state);
        return mstmm_run_accelerations_in_plane(&state);
    }
    return run_refined(&state);
}

int mstmm_accelerations_kept(const mstmm_model *model, real *workspace, real t, const real *q,
                             const real *u, const real *memory, real *qdot, real *udot,
                             mstmm_balance *balance, mstmm_failure *failure)
{
    mstmm_state state = {.model = model,
                         .workspace = workspace,
                         .t = t,
                         .q = q,
                         .u = u,
                         .memory = memory,
                         .qdot = qdot,
                         .udot = udot,
                         .balance = balance,
                         .observed = 1,
                         .failure = failure};
    return run_refined(&state);
}

int mstmm_inverse_dynamics(const mstmm_model *model, real *workspace, real t, const real *q,
                           const real *u, const real *memory, const real *udot, real *efforts,
                           mstmm_failure *failure)
{
    mstmm_state state = {.model = model,
                         .workspace = workspace,
                         .t = t,
                         .q = q,
                         .u = u,
                         .memory = memory,
                         .given = udot,
                         .required = efforts,
                         .failure = failure};
    state.qdot = mstmm_spare_qdot(&state);
    mstmm_ground(&state);
    return mstmm_run_inverse_dynamics(&state);
}

int mstmm_solve(const mstmm_model *model, real *workspace, int64_t n, const real *q,
                const real *memory, const real *columns, real *answers, mstmm_failure *failure)
{
    mstmm_state state = {
        .model = model, .workspace = workspace, .memory = memory, .q = q, .failure = failure};
    real *still = mstmm_filled_u(&state);
    memset(still, 0, (size_t)model->nu * sizeof(real));
    state.u = still;
    state.qdot = mstmm_spare_qdot(&state);
    mstmm_ground(&state);
    int code = mstmm_run_factorisation(&state);
    for (int64_t k = 0; !code && k < n; k++) {
        state.column = columns + k * model->nu;
        state.answer = answers + k * model->nu;
        code = mstmm_run_solution(&state);
    }
    return code;
}
