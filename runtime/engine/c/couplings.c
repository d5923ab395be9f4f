/* Couplings: rows between coordinates of hinges, whose numbers one tape gives; see sweep.h. */
#include "hinge.h"
#include "loops.h"

static real *loops_of(const mstmm_state *state)
{
    return state->workspace + state->model->loops;
}

/* How the rates of a hinge's coordinates change with one of its speeds (d_u) or coordinates. */
static int rates_along(mstmm_state *state, const mstmm_body *body, const real *d_q,
                       const real *d_u, real *rates)
{
    real R[9], d[3], H[36], v[3], w[3], c[6];
    return mstmm_hinge_slope_of(state, body, .p = body->hinge_p, .q = state->q + body->q,
                                .u = state->u + body->u, .d_q = d_q, .d_u = d_u, .d_R = R,
                                .d_d = d, .d_H = H, .d_v = v, .d_w = w, .d_c = c,
                                .d_qdot = rates);
}

static int curved_rates(mstmm_state *state, const mstmm_curved *curved)
{
    const mstmm_body *body = &state->model->bodies[curved->body];
    real along[8] = {0}, *rates = loops_of(state) + curved->rates;
    for (int k = 0; k < body->nu + body->nq; k++, rates += body->nq) {
        const int speed = k < body->nu, at = speed ? k : k - body->nu;
        along[at] = 1;
        const int code = rates_along(state, body, speed ? mstmm_zeros : along,
                                     speed ? along : mstmm_zeros, rates);
        if (code) return mstmm_fail(state, MSTMM_FAILED_HINGE, curved->body, code);
        along[at] = 0;
    }
    return 0;
}

/* Which number of a coupling is the known part of its row. */
static int at_level(const mstmm_state *state)
{
    if (state->level == MSTMM_GAP) return MSTMM_COUPLING_GAP;
    return state->level == MSTMM_SLIP ? MSTMM_COUPLING_SLIP : MSTMM_COUPLING_DRIFT;
}

int mstmm_couplings_begun(mstmm_state *state)
{
    const mstmm_model *model = state->model;
    real *loops = loops_of(state);
    for (int k = 0; k < model->n_curved; k++) {
        const int code = curved_rates(state, &model->curved[k]);
        if (code) return code;
    }
    const real *inputs[] = {&state->t, state->q, state->u, state->qdot,
                            loops + model->curved_rates};
    real *outputs[] = {loops + model->coupling_numbers};
    const int code = mstmm_tape_run(model->coupling_tape, inputs, mstmm_slots(state), outputs);
    if (code) return mstmm_fail(state, MSTMM_FAILED_EXPRESSION, -1, code);
    for (int k = 0; k < model->n_couplings; k++) {
        const mstmm_coupling *one = &model->couplings[k];
        real *numbers = loops + one->numbers;
        numbers[MSTMM_COUPLING_GAP] -= one->kept;
        if (one->row < 0) continue;
        loops[MSTMM_ROW * (int64_t)one->row + MSTMM_ROW_KNOWN] = numbers[at_level(state)];
    }
    return 0;
}

real mstmm_coupling_lack(const mstmm_state *state, const mstmm_coupling *one)
{
    if (one->of_speeds && state->level == MSTMM_GAP) return 0;
    return loops_of(state)[one->numbers + at_level(state)];
}

void mstmm_uncoupled(const mstmm_state *state, int index, real *efforts)
{
    const mstmm_looped *looped = &state->model->looped[index];
    const int nu = state->model->bodies[index].nu;
    const real *loops = loops_of(state);
    for (int k = 0; k < looped->n_pending + looped->n_own; k++) {
        const int own = k - looped->n_pending;
        const int64_t row = own < 0 ? looped->pending[k].row : looped->own[own].row;
        const int64_t tau = own < 0 ? looped->pending[k].tau : looped->own[own].tau;
        for (int j = 0; tau >= 0 && j < nu; j++)
            efforts[j] -= loops[tau + j] * loops[MSTMM_ROW * row + MSTMM_ROW_X];
    }
}
