/* Mass matrix, one speed at a time: efforts of its change on the hinges towards the root. */
#include <string.h>

#include "hinge_call.h"
#include "sweep.h"
#include "sweep_steps.h"

static int row_of_speed(mstmm_state *state, int body, int speed, real *matrix)
{
    const mstmm_body *bodies = state->model->bodies;
    const int64_t nu = state->model->nu;
    int code;
    for (int i = body; i >= 0; i = bodies[i].parent)
        memset(mstmm_block(state->model, state->workspace, i) + MSTMM_BLOCK_E, 0, 6 * sizeof(real));
    if ((code = mstmm_at_outboard_load(state, body))) return code;
    for (int i = body; i >= 0; i = bodies[i].parent) {
        if ((code = mstmm_at_hinge_efforts(state, i))) return code;
        for (int k = 0; k < bodies[i].nu; k++) {
            const int64_t other = bodies[i].u + k;
            matrix[other * nu + speed] = matrix[speed * nu + other] = state->required[other];
        }
    }
    return 0;
}

int mstmm_mass_matrix(const mstmm_model *model, real *workspace, const real *q, const real *memory,
                      real *matrix, real *work, mstmm_failure *failure)
{
    const int64_t nu = model->nu;
    mstmm_state state = {
        .model = model, .workspace = workspace, .memory = memory, .q = q, .failure = failure};
    real *still = mstmm_filled_u(&state), *unit = work;
    memset(still, 0, (size_t)nu * sizeof(real));
    memset(unit, 0, (size_t)nu * sizeof(real));
    memset(matrix, 0, (size_t)(nu * nu) * sizeof(real));
    state.u = still;
    state.qdot = mstmm_spare_qdot(&state);
    mstmm_ground(&state);
    int code = mstmm_run_composition(&state);
    state.given = unit;
    state.required = work + nu;
    for (int i = 0; !code && i < model->n_bodies; i++)
        for (int k = 0; !code && k < model->bodies[i].nu; k++) {
            const int speed = model->bodies[i].u + k;
            unit[speed] = 1;
            code = row_of_speed(&state, i, speed, matrix);
            unit[speed] = 0;
        }
    return code;
}
