/* Passes of the looped engine; see sweep.h. */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "elements.h"
#include "links.h"
#include "modal.h"
#include "sweep.h"

typedef int (*forward_kernel)(const real *rt, const real *ro, const real *p, const real *q,
                              const real *u, const real *s, const real *parent, real *rotation,
                              real *shift, real *motion, real *qdot);
typedef int (*condense_kernel)(const real *rotation, const real *shift, const real *p,
                               const real *q, const real *floor, const real *inertia,
                               const real *load, const real *tau, real *gain, real *offset,
                               real *parent_inertia, real *parent_load);
typedef int (*recover_kernel)(const real *rotation, const real *shift, const real *p,
                              const real *q, const real *gain, const real *offset,
                              const real *parent, real *udot, real *deviation);
typedef int (*hinge_kernel)(const real *p, const real *q, const real *u, real *rotation,
                            real *position, real *subspace, real *velocity, real *spin, real *bias,
                            real *qdot);
typedef int (*generic_forward_kernel)(const real *rt, const real *ro, const real *rotation,
                                      const real *position, const real *subspace,
                                      const real *velocity, const real *spin, const real *bias,
                                      const real *s, const real *parent, real *body_rotation,
                                      real *shift, real *motion);
typedef int (*generic_condense_kernel)(const real *rotation, const real *shift,
                                       const real *subspace, const real *rotor,
                                       const real *floor, const real *inertia,
                                       const real *load, const real *tau, real *gain,
                                       real *offset, real *parent_inertia, real *parent_load);
typedef int (*generic_recover_kernel)(const real *rotation, const real *shift,
                                      const real *subspace, const real *gain, const real *offset,
                                      const real *parent, real *udot, real *deviation);
typedef int (*effort_kernel)(const real *subspace, const real *load, real *tau);
typedef int (*project_kernel)(const real *rotation, const real *shift, const real *subspace,
                              const real *deviation, const real *parent, real *udot);
typedef int (*inertia_kernel)(const real *p, real *inertia);
typedef int (*bias_load_kernel)(const real *p, const real *motion, real *load);

/* The kernels of one step for hinges with 0 to 6 free speeds. */
#define BY_SPEEDS(step)                                                                            \
    {mstmm_sweep_generic0_##step, mstmm_sweep_generic1_##step, mstmm_sweep_generic2_##step,        \
     mstmm_sweep_generic3_##step, mstmm_sweep_generic4_##step, mstmm_sweep_generic5_##step,        \
     mstmm_sweep_generic6_##step}

static const generic_forward_kernel generic_forward[] = BY_SPEEDS(forward);
static const generic_condense_kernel generic_condense[] = BY_SPEEDS(condense);
static const generic_recover_kernel generic_recover[] = BY_SPEEDS(recover);
static const project_kernel generic_project[] = BY_SPEEDS(project);
static const effort_kernel generic_effort[] = BY_SPEEDS(effort);

int mstmm_fail(mstmm_state *state, int reason, int element, int code)
{
    if (state->failure) {
        state->failure->reason = reason;
        state->failure->element = element;
        state->failure->code = code;
    }
    return reason;
}

void mstmm_effort(int nu, const real *subspace, const real *load, real *tau)
{
    generic_effort[nu](subspace, load, tau);
}

int mstmm_project(int nu, const real *rotation, const real *shift, const real *subspace,
                  const real *deviation, const real *parent, real *udot)
{
    return generic_project[nu](rotation, shift, subspace, deviation, parent, udot);
}

/* Where a body reads the prescribed accelerations: from udot, from a drive, or zero. */
static void fill_imposed(mstmm_state *state)
{
    const mstmm_model *model = state->model;
    for (int k = 0; k < model->n_runs; k++) {
        const mstmm_branch *run = &model->runs[k];
        if (state->linked && run->numbers) continue;
        for (int i = run->first; i < run->first + run->count; i++) {
            const mstmm_body *body = &model->bodies[i];
            real *s = mstmm_s(state->workspace + body->block, body->nu);
            if (state->imposed_all)
                memcpy(s, state->udot + body->u, (size_t)body->nu * sizeof(real));
            else
                memset(s, 0, (size_t)body->nu * sizeof(real));
        }
    }
}

static int fill_drives(mstmm_state *state, real *q, real *u)
{
    const mstmm_model *model = state->model;
    const real *inputs[] = {&state->t};
    real *drives = state->values + model->n_values;
    real *outputs[] = {drives};
    int code = mstmm_tape_run(model->drive_tape, inputs, state->slots, outputs);
    if (code) return mstmm_fail(state, MSTMM_FAILED_EXPRESSION, -1, code);
    for (int k = 0; k < model->n_drives; k++) {
        const mstmm_drive *drive = &model->drives[k];
        const mstmm_body *body = &model->bodies[drive->body];
        if (!mstmm_imposed(body, state->memory)) continue;
        q[body->q + drive->coordinate] = drives[3 * k];
        u[body->u + drive->speed] = drives[3 * k + 1];
        if (!state->imposed_all)
            mstmm_s(state->workspace + body->block, body->nu)[drive->speed] = drives[3 * k + 2];
    }
    return 0;
}

int mstmm_state_begin(mstmm_state *state, const real *q, const real *u)
{
    const mstmm_model *model = state->model;
    real *ground = state->workspace, *scratch = state->workspace + model->scratch;
    memset(ground, 0, MSTMM_BLOCK_FIXED * sizeof(real));
    for (int i = 0; i < 3; i++) {
        ground[MSTMM_BLOCK_MOTION + 6 + i] = -model->gravity[i];
        ground[MSTMM_BLOCK_A + 4 * i] = 1;
    }
    state->q = q;
    state->u = u;
    state->values = scratch + model->nq + model->nu;
    state->slots = state->values + model->n_values + 3 * model->n_drives;
    fill_imposed(state);
    if (model->n_drives) {
        memcpy(scratch, q, (size_t)model->nq * sizeof(real));
        memcpy(scratch + model->nq, u, (size_t)model->nu * sizeof(real));
        int code = fill_drives(state, scratch, scratch + model->nq);
        if (code) return code;
        state->q = scratch;
        state->u = scratch + model->nq;
    }
    if (model->n_values) {
        const real *inputs[] = {&state->t, state->q, state->u};
        real *outputs[] = {state->values};
        int code = mstmm_tape_run(model->value_tape, inputs, state->slots, outputs);
        if (code) return mstmm_fail(state, MSTMM_FAILED_EXPRESSION, -1, code);
    }
    return 0;
}

int mstmm_hinge_motion(mstmm_state *state, int index, real *qdot)
{
    const mstmm_body *body = &state->model->bodies[index];
    real *block = state->workspace + body->block;
    const real *q = state->q + body->q, *u = state->u + body->u;
    real *outputs[] = {block + MSTMM_BLOCK_HINGE_R, block + MSTMM_BLOCK_HINGE_D,
                       mstmm_h(block, body->nu),    block + MSTMM_BLOCK_HINGE_V,
                       block + MSTMM_BLOCK_HINGE_W, block + MSTMM_BLOCK_HINGE_C, qdot};
    int code;
    if (body->tape) {
        const real *inputs[] = {body->hinge_p, q, u};
        code = mstmm_tape_run(body->tape, inputs, state->slots, outputs);
    } else {
        code = ((hinge_kernel)body->hinge)(body->hinge_p, q, u, outputs[0], outputs[1], outputs[2],
                                           outputs[3], outputs[4], outputs[5], qdot);
    }
    return code ? mstmm_fail(state, MSTMM_FAILED_HINGE, index, code) : 0;
}

/* Bias motion, own inertia and own load of one body. */
int mstmm_forward_body(mstmm_state *state, int i, const real *parent_motion, real *qdot)
{
    const mstmm_body *body = &state->model->bodies[i];
    real *block = state->workspace + body->block;
    const real *rt = body->connection, *ro = body->connection + 9;
    real *s = mstmm_s(block, body->nu), *motion = block + MSTMM_BLOCK_MOTION;
    int code;
    if (mstmm_idle(state, body)) return 0;
    if (body->generic) {
        code = body->section ? mstmm_section_motion(state, i)
                             : mstmm_hinge_motion(state, i, qdot + body->q);
        if (code) return code;
        code = generic_forward[body->nu](
            rt, ro, block + MSTMM_BLOCK_HINGE_R, block + MSTMM_BLOCK_HINGE_D,
            mstmm_h(block, body->nu), block + MSTMM_BLOCK_HINGE_V, block + MSTMM_BLOCK_HINGE_W,
            block + MSTMM_BLOCK_HINGE_C, s, parent_motion, block, block + MSTMM_BLOCK_SHIFT,
            motion);
    } else {
        code = ((forward_kernel)body->forward)(rt, ro, body->hinge_p, state->q + body->q,
                                               state->u + body->u, s, parent_motion, block,
                                               block + MSTMM_BLOCK_SHIFT, motion, qdot + body->q);
    }
    if (code) return mstmm_fail(state, MSTMM_FAILED_HINGE, i, code);
    if (body->modal) {
        code = mstmm_modal_forward(state, i, qdot);
        if (code) return code;
    } else {
        ((inertia_kernel)body->inertia)(body->body_p, block + MSTMM_BLOCK_S);
        ((bias_load_kernel)body->bias_load)(body->body_p, motion, block + MSTMM_BLOCK_E);
    }
    mstmm_sweep_frames_pivot_floor(block + MSTMM_BLOCK_S, block + MSTMM_BLOCK_FLOOR);
    return 0;
}

int mstmm_forward_pass(mstmm_state *state, real *qdot)
{
    const mstmm_model *model = state->model;
    for (int i = 0; i < model->n_bodies; i++) {
        const real *parent = mstmm_block(model, state->workspace, model->bodies[i].parent);
        int code = mstmm_forward_body(state, i, parent + MSTMM_BLOCK_MOTION, qdot);
        if (code) return code;
    }
    return 0;
}

/* H, efforts and rotor inertia of the speeds that are not imposed, packed together. */
static int pack_free(mstmm_state *state, const mstmm_body *body, real *block, real *tau,
                     real *rotor)
{
    const int imposed = mstmm_imposed(body, state->memory), nu = body->nu;
    const real *h = mstmm_h(block, nu), *given = mstmm_tau(block, nu);
    const int *mask = body->imposed_mask;
    real *packed = mstmm_h_free(block, nu);
    int columns[6], n = 0;
    for (int j = 0; j < nu; j++)
        if (!imposed || !mask[j]) columns[n++] = j;
    for (int k = 0; k < n; k++) {
        tau[k] = given[columns[k]];
        rotor[k] = body->rotor[columns[k]];
        for (int row = 0; row < 6; row++) packed[row * n + k] = h[row * nu + columns[k]];
    }
    return n;
}

/* S and e of one body, complete, carried to its parent. */
int mstmm_condense_body(mstmm_state *state, int i)
{
    const mstmm_model *model = state->model;
    const mstmm_body *body = &model->bodies[i];
    real *block = state->workspace + body->block;
    real *parent = mstmm_block(model, state->workspace, body->parent);
    real *gain = mstmm_gain(block, body->nu), *offset = mstmm_g(block, body->nu);
    int code;
    if (mstmm_idle(state, body)) return 0;
    if (body->modal) {
        code = mstmm_modal_condense(state, i);
        if (code) return code;
    }
    if (body->section && !body->section->inward) mstmm_section_absorb(state, i);
    if (body->generic) {
        real tau[6], rotor[6];
        int n = pack_free(state, body, block, tau, rotor);
        code = generic_condense[n](block, block + MSTMM_BLOCK_SHIFT, mstmm_h_free(block, body->nu),
                                   rotor, block + MSTMM_BLOCK_FLOOR, block + MSTMM_BLOCK_S,
                                   block + MSTMM_BLOCK_E, tau, gain, offset, parent + MSTMM_BLOCK_S, parent + MSTMM_BLOCK_E);
    } else {
        code = ((condense_kernel)body->condense)(
            block, block + MSTMM_BLOCK_SHIFT, body->hinge_p, state->q + body->q,
            block + MSTMM_BLOCK_FLOOR, block + MSTMM_BLOCK_S, block + MSTMM_BLOCK_E,
            mstmm_tau(block, body->nu), gain, offset, parent + MSTMM_BLOCK_S, parent + MSTMM_BLOCK_E);
    }
    return code ? mstmm_fail(state, MSTMM_FAILED_UNDETERMINED, i, code) : 0;
}

/* Accelerations of one body. */
void mstmm_recover_body(mstmm_state *state, int i, const real *parent_delta, real *udot)
{
    const mstmm_body *body = &state->model->bodies[i];
    real *block = state->workspace + body->block;
    const real *gain = mstmm_gain(block, body->nu), *offset = mstmm_g(block, body->nu);
    if (mstmm_idle(state, body)) return;
    if (!body->generic) {
        ((recover_kernel)body->recover)(block, block + MSTMM_BLOCK_SHIFT, body->hinge_p,
                                        state->q + body->q, gain, offset, parent_delta,
                                        udot + body->u, block + MSTMM_BLOCK_DELTA);
        if (body->modal) mstmm_modal_recover(state, i, udot);
        return;
    }
    const int imposed = mstmm_imposed(body, state->memory);
    const real *s = mstmm_s(block, body->nu);
    real *free_rates = mstmm_free(block, body->nu);
    int n = 0;
    for (int j = 0; j < body->nu; j++) n += !imposed || !body->imposed_mask[j];
    generic_recover[n](block, block + MSTMM_BLOCK_SHIFT, mstmm_h_free(block, body->nu), gain,
                       offset, parent_delta, free_rates, block + MSTMM_BLOCK_DELTA);
    for (int j = 0, k = 0; j < body->nu; j++)
        udot[body->u + j] = imposed && body->imposed_mask[j] ? s[j] : free_rates[k++];
    if (body->modal)
        mstmm_modal_recover(state, i, udot);
    else if (body->section)
        mstmm_section_follow(state, i);
}

/* S and e of every subtree, tips to root; accelerations, root to tips. */
static int condense_and_recover(mstmm_state *state, real *udot)
{
    const mstmm_model *model = state->model;
    for (int i = model->n_bodies - 1; i >= 0; i--) {
        int code = mstmm_condense_body(state, i);
        if (code) return code;
    }
    for (int i = 0; i < model->n_bodies; i++) {
        const real *parent = mstmm_block(model, state->workspace, model->bodies[i].parent);
        mstmm_recover_body(state, i, parent + MSTMM_BLOCK_DELTA, udot);
    }
    return 0;
}

/* Power that drives and holds feed in: tau_d . u_d with tau_d = H_d^T f + J udot - given. */
static void drive_power(mstmm_state *state, const real *udot, mstmm_balance *balance)
{
    const mstmm_model *model = state->model;
    for (int i = 0; i < model->n_bodies; i++) {
        const mstmm_body *body = &model->bodies[i];
        if (!mstmm_imposed(body, state->memory)) continue;
        real *block = state->workspace + body->block;
        real load[6], force[3], moment[3], tau[6];
        mstmm_sweep_frames_reaction(block + MSTMM_BLOCK_S, block + MSTMM_BLOCK_E,
                                    block + MSTMM_BLOCK_DELTA, state->workspace + MSTMM_BLOCK_A,
                                    load, force, moment);
        generic_effort[body->nu](mstmm_h(block, body->nu), load, tau);
        for (int j = 0; j < body->nu; j++)
            if (body->imposed_mask[j])
                balance->power += (tau[j] + body->rotor[j] * udot[body->u + j] -
                                   mstmm_tau(block, body->nu)[j]) *
                                  state->u[body->u + j];
    }
}

/* Efforts of the caller where the sweep reads them.  Linked runs without laws read `efforts`. */
static void set_efforts(mstmm_state *state, const real *efforts, mstmm_balance *balance)
{
    const mstmm_model *model = state->model;
    state->efforts = efforts;
    for (int j = 0; balance && efforts && j < model->nu; j++)
        balance->power += efforts[j] * state->u[j];
    for (int k = 0; k < model->n_runs; k++) {
        const mstmm_branch *run = &model->runs[k];
        if (state->linked && run->numbers && !model->n_laws) continue;
        for (int i = run->first; i < run->first + run->count; i++) {
            const mstmm_body *body = &model->bodies[i];
            real *tau = mstmm_tau(state->workspace + body->block, body->nu);
            for (int j = 0; j < body->nu; j++) tau[j] = efforts ? efforts[body->u + j] : 0;
        }
    }
}

/* Applied loads alone, per body (6 numbers, body axes): what the load pass took from e. */
static int load_pass(mstmm_state *state, mstmm_balance *balance, real *applied)
{
    const mstmm_model *model = state->model;
    for (int i = 0; applied && i < model->n_bodies; i++)
        memcpy(applied + 6 * i, state->workspace + model->bodies[i].block + MSTMM_BLOCK_E,
               6 * sizeof(real));
    int code = model->needs_pose ? mstmm_load_pass(state, balance) : 0;
    for (int i = 0; applied && i < model->n_bodies; i++) {
        const real *load = state->workspace + model->bodies[i].block + MSTMM_BLOCK_E;
        for (int j = 0; j < 6; j++) applied[6 * i + j] -= load[j];
    }
    return code;
}

/* Largest deviation of the product from the Riccati sweep; keeps the product's values. */
static int compare_product(mstmm_state *state, const real *product, real *udot)
{
    const mstmm_product *check = state->model->product;
    real gap = 0, size = 0;
    int worst = 0;
    for (int i = 0; i < state->model->nu; i++) {
        real here = fabs(product[i] - udot[i]);
        if (!(here <= gap)) {
            gap = here;
            worst = i;
        }
        if (fabs(udot[i]) > size) size = fabs(udot[i]);
        udot[i] = product[i];
    }
    real relative = size > 0 ? gap / size : gap;
    return relative <= check->accuracy
               ? 0
               : mstmm_fail(state, MSTMM_FAILED_PRODUCT_ERROR, worst, MSTMM_FAILED_PRODUCT_ERROR);
}

/* Forward pass, efforts, loads. */
static int load_bodies(mstmm_state *state, const real *efforts, real *qdot, real *applied,
                       mstmm_balance *balance)
{
    const mstmm_model *model = state->model;
    int code = state->linked ? mstmm_linked_forward(state, qdot) : mstmm_forward_pass(state, qdot);
    if (code) return code;
    if (balance) balance->power = balance->potential = 0;
    set_efforts(state, efforts, balance);
    code = mstmm_law_pass(state, balance);
    if (code) return code;
    if (balance) mstmm_modal_balance(state, balance);
    if (!(model->needs_pose || model->product)) return 0;
    mstmm_pose_pass(state, 0);
    return load_pass(state, balance, applied);
}

static int sweep(mstmm_state *state, const real *q, const real *u, const real *efforts, real *qdot,
                 real *udot, mstmm_balance *balance)
{
    const mstmm_model *model = state->model;
    const mstmm_product *check = model->product;
    real *applied = NULL, *product = NULL;
    if (check) {
        real *numbers = state->workspace + check->place;
        applied = numbers + (size_t)MSTMM_PRODUCT_MATRICES * model->n_bodies;
        product = numbers + (size_t)MSTMM_PRODUCT_PER_BODY * model->n_bodies;
    }
    int code = mstmm_state_begin(state, q, u);
    if (code) return code;
    code = load_bodies(state, efforts, qdot, applied, balance);
    if (code) return code;
    if (check) {
        code = mstmm_product_pass(state, applied, product);
        if (code) return code;
    }
    code = state->linked ? mstmm_linked_sweep(state, udot) : condense_and_recover(state, udot);
    if (code) return code;
    if (balance) drive_power(state, udot, balance);
    return check ? compare_product(state, product, udot) : 0;
}

int mstmm_accelerations(const mstmm_model *model, real *workspace, real t, const real *q,
                        const real *u, const real *memory, const real *efforts, real *qdot,
                        real *udot, mstmm_balance *balance, mstmm_failure *failure)
{
    mstmm_state state = {.model = model, .workspace = workspace, .t = t, .memory = memory,
                         .linked = !(model->needs_pose || model->product), .failure = failure};
    return sweep(&state, q, u, efforts, qdot, udot, balance);
}

int mstmm_accelerations_kept(const mstmm_model *model, real *workspace, real t, const real *q,
                             const real *u, const real *memory, real *qdot, real *udot,
                             mstmm_balance *balance, mstmm_failure *failure)
{
    mstmm_state state = {.model = model, .workspace = workspace, .t = t, .memory = memory,
                         .observed = 1, .failure = failure};
    return sweep(&state, q, u, NULL, qdot, udot, balance);
}

int mstmm_inverse_dynamics(const mstmm_model *model, real *workspace, real t, const real *q,
                           const real *u, const real *memory, const real *udot, real *efforts,
                           mstmm_failure *failure)
{
    mstmm_state state = {.model = model, .workspace = workspace, .t = t, .memory = memory,
                         .imposed_all = 1, .udot = udot, .failure = failure};
    int code = mstmm_state_begin(&state, q, u);
    real *qdot = state.slots + model->tape_slots;
    if (code) return code;
    code = mstmm_forward_pass(&state, qdot);
    if (code) return code;
    set_efforts(&state, NULL, NULL);
    code = mstmm_law_pass(&state, NULL);
    if (code) return code;
    if (model->needs_pose) {
        mstmm_pose_pass(&state, 0);
        code = mstmm_load_pass(&state, NULL);
        if (code) return code;
    }
    for (int i = model->n_bodies - 1; i >= 0; i--) {
        const mstmm_body *body = &model->bodies[i];
        real *block = workspace + body->block, *load = block + MSTMM_BLOCK_E;
        const real *tau = mstmm_tau(block, body->nu);
        if (mstmm_idle(&state, body)) continue;
        if (body->section && !body->section->inward) mstmm_section_effort(&state, i);
        if (body->modal) mstmm_modal_effort(&state, i, efforts);
        if (!body->generic) {
            code = mstmm_hinge_motion(&state, i, qdot + body->q);
            if (code) return code;
        }
        generic_effort[body->nu](mstmm_h(block, body->nu), load, efforts + body->u);
        for (int j = 0; j < body->nu; j++)
            efforts[body->u + j] += body->rotor[j] * udot[body->u + j] - tau[j];
        real *parent = mstmm_block(model, workspace, body->parent);
        mstmm_sweep_frames_transport(block, block + MSTMM_BLOCK_SHIFT, load,
                                     parent + MSTMM_BLOCK_E);
    }
    return 0;
}
