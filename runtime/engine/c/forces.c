/* Poses, hinge laws, applied loads and force elements. */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "elements.h"
#include "modal.h"
#include "sweep.h"

typedef int (*coordinate_law)(const real *p, const real *q, const real *u, const real *effort,
                              real *tau, real *potential, real *power);
typedef int (*quaternion_law)(const real *p, const real *q, const real *u, const real *axes,
                              const real *effort, const real *reference, real *tau,
                              real *potential, real *power, real *twist);
typedef int (*wrench_kernel)(const real *p, const real *t, const real *effort, const real *axes_f,
                             const real *x_f, const real *v_f, const real *w_f,
                             const real *axes_t, const real *x_t, const real *v_t,
                             const real *w_t, real *force, real *moment, real *potential,
                             real *power);

/* Poses and velocities of P of every body, root to tips, behind a forward pass. */
void mstmm_pose_pass(mstmm_state *state, int hinges_known)
{
    const mstmm_model *model = state->model;
    real *qdot = state->slots + model->tape_slots;
    for (int i = 0; i < model->n_bodies; i++) {
        const mstmm_body *body = &model->bodies[i];
        real *block = state->workspace + body->block;
        const real *parent = mstmm_block(model, state->workspace, body->parent);
        if (mstmm_idle(state, body)) continue;
        if (!body->generic && !hinges_known) mstmm_hinge_motion(state, i, qdot + body->q);
        mstmm_sweep_frames_pose(parent + MSTMM_BLOCK_A, parent + MSTMM_BLOCK_X, block,
                                block + MSTMM_BLOCK_SHIFT, block + MSTMM_BLOCK_A,
                                block + MSTMM_BLOCK_X);
        mstmm_sweep_frames_velocity(block, block + MSTMM_BLOCK_SHIFT, parent + MSTMM_BLOCK_V,
                                    parent + MSTMM_BLOCK_MOTION, block + MSTMM_BLOCK_HINGE_V,
                                    block + MSTMM_BLOCK_V);
    }
}

static real value_at(const mstmm_state *state, int place)
{
    return place < 0 ? 0 : state->values[place];
}

int mstmm_law_pass(mstmm_state *state, mstmm_balance *balance)
{
    const mstmm_model *model = state->model;
    for (int k = 0; k < model->n_laws; k++) {
        const mstmm_law *law = &model->laws[k];
        const mstmm_body *body = &model->bodies[law->body];
        const real *q = state->q + body->q + law->coordinate;
        const real *u = state->u + body->u + law->speed;
        real effort[6], tau[6], potential, power, twist;
        for (int j = 0; j < law->n; j++) effort[j] = value_at(state, law->effort[j]);
        if (law->kind == 0)
            ((coordinate_law)law->evaluate)(law->p, q, u, effort, tau, &potential, &power);
        else
            ((quaternion_law)law->evaluate)(law->p, q, u, law->axes, effort,
                                            state->memory + law->twist, tau, &potential, &power,
                                            &twist);
        real *total = mstmm_tau(state->workspace + body->block, body->nu) + law->speed;
        for (int j = 0; j < law->n; j++) total[j] += tau[j];
        if (balance) {
            balance->potential += potential;
            balance->power += power;
        }
    }
    return 0;
}

static void apply(mstmm_state *state, int index, const real *axes, const real *offset,
                  const real *force, const real *moment)
{
    real *block = mstmm_block(state->model, state->workspace, index);
    mstmm_sweep_frames_applied_load(block + MSTMM_BLOCK_A, axes, offset, force, moment,
                                    block + MSTMM_BLOCK_E);
}

static void point_loads(mstmm_state *state, mstmm_balance *balance)
{
    static const real zero[6] = {0};
    const mstmm_model *model = state->model;
    for (int k = 0; k < model->n_loads; k++) {
        const mstmm_load *load = &model->loads[k];
        real axes[9], force[3], moment[3];
        mstmm_sweep_frames_end_frame(
            mstmm_block(model, state->workspace, load->axes) + MSTMM_BLOCK_A, load->axes_own, axes);
        for (int j = 0; j < 3; j++) {
            force[j] = value_at(state, load->force[j]);
            moment[j] = value_at(state, load->moment[j]);
        }
        apply(state, load->body, axes, load->offset, force, moment);
        if (!balance) continue;
        const real *block = mstmm_block(model, state->workspace, load->body);
        real x[3], v[3], a[3], w[3], alpha[3], power;
        mstmm_sweep_frames_point(block + MSTMM_BLOCK_A, block + MSTMM_BLOCK_X,
                                 block + MSTMM_BLOCK_V, block + MSTMM_BLOCK_MOTION, zero,
                                 load->offset, zero, x, v, a);
        mstmm_sweep_frames_turning(block + MSTMM_BLOCK_A, block + MSTMM_BLOCK_MOTION, zero, w,
                                   alpha);
        mstmm_sweep_frames_power(axes, force, moment, v, w, &power);
        balance->power += power;
    }
}

typedef struct {
    real axes[9], x[3], v[3], w[3];
} end_motion;

static void motion_of_end(mstmm_state *state, int index, const real *own, const real *offset,
                          end_motion *end)
{
    static const real zero[6] = {0};
    const real *block = mstmm_block(state->model, state->workspace, index);
    real a[3], alpha[3];
    mstmm_sweep_frames_end_frame(block + MSTMM_BLOCK_A, own, end->axes);
    mstmm_sweep_frames_point(block + MSTMM_BLOCK_A, block + MSTMM_BLOCK_X, block + MSTMM_BLOCK_V,
                             block + MSTMM_BLOCK_MOTION, zero, offset, zero, end->x, end->v, a);
    mstmm_sweep_frames_turning(block + MSTMM_BLOCK_A, block + MSTMM_BLOCK_MOTION, zero, end->w,
                               alpha);
}

/* Given effort of a force element; code of a tape that failed. */
static int given_effort(mstmm_state *state, const mstmm_force *element, const end_motion *f,
                        const end_motion *t, real *effort)
{
    real length[2];
    *effort = 0;
    if (!element->effort) return 0;
    mstmm_sweep_frames_length(f->x, f->v, t->x, t->v, length);
    const real *inputs[] = {&state->t, state->q, state->u, length};
    real *outputs[] = {effort};
    return mstmm_tape_run(element->effort, inputs, state->slots, outputs);
}

int mstmm_load_pass(mstmm_state *state, mstmm_balance *balance)
{
    static const real identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const mstmm_model *model = state->model;
    mstmm_modal_drag(state, balance);
    point_loads(state, balance);
    for (int k = 0; k < model->n_forces; k++) {
        const mstmm_force *element = &model->forces[k];
        end_motion f, t;
        real effort, force[3], moment[3], back[3], turn[3], potential, power;
        motion_of_end(state, element->body_f, element->axes_f, element->offset_f, &f);
        motion_of_end(state, element->body_t, element->axes_t, element->offset_t, &t);
        int code = given_effort(state, element, &f, &t, &effort);
        if (code) return mstmm_fail(state, MSTMM_FAILED_EXPRESSION, k, code);
        code = ((wrench_kernel)element->wrench)(element->p, &state->t, &effort, f.axes, f.x,
                                                    f.v, f.w, t.axes, t.x, t.v, t.w, force, moment,
                                                    &potential, &power);
        if (code) return mstmm_fail(state, MSTMM_FAILED_FORCE, k, code);
        mstmm_sweep_frames_opposite(f.x, t.x, force, moment, back, turn);
        apply(state, element->body_t, identity, element->offset_t, force, moment);
        apply(state, element->body_f, identity, element->offset_f, back, turn);
        if (balance) {
            balance->potential += potential;
            balance->power += power;
        }
    }
    return 0;
}
