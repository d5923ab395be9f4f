/* Interpreted hinge kernels, and derivatives of the rates of a hinge by direction; see
 * hinge_call.h. */
#include "hinge_call.h"

#include "derivative_direction.h"

int mstmm_hinge_interpreted(mstmm_state *state, const mstmm_body *body, struct mstmm_hinge_hinge to)
{
    const real *inputs[MSTMM_HINGE_HINGE_INPUTS];
    real *outputs[MSTMM_HINGE_HINGE_OUTPUTS];
    mstmm_hinge_hinge_arrays(to, inputs, outputs);
    return mstmm_tape_run(body->kernels->tape, inputs, mstmm_slots(state), outputs);
}

int mstmm_hinge_slope_interpreted(mstmm_state *state, const mstmm_body *body,
                                  struct mstmm_hinge_hinge_slope to)
{
    const real *inputs[MSTMM_HINGE_HINGE_SLOPE_INPUTS];
    real *outputs[MSTMM_HINGE_HINGE_SLOPE_OUTPUTS];
    mstmm_hinge_hinge_slope_arrays(to, inputs, outputs);
    return mstmm_tape_run(body->kernels->slope_tape, inputs, mstmm_slots(state), outputs);
}

int mstmm_hinge_rates_along(mstmm_state *state, const mstmm_body *body, int of_speeds, real *rows)
{
    const mstmm_state *slope = state->slope;
    real R[9], d[3], H[36], v[3], w[3], c[6];
    int code = 0;
    for (int i = 0; !code && i < (of_speeds ? body->nu : body->nq); i++) {
        if (of_speeds)
            mstmm_aim_rate(state, body, i);
        else
            mstmm_aim_coordinate(state, body, i);
        code = mstmm_hinge_slope_of(state, body, .p = body->hinge_p, .q = state->q + body->q,
                                    .u = state->u + body->u, .d_q = slope->q + body->q,
                                    .d_u = slope->u + body->u, .d_R = R, .d_d = d, .d_H = H,
                                    .d_v = v, .d_w = w, .d_c = c, .d_qdot = rows + i * body->nq);
    }
    mstmm_aim_nowhere(state, body);
    return code;
}
