/* The classical method: overall transfer matrix of a chain as the plain product of its elements'
 * matrices, boundary conditions at both ends, accelerations read from the states along the way.
 * Rui, Wang, Zhang, ch. 5, (5.8), (5.9) and section 5.9.  The matrices are generated; this file
 * multiplies them and solves the boundary conditions. */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "kernel_calls.h"
#include "sweep_steps.h"

#define N 13
#define BODY 0        /* transfer matrix of the body */
#define HINGE 169     /* transfer matrix of its inboard hinge */
#define SCALE 338     /* magnitudes of the body's force rows */
#define STATE 374     /* state at P */
#define PER_BODY MSTMM_PRODUCT_MATRICES
#define ROWS 12

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

/* The six rows of the free tip, of which the last hinge's condition makes some vanish but for
 * rounding, get one common scale. */
static void scale_tip(real *system)
{
    real size = 0;
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 6; j++) size = fmax(size, fabs(system[7 * i + j]));
    for (int i = 0; size > 0 && i < 42; i++) system[i] /= size;
}

/* Least squares of `rows` equations in 6 unknowns; Householder.  system holds [A | b], 7 numbers a
 * row.  Returns 0, or 1 for a rank below 6. */
static int solve_boundary(int rows, real *system, real *x)
{
    for (int k = 0; k < 6; k++) {
        real norm = 0;
        for (int i = k; i < rows; i++) norm = hypot(norm, system[7 * i + k]);
        if (!(norm > 0)) return 1;
        real alpha = system[7 * k + k] > 0 ? -norm : norm;
        real v[ROWS], square = 0;
        for (int i = k; i < rows; i++) {
            v[i] = system[7 * i + k] - (i == k ? alpha : 0);
            square += v[i] * v[i];
        }
        for (int j = k; j < 7 && square > 0; j++) {
            real dot = 0;
            for (int i = k; i < rows; i++) dot += v[i] * system[7 * i + j];
            for (int i = k; i < rows; i++) system[7 * i + j] -= 2 * dot / square * v[i];
        }
    }
    for (int k = 5; k >= 0; k--) {
        x[k] = system[7 * k + 6];
        for (int j = k + 1; j < 6; j++) x[k] -= system[7 * k + j] * x[j];
        if (!(fabs(system[7 * k + k]) > 0)) return 1;
        x[k] /= system[7 * k + k];
    }
    return 0;
}

static const real *tau_of(const mstmm_state *state, int index)
{
    const mstmm_body *body = &state->model->bodies[index];
    return mstmm_of_speeds(state->workspace + body->block, body->nu, MSTMM_SPEED_TAU);
}

/* Efforts of a hinge as a force and a moment, inertial axes. */
static void efforts_of(const mstmm_state *state, int index, real *force, real *moment)
{
    const mstmm_body *body = &state->model->bodies[index];
    real *block = state->workspace + body->block;
    const real *tau = tau_of(state, index), *axes = block + MSTMM_BLOCK_A;
    if (body->nu == 6) mstmm_frames_turned(.A = axes, .b = tau, .b_0 = force);
    mstmm_frames_turned(.A = axes, .b = tau + body->nu - 3, .b_0 = moment);
}

static void axis_of(const mstmm_state *state, int index, real *axis)
{
    static const real z[3] = {0, 0, 1};
    const real *block = state->workspace + state->model->bodies[index].block;
    mstmm_frames_turned(.A = block + MSTMM_BLOCK_A, .b = z, .b_0 = axis);
}

/* Offset of P from Q of a hinge, inertial axes; zero for pins and balls. */
static void offset_of(const mstmm_state *state, int index, real *offset)
{
    const mstmm_body *body = &state->model->bodies[index];
    const real *block = state->workspace + body->block;
    const real *parent = mstmm_block(state->model, state->workspace, body->parent);
    real gap[3];
    for (int i = 0; i < 3; i++) gap[i] = block[MSTMM_BLOCK_SHIFT + i] - body->connection[9 + i];
    mstmm_frames_turned(.A = parent + MSTMM_BLOCK_A, .b = gap, .b_0 = offset);
}

static void body_matrix(const mstmm_state *state, int index, const real *applied, real *store)
{
    static const real nowhere[3] = {0};
    const mstmm_model *model = state->model;
    const mstmm_body *body = &model->bodies[index];
    const real *block = state->workspace + body->block;
    const int last = index + 1 == model->n_bodies;
    const real *output = last ? nowhere : model->bodies[index + 1].connection + 9;
    real mass[1], r_io[3], r_ic[3], inertia[6], omega[3], force[3], moment[3];
    mstmm_frames_classical_body(.A = block + MSTMM_BLOCK_A, .p = body->body_p,
                                .motion = block + MSTMM_BLOCK_MOTION, .load = applied,
                                .ro_n = output, .M = mass, .r_IO = r_io, .r_IC = r_ic,
                                .J_I = inertia, .omega = omega, .f_C = force, .m_C = moment);
    mstmm_classical_body_transfer(.M = mass, .r_IO = r_io, .r_IC = r_ic, .J_I = inertia,
                                  .omega = omega, .f_C = force, .m_C = moment, .U = store + BODY,
                                  .F_scale = store + SCALE);
}

static int hinge_matrix(const mstmm_state *state, int index, real *store)
{
    const mstmm_model *model = state->model;
    const mstmm_body *body = &model->bodies[index];
    const int next = index + 1 < model->n_bodies ? index + 1 : -1;
    real axis[3], next_axis[3], offset[3], next_offset[3] = {0}, tau[6] = {0}, omega[3], margin;
    const real *parent = mstmm_block(model, state->workspace, body->parent);
    switch (model->product->kind) {
    case MSTMM_PRODUCT_PIN:
        axis_of(state, index, axis);
        axis_of(state, next < 0 ? index : next, next_axis);
        if (next >= 0)
            tau[0] = *tau_of(state, next);
        mstmm_frames_turned(.A = parent + MSTMM_BLOCK_A, .b = parent + MSTMM_BLOCK_MOTION,
                            .b_0 = omega);
        return mstmm_classical_pin_transfer(
            .U = store + BODY, .F_scale = store + SCALE, .a = axis, .u = state->u + body->u,
            .omega_I = omega, .a_n = next_axis, .tau_n = tau, .U_h = store + HINGE,
            .margin = &margin);
    case MSTMM_PRODUCT_BALL:
        if (next >= 0) efforts_of(state, next, NULL, tau);
        return mstmm_classical_ball_transfer(.U = store + BODY, .F_scale = store + SCALE,
                                             .tau_n = tau, .U_h = store + HINGE,
                                             .margin = &margin);
    default:
        offset_of(state, index, offset);
        if (next >= 0) {
            offset_of(state, next, next_offset);
            efforts_of(state, next, tau, tau + 3);
        }
        return mstmm_classical_acceleration_transfer(
            .U = store + BODY, .F_scale = store + SCALE, .d = offset, .d_n = next_offset,
            .tau_n = tau, .U_h = store + HINGE, .margin = &margin);
    }
}

/* The first hinge's own condition on (m, q) at the ground: rows of [A | b]. */
static int root_condition(const mstmm_state *state, real *system)
{
    real force[3], moment[3], offset[3];
    memset(system, 0, 6 * 7 * sizeof(real));
    if (state->model->product->kind == MSTMM_PRODUCT_PIN) {
        axis_of(state, 0, system);
        system[6] = *tau_of(state, 0);
        return 1;
    }
    efforts_of(state, 0, force, moment);
    for (int i = 0; i < 3; i++) {
        system[7 * i + i] = 1;
        system[7 * i + 6] = moment[i];
    }
    if (state->model->product->kind == MSTMM_PRODUCT_BALL) return 3;
    offset_of(state, 0, offset);
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3; /* m - offset x q = moment */
        system[7 * i + 3 + k] = -offset[j];
        system[7 * i + 3 + j] = offset[k];
        system[7 * (3 + i) + 3 + i] = 1;
        system[7 * (3 + i) + 6] = force[i];
    }
    return 6;
}

/* Unknown forces at the ground from U: the tip is free, the first hinge has its efforts. */
static int boundary(const mstmm_state *state, const real *overall, real *root)
{
    real system[7 * ROWS], forces[6];
    memset(root, 0, N * sizeof(real));
    for (int i = 0; i < 3; i++) root[i] = -state->model->gravity[i];
    root[12] = 1;
    for (int i = 0; i < 6; i++) {
        const real *row = overall + N * (6 + i);
        real known = row[12];
        for (int j = 0; j < 6; j++) {
            system[7 * i + j] = row[6 + j];
            known += row[j] * root[j];
        }
        system[7 * i + 6] = -known;
    }
    /* What the last hinge's condition has used up is left out: a ball's moments, all six of an
     * acceleration hinge; of a pin one combination, which least squares bears. */
    static const int used_up[] = {0, 3, 6};
    const int first = used_up[state->model->product->kind];
    scale_tip(system);
    memmove(system, system + 7 * first, 7 * (6 - first) * sizeof(real));
    int rows = 6 - first + root_condition(state, system + 7 * (6 - first));
    if (solve_boundary(rows, system, forces)) return 1;
    memcpy(root + 6, forces, sizeof forces);
    return 0;
}

/* Numbers of the product in the workspace: per body matrices, then applied loads; accelerations. */
static real *applied_loads(const mstmm_state *state)
{
    return state->workspace + state->model->product->place +
           (size_t)PER_BODY * state->model->n_bodies;
}

static real *product_accelerations(const mstmm_state *state)
{
    return state->workspace + state->model->product->place +
           (size_t)MSTMM_PRODUCT_PER_BODY * state->model->n_bodies;
}

static real *load_of(const mstmm_state *state, int index)
{
    return state->workspace + state->model->bodies[index].block + MSTMM_BLOCK_E;
}

/* Applied loads alone, per body (6 numbers, body axes), are what the load passes take from e. */
int mstmm_hook_product_before_loads(mstmm_state *state)
{
    real *applied = applied_loads(state);
    for (int i = 0; i < state->model->n_bodies; i++)
        memcpy(applied + 6 * i, load_of(state, i), 6 * sizeof(real));
    return 0;
}

int mstmm_hook_product(mstmm_state *state)
{
    const mstmm_model *model = state->model;
    real overall[N * N], step[N * N], z[N], next[N];
    real *numbers = state->workspace + model->product->place, *applied = applied_loads(state);
    real *udot = product_accelerations(state);
    memset(overall, 0, sizeof overall);
    for (int i = 0; i < N; i++) overall[(N + 1) * i] = 1;
    for (int i = 0; i < model->n_bodies; i++) {
        real *store = numbers + (size_t)PER_BODY * i;
        for (int j = 0; j < 6; j++) applied[6 * i + j] -= load_of(state, i)[j];
        body_matrix(state, i, applied + 6 * i, store);
        int code = hinge_matrix(state, i, store);
        if (code) return mstmm_fail(state, MSTMM_FAILED_PRODUCT_PIVOT, i, code);
        multiply(store + HINGE, overall, step);
        multiply(store + BODY, step, overall);
    }
    if (boundary(state, overall, z)) return mstmm_fail(state, MSTMM_FAILED_PRODUCT_ERROR, 0, 1);
    const real *parent = mstmm_zeros;
    for (int i = 0; i < model->n_bodies; i++) {
        const mstmm_body *body = &model->bodies[i];
        real *store = numbers + (size_t)PER_BODY * i;
        real *block = state->workspace + body->block;
        apply(store + HINGE, z, next);
        mstmm_frames_state_deviation(.A = block + MSTMM_BLOCK_A,
                                     .motion = block + MSTMM_BLOCK_MOTION, .z = next,
                                     .delta = store + STATE);
        mstmm_generic_project(body->nu, .Rc = block + MSTMM_BLOCK_R,
                              .r = block + MSTMM_BLOCK_SHIFT,
                              .H = mstmm_of_speeds(block, body->nu, MSTMM_SPEED_H),
                              .delta = store + STATE, .delta_I = parent, .udot = udot + body->u);
        parent = store + STATE;
        apply(store + BODY, next, z);
    }
    return 0;
}

/* Largest deviation of the product from the Riccati sweep; keeps the product's values. */
int mstmm_hook_product_compared(mstmm_state *state)
{
    const real *product = product_accelerations(state);
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
    real relative = size > 0 ? gap / size : gap;
    return relative <= state->model->product->accuracy
               ? 0
               : mstmm_fail(state, MSTMM_FAILED_PRODUCT_ERROR, worst, MSTMM_FAILED_PRODUCT_ERROR);
}
