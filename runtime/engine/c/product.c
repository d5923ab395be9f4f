/* The classical method: overall transfer matrix of a chain as the plain product of its elements'
 * matrices, boundary conditions at both ends, accelerations read from the states along the way.
 * Rui, Wang, Zhang, ch. 5, (5.8), (5.9) and section 5.9.  The matrices are generated; this file
 * multiplies them. */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "kernel_calls.h"
#include "product.h"
#include "sweep_steps.h"

/* Relative accelerations of an open chain that are rounding if closing its loops cancels them, as
 * at rest. */
#define CANCELLED 1e-13

static void multiply(const real *a, const real *b, real *out)
{
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            real sum = 0;
            for (int k = 0; k < N; k++) sum += a[N * i + k] * b[N * k + j];
            out[N * i + j] = sum;
        }
}

static void apply(const real *a, const real *z, real *out)
{
    for (int i = 0; i < N; i++) {
        out[i] = 0;
        for (int k = 0; k < N; k++) out[i] += a[N * i + k] * z[k];
    }
}

/* With `alone`, nothing rotates and only `applied` acts. */
static void body_matrix(const mstmm_state *state, int index, const real *applied, int alone,
                        real *store)
{
    static const real nowhere[3] = {0};
    const mstmm_model *model = state->model;
    const mstmm_body *body = &model->bodies[index];
    const real *block = state->workspace + body->block;
    const int next = mstmm_product_next(model, index);
    const real *output = next < 0 ? nowhere : model->bodies[next].connection + 9;
    real mass[1], r_io[3], r_ic[3], inertia[6], omega[3], force[3], moment[3];
    mstmm_frames_classical_body(.A = block + MSTMM_BLOCK_A, .p = body->body_p,
                                .motion = alone ? mstmm_zeros : block + MSTMM_BLOCK_MOTION,
                                .load = applied,
                                .ro_n = output, .M = mass, .r_IO = r_io, .r_IC = r_ic,
                                .J_I = inertia, .omega = omega, .f_C = force, .m_C = moment);
    mstmm_classical_body_transfer(.M = mass, .r_IO = r_io, .r_IC = r_ic, .J_I = inertia,
                                  .omega = omega, .f_C = force, .m_C = moment, .U = store + BODY,
                                  .F_scale = store + SCALE);
}

static int hinge_matrix(const mstmm_state *state, int index, int alone, real *store)
{
    const mstmm_model *model = state->model;
    const mstmm_body *body = &model->bodies[index];
    const int next = mstmm_product_next(model, index);
    real axis[3], next_axis[3], offset[3], next_offset[3] = {0}, tau[6] = {0}, omega[3], margin;
    const real *parent = mstmm_block(model, state->workspace, body->parent);
    switch (model->product->kind) {
    case MSTMM_PRODUCT_PIN:
        mstmm_product_axis(state, index, axis);
        mstmm_product_axis(state, next < 0 ? index : next, next_axis);
        if (next >= 0 && !alone) tau[0] = *mstmm_product_tau(state, next);
        mstmm_frames_turned(.A = parent + MSTMM_BLOCK_A,
                            .b = alone ? mstmm_zeros : parent + MSTMM_BLOCK_MOTION, .b_0 = omega);
        return mstmm_classical_pin_transfer(
            .U = store + BODY, .F_scale = store + SCALE, .a = axis, .u = state->u + body->u,
            .omega_I = omega, .a_n = next_axis, .tau_n = tau, .U_h = store + HINGE,
            .margin = &margin);
    case MSTMM_PRODUCT_BALL:
        if (next >= 0 && !alone) mstmm_product_efforts(state, next, NULL, tau);
        return mstmm_classical_ball_transfer(.U = store + BODY, .F_scale = store + SCALE,
                                             .tau_n = tau, .U_h = store + HINGE,
                                             .margin = &margin);
    default:
        mstmm_product_offset(state, index, offset);
        if (next >= 0) {
            mstmm_product_offset(state, next, next_offset);
            if (!alone) mstmm_product_efforts(state, next, tau, tau + 3);
        }
        return mstmm_classical_acceleration_transfer(
            .U = store + BODY, .F_scale = store + SCALE, .d = offset, .d_n = next_offset,
            .tau_n = tau, .U_h = store + HINGE, .margin = &margin);
    }
}

/* Load on a body: what acts, and what the multipliers of closed loops put there. */
static void load_on(const mstmm_state *state, int index, int which, real *load)
{
    const mstmm_model *model = state->model;
    memset(load, 0, 6 * sizeof(real));
    if (which < 0) memcpy(load, mstmm_product_numbers(state, index) + LOAD, 6 * sizeof(real));
    for (int i = 0; i < model->n_bodies && which != ACTING && model->looped; i++) {
        const mstmm_closure *closure = model->looped[i].closure;
        if (!closure) continue;
        const int inner = model->bodies[i].parent == index;
        if (!inner && closure->outboard != index) continue;
        const real *columns = state->workspace + model->loops + closure->numbers +
                              (inner ? MSTMM_CLOSURE_J_A : MSTMM_CLOSURE_J_B);
        for (int c = 0; c < 6; c++) {
            const int row = closure->rows[c];
            if (row < 0 || (which >= 0 && which != row)) continue;
            const real x = which < 0 ? mstmm_product_multipliers(state)[row] : 1;
            for (int j = 0; j < 6; j++) load[j] -= columns[6 * c + j] * x;
        }
    }
}

/* Overall matrix of the chain, those of its elements kept. */
static int multiplied(mstmm_state *state, int which, real *overall)
{
    real step[N * N], load[6];
    memset(overall, 0, N * N * sizeof(real));
    for (int i = 0; i < N; i++) overall[(N + 1) * i] = 1;
    for (int i = mstmm_product_next(state->model, -1); i >= 0;
         i = mstmm_product_next(state->model, i)) {
        real *store = mstmm_product_numbers(state, i);
        load_on(state, i, which, load);
        body_matrix(state, i, load, which >= 0, store);
        const int code = hinge_matrix(state, i, which >= 0, store);
        if (code) return mstmm_fail(state, MSTMM_FAILED_PRODUCT_PIVOT, i, code);
        multiply(store + HINGE, overall, step);
        multiply(store + BODY, step, overall);
    }
    return 0;
}

int mstmm_product_chain(mstmm_state *state, int which)
{
    const mstmm_model *model = state->model;
    const int alone = which >= 0;
    real overall[N * N], z[N], next[N];
    const int code = multiplied(state, which, overall);
    if (code) return code;
    if (mstmm_product_root(state, overall, alone, z))
        return mstmm_fail(state, MSTMM_FAILED_PRODUCT_ERROR, 0, 1);
    const real *parent = mstmm_zeros;
    for (int i = mstmm_product_next(model, -1); i >= 0; i = mstmm_product_next(model, i)) {
        const mstmm_body *body = &model->bodies[i];
        real *store = mstmm_product_numbers(state, i);
        real *block = state->workspace + body->block;
        apply(store + HINGE, z, next);
        mstmm_frames_state_deviation(.A = block + MSTMM_BLOCK_A,
                                     .motion = alone ? mstmm_zeros : block + MSTMM_BLOCK_MOTION,
                                     .z = next, .delta = store + STATE);
        mstmm_generic_project(body->nu, .Rc = block + MSTMM_BLOCK_R,
                              .r = block + MSTMM_BLOCK_SHIFT,
                              .H = mstmm_of_speeds(block, body->nu, MSTMM_SPEED_H),
                              .delta = store + STATE, .delta_I = parent,
                              .udot = mstmm_product_accelerations(state) + body->u);
        parent = store + STATE;
        apply(store + BODY, next, z);
    }
    return 0;
}

/* Applied loads alone, per body, are what the load passes take from e. */
int mstmm_hook_product_before_loads(mstmm_state *state)
{
    for (int i = 0; i < state->model->n_bodies; i++)
        memcpy(mstmm_product_numbers(state, i) + LOAD,
               state->workspace + state->model->bodies[i].block + MSTMM_BLOCK_E, 6 * sizeof(real));
    return 0;
}

int mstmm_hook_product(mstmm_state *state)
{
    const mstmm_model *model = state->model;
    for (int i = 0; i < model->n_bodies; i++) {
        real *load = mstmm_product_numbers(state, i) + LOAD;
        const real *e = state->workspace + model->bodies[i].block + MSTMM_BLOCK_E;
        for (int j = 0; j < 6; j++) load[j] -= e[j];
    }
    /* Rows of closed loops are known behind the sweep. */
    return model->looped ? 0 : mstmm_product_chain(state, ACTING);
}

/* Largest deviation of the product from the Riccati sweep; keeps the product's values. */
int mstmm_hook_product_compared(mstmm_state *state)
{
    real open = 0;
    const int code = state->model->looped ? mstmm_product_closed(state, &open) : 0;
    if (code) return code;
    const real *product = mstmm_product_accelerations(state);
    real *udot = state->udot, gap = 0, size = 0;
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
    if (gap <= CANCELLED * open) return 0;
    real relative = size > 0 ? gap / size : gap;
    return relative <= state->model->product->accuracy
               ? 0
               : mstmm_fail(state, MSTMM_FAILED_PRODUCT_ERROR, worst, MSTMM_FAILED_PRODUCT_ERROR);
}
