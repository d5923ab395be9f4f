/* Flexible bodies in the sweep; see modal.h. */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "elements.h"
#include "modal.h"

/* Arrays of a flexible body in the workspace. */
typedef struct {
    real *s_rf, *based, *second, *right, *gain, *s_ff, *work, *e_f, *etadd;
} modal_arrays;

/* Arrays of a section in the workspace. */
typedef struct {
    real *jacobian, *subspace, *push, *h6, *place, *turn, *rate, *turn_rate, *bias, *turn_bias;
} section_arrays;

int64_t mstmm_modal_numbers(int n) { return (int64_t)32 * n + (int64_t)2 * n * n + n + n; }
int64_t mstmm_section_numbers(int n) { return (int64_t)18 * n + 36 + 18; }

static modal_arrays modal_of(const mstmm_state *state, const mstmm_modal *modal)
{
    const size_t n = (size_t)modal->n;
    real *at = state->workspace + modal->place;
    modal_arrays a = {.s_rf = at, .based = at + 6 * n, .second = at + 12 * n,
                      .right = at + 18 * n, .gain = at + 25 * n, .s_ff = at + 32 * n};
    a.work = a.s_ff + n * n;
    a.e_f = a.work + n * n;
    a.etadd = a.e_f + n;
    return a;
}

static section_arrays section_of(const mstmm_state *state, const mstmm_section *section)
{
    const size_t n = (size_t)section->modal->n;
    real *at = state->workspace + section->place, *fixed = at + 18 * n;
    return (section_arrays){.jacobian = at, .subspace = at + 6 * n, .push = at + 12 * n,
                            .h6 = fixed, .place = fixed + 36, .turn = fixed + 39,
                            .rate = fixed + 42, .turn_rate = fixed + 45, .bias = fixed + 48,
                            .turn_bias = fixed + 51};
}

int mstmm_section_motion(mstmm_state *state, int index)
{
    const mstmm_body *body = &state->model->bodies[index];
    const mstmm_section *section = body->section;
    const mstmm_modal *modal = section->modal;
    const section_arrays a = section_of(state, section);
    real *block = state->workspace + body->block, *bias = block + MSTMM_BLOCK_HINGE_C;
    mstmm_sweep_modal_section(modal->n, section->point, section->phi, section->theta,
                              section->drawn[0], section->drawn[1], section->drawn[2],
                              section->turned[0], section->turned[1], section->turned[2],
                              state->q + modal->q, state->u + modal->u, a.jacobian, a.place, a.turn,
                              a.rate, a.turn_rate, a.bias, a.turn_bias);
    int code = (section->inward ? mstmm_sweep_modal_inward : mstmm_sweep_modal_outward)(
        section->end, a.place, a.turn, a.rate, a.turn_rate, a.bias, a.turn_bias,
        block + MSTMM_BLOCK_HINGE_R, block + MSTMM_BLOCK_HINGE_D, a.h6,
        block + MSTMM_BLOCK_HINGE_V, block + MSTMM_BLOCK_HINGE_W, bias);
    if (code) return mstmm_fail(state, MSTMM_FAILED_SECTION, index, code);
    mstmm_sweep_modal_subspace(modal->n, a.h6, a.jacobian, a.subspace);
    if (state->imposed_all) {
        real whole[6];
        mstmm_sweep_modal_imposed(modal->n, a.subspace, state->udot + modal->u, bias, whole);
        memcpy(bias, whole, sizeof whole);
    }
    return 0;
}

/* Loads of prescribed modal accelerations (inverse dynamics). */
static void prescribe(mstmm_state *state, int index)
{
    const mstmm_body *body = &state->model->bodies[index];
    const modal_arrays a = modal_of(state, body->modal);
    mstmm_sweep_modal_prescribed(body->modal->n, a.s_rf, a.s_ff, state->udot + body->modal->u,
                                 state->workspace + body->block + MSTMM_BLOCK_E, a.e_f);
}

int mstmm_modal_forward(mstmm_state *state, int index, real *qdot)
{
    const mstmm_body *body = &state->model->bodies[index];
    const mstmm_modal *modal = body->modal;
    const mstmm_moments *m = &modal->moments;
    const modal_arrays a = modal_of(state, modal);
    real *block = state->workspace + body->block;
    const real *eta = state->q + modal->q, *etad = state->u + modal->u;
    mstmm_sweep_modal_residual(modal->n, m->rigid, m->c, m->p, m->b, m->z[0], m->z[1], m->z[2],
                               m->z[3], m->z[4], m->z[5], m->y[0], m->y[1], m->y[2], m->g[0],
                               m->g[1], m->g[2], m->m, modal->stiffness, modal->damping, eta, etad,
                               block + MSTMM_BLOCK_MOTION, block + MSTMM_BLOCK_S, a.s_rf, a.second,
                               a.s_ff, block + MSTMM_BLOCK_E, a.e_f);
    memcpy(qdot + modal->q, etad, (size_t)modal->n * sizeof(real));
    if (state->imposed_all) prescribe(state, index);
    return 0;
}

int mstmm_modal_condense(mstmm_state *state, int index)
{
    const mstmm_body *body = &state->model->bodies[index];
    const mstmm_modal *modal = body->modal;
    const modal_arrays a = modal_of(state, modal);
    real *block = state->workspace + body->block, *inertia = block + MSTMM_BLOCK_S;
    real *load = block + MSTMM_BLOCK_E, reduced[21], rest[6];
    const real *rows = a.s_rf;
    for (int k = 0; state->efforts && k < modal->n; k++)
        a.e_f[k] -= state->efforts[modal->u + k];
    if (body->section) {
        mstmm_sweep_modal_rebase(modal->n, section_of(state, body->section).subspace, inertia,
                                 load, a.s_rf, a.based, a.s_ff, a.e_f);
        rows = a.based;
    }
    int code = mstmm_sweep_modal_condense(modal->n, inertia, load, rows, a.s_ff, a.e_f, a.right,
                                          a.gain, reduced, rest, a.work);
    if (code) return mstmm_fail(state, MSTMM_FAILED_MODES, index, code);
    memcpy(inertia, reduced, sizeof reduced);
    memcpy(load, rest, sizeof rest);
    return 0;
}

void mstmm_section_absorb(mstmm_state *state, int index)
{
    const mstmm_body *body = &state->model->bodies[index];
    const section_arrays s = section_of(state, body->section);
    const modal_arrays a = modal_of(state, body->section->modal);
    const real *block = state->workspace + body->block;
    mstmm_sweep_modal_absorb(body->section->modal->n, block, block + MSTMM_BLOCK_SHIFT, s.subspace,
                             block + MSTMM_BLOCK_S, block + MSTMM_BLOCK_E, s.push, a.s_rf, a.s_ff,
                             a.e_f);
}

void mstmm_modal_recover(mstmm_state *state, int index, real *udot)
{
    const mstmm_body *body = &state->model->bodies[index];
    const mstmm_modal *modal = body->modal;
    const modal_arrays a = modal_of(state, modal);
    real *delta = state->workspace + body->block + MSTMM_BLOCK_DELTA;
    mstmm_sweep_modal_recover(modal->n, a.gain, delta, a.etadd);
    memcpy(udot + modal->u, a.etadd, (size_t)modal->n * sizeof(real));
    if (body->section) mstmm_section_follow(state, index);
}

void mstmm_section_follow(mstmm_state *state, int index)
{
    const mstmm_body *body = &state->model->bodies[index];
    const mstmm_section *section = body->section;
    real *delta = state->workspace + body->block + MSTMM_BLOCK_DELTA, whole[6];
    mstmm_sweep_modal_displaced(section->modal->n, section_of(state, section).subspace,
                                modal_of(state, section->modal).etadd, delta, whole);
    memcpy(delta, whole, sizeof whole);
}

void mstmm_section_effort(mstmm_state *state, int index)
{
    const mstmm_body *body = &state->model->bodies[index];
    const mstmm_section *section = body->section;
    const modal_arrays a = modal_of(state, section->modal);
    mstmm_sweep_modal_modal_effort(section->modal->n, section_of(state, section).subspace,
                                   state->workspace + body->block + MSTMM_BLOCK_E, a.e_f, a.etadd);
    memcpy(a.e_f, a.etadd, (size_t)section->modal->n * sizeof(real));
}

void mstmm_modal_effort(mstmm_state *state, int index, real *efforts)
{
    const mstmm_body *body = &state->model->bodies[index];
    if (body->section) mstmm_section_effort(state, index);
    memcpy(efforts + body->modal->u, modal_of(state, body->modal).e_f,
           (size_t)body->modal->n * sizeof(real));
}

/* Momentum under one density: frame part (6), modal part (n), mass matrix, energy. */
static void momentum_of(const mstmm_state *state, int index, const mstmm_moments *m, real *inertia,
                        real *momentum, real *own, real *energy)
{
    const mstmm_body *body = &state->model->bodies[index];
    const mstmm_modal *modal = body->modal;
    const modal_arrays a = modal_of(state, modal);
    const real *block = state->workspace + body->block;
    /* `based` and `second` are free here: before a sweep it writes them anew, behind it nobody reads. */
    mstmm_sweep_modal_momentum(modal->n, m->rigid, m->c, m->p, m->b, m->z[0], m->z[1], m->z[2],
                               m->z[3], m->z[4], m->z[5], m->y[0], m->y[1], m->y[2], m->g[0],
                               m->g[1], m->g[2], m->m, state->q + modal->q, state->u + modal->u,
                               block + MSTMM_BLOCK_V, block + MSTMM_BLOCK_MOTION, inertia,
                               a.based, a.second, momentum, own, energy);
}

void mstmm_modal_momentum(const mstmm_state *state, int index, real *inertia, real *momentum,
                          real *energy)
{
    const mstmm_modal *modal = state->model->bodies[index].modal;
    momentum_of(state, index, &modal->moments, inertia, momentum, modal_of(state, modal).right,
                energy);
}

void mstmm_modal_drag(mstmm_state *state, mstmm_balance *balance)
{
    const mstmm_model *model = state->model;
    if (!model->n_flexible) return;
    for (int i = 0; i < model->n_bodies; i++) {
        const mstmm_modal *modal = model->bodies[i].modal;
        if (!modal || !modal->drag) continue;
        const modal_arrays a = modal_of(state, modal);
        real inertia[21], load[6], energy;
        real *e = state->workspace + model->bodies[i].block + MSTMM_BLOCK_E;
        momentum_of(state, i, modal->drag, inertia, load, a.right, &energy);
        for (int j = 0; j < 6; j++) e[j] += load[j];
        for (int k = 0; k < modal->n; k++) a.e_f[k] += a.right[k];
        if (balance) balance->power -= 2 * energy;
    }
}

void mstmm_modal_balance(const mstmm_state *state, mstmm_balance *balance)
{
    const mstmm_model *model = state->model;
    if (!model->n_flexible) return;
    for (int i = 0; i < model->n_bodies; i++) {
        const mstmm_modal *modal = model->bodies[i].modal;
        if (!modal) continue;
        real stored, lost;
        mstmm_sweep_modal_strain_energy(modal->n, modal->stiffness, modal->damping,
                                        state->q + modal->q, state->u + modal->u, &stored, &lost);
        balance->potential += stored;
        balance->power -= lost;
    }
}
