/* Motions of points at given states; see kinematics.h. */
#include "kinematics.h"

#include <string.h>

#include "finite.h"
#include "kernel_calls.h"
#include "sweep_steps.h"

static mstmm_state state_of(const mstmm_kinematics *known, const real *q, const real *u,
                            const real *udot, mstmm_failure *failure)
{
    mstmm_state state = {.model = known->model, .workspace = known->workspace,
                         .memory = known->memory, .q = q, .u = u, .given = udot,
                         .required = known->work, .observed = 1, .failure = failure};
    state.qdot = mstmm_spare_qdot(&state);
    mstmm_ground(&state);
    return state;
}

int mstmm_moving_points(const mstmm_kinematics *known, int64_t n, const void *q, const void *u,
                        const void *udot, int n_probes, const mstmm_probe *probes, real *points,
                        mstmm_failure *failure)
{
    const mstmm_model *model = known->model;
    if (!mstmm_finite(n * model->nq, q) || !mstmm_finite(n * model->nu, u)) return MSTMM_NO_NUMBER;
    for (int64_t k = 0; k < n; k++) {
        mstmm_state state = state_of(known, (const real *)q + k * model->nq,
                                     (const real *)u + k * model->nu,
                                     (const real *)udot + k * model->nu, failure);
        const int code = mstmm_run_motion(&state);
        if (code) return code;
        for (int i = 0; i < n_probes; i++)
            mstmm_point_shown(&state, &probes[i], mstmm_zeros,
                              points + ((size_t)k * (size_t)n_probes + (size_t)i) * MSTMM_PROBE_NUMBERS);
    }
    return 0;
}

/* What the speeds on the way to the root feel of a unit force, or moment, against an inertial axis. */
static int felt_on_the_way(mstmm_state *state, const mstmm_probe *probe, int direction, real *row)
{
    const mstmm_body *bodies = state->model->bodies;
    real load[6] = {0};
    load[direction] = -1;
    for (int i = probe->body; i >= 0; i = bodies[i].parent)
        memset(mstmm_block(state->model, state->workspace, i) + MSTMM_BLOCK_E, 0,
               6 * sizeof(real));
    real *block = mstmm_block(state->model, state->workspace, probe->body);
    mstmm_frames_applied_load(.A = block + MSTMM_BLOCK_A, .A_F = mstmm_identity,
                              .offset = probe->offset, .F = load, .M = load + 3,
                              .e = block + MSTMM_BLOCK_E);
    for (int i = probe->body; i >= 0; i = bodies[i].parent) {
        const int code = mstmm_at_felt_by(state, i);
        if (code) return code;
        for (int k = 0; k < bodies[i].nu; k++)
            row[bodies[i].u + k] = state->required[bodies[i].u + k];
    }
    return 0;
}

int mstmm_jacobians(const mstmm_kinematics *known, const void *q, int n_probes,
                    const mstmm_probe *probes, real *rows, mstmm_failure *failure)
{
    const int64_t nu = known->model->nu;
    if (!mstmm_finite(known->model->nq, q)) return MSTMM_NO_NUMBER;
    mstmm_state state = state_of(known, q, known->none, known->none, failure);
    memset(rows, 0, (size_t)(6 * n_probes * nu) * sizeof(real));
    int code = mstmm_run_motion(&state);
    for (int i = 0; i < n_probes; i++)
        for (int k = 0; !code && k < 6 && probes[i].body >= 0; k++)
            code = felt_on_the_way(&state, &probes[i], k, rows + (6 * i + k) * nu);
    return code;
}
