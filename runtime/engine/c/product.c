/* The classical method: overall transfer matrix of a chain as the plain product of its elements'
 * matrices, boundary conditions at both ends, accelerations read from the states along the way.
 * Rui, Wang, Zhang, ch. 5, (5.8), (5.9) and section 5.9.  The matrices are generated; this file
 * multiplies them.
 *
 * Closed loops: both ends of a cut hinge are boundaries of the chain, which the hinge's conditions
 * tie together.  Along the chain every state is linear in the loads between the two ends.  One
 * multiplier for each direction that the hinge holds makes them equal and opposite; that the ends
 * accelerate alike along these directions are as many equations, whose columns are products of the
 * same matrices under one multiplier alone. */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "kernel_calls.h"
#include "least_squares.h"
#include "sweep.h"
#include "sweep_steps.h"

#define N 13       /* numbers of a state: rdd, omegadot, m, q, 1 */
#define BODY 0     /* transfer matrix of the body */
#define HINGE 169  /* transfer matrix of its inboard hinge */
#define SCALE 338  /* magnitudes of the body's force rows */
#define STATE 374  /* deviation of its acceleration at P */
#define LOAD 380   /* what acts on it, body axes at P */
#define ROWS 12    /* at most, of the boundary conditions */

/* What loads the chain: all that acts, or that and the multipliers of closed loops; from 0 on, the
 * multiplier of that row of closed loops is one, and all is at rest without gravity. */
#define ACTING (-2)
#define HELD (-1)

/* Relative accelerations of an open chain that are rounding if closing its loops cancels them, as
 * at rest. */
#define CANCELLED 1e-13

/* --- numbers of the chain --- */

/* The next body of the chain behind one (-1: the ground), frames of hinges that close loops left
 * out; -1 behind the last. */
static int next_in_chain(const mstmm_model *model, int index)
{
    for (int i = index + 1; i < model->n_bodies; i++)
        if (!model->looped || !model->looped[i].closure) return i;
    return -1;
}

/* Numbers of a body: two matrices, scales, its deviation, its load. */
static real *chain_numbers(const mstmm_state *state, int index)
{
    return state->workspace + state->model->product->place + (size_t)MSTMM_PRODUCT_PER_BODY * index;
}

/* Accelerations of all speeds, behind all bodies. */
static real *chain_accelerations(const mstmm_state *state)
{
    return chain_numbers(state, state->model->n_bodies);
}

/* Multipliers of closed loops, one a row, and behind them the equations that give them. */
static real *chain_multipliers(const mstmm_state *state)
{
    return chain_accelerations(state) + state->model->nu;
}

/* Efforts of a body's hinge. */
static const real *hinge_tau(const mstmm_state *state, int index)
{
    const mstmm_body *body = &state->model->bodies[index];
    return mstmm_of_speeds(state->workspace + body->block, body->nu, MSTMM_SPEED_TAU);
}

/* --- boundary conditions: state at the ground, by least squares --- */

/* Efforts of a hinge as a force (where it is asked for) and a moment; inertial axes. */
static void hinge_efforts(const mstmm_state *state, int index, real *force, real *moment)
{
    const mstmm_body *body = &state->model->bodies[index];
    real *block = state->workspace + body->block;
    const real *tau = hinge_tau(state, index), *axes = block + MSTMM_BLOCK_A;
    if (body->nu == 6) mstmm_frames_to_inertial(.A = axes, .b = tau, .b_0 = force);
    mstmm_frames_to_inertial(.A = axes, .b = tau + body->nu - 3, .b_0 = moment);
}

/* Axis of a pin, inertial axes. */
static void hinge_axis(const mstmm_state *state, int index, real *axis)
{
    static const real z[3] = {0, 0, 1};
    const real *block = state->workspace + state->model->bodies[index].block;
    mstmm_frames_to_inertial(.A = block + MSTMM_BLOCK_A, .b = z, .b_0 = axis);
}

/* Offset of P from Q, zero for pins and balls; inertial axes. */
static void hinge_offset(const mstmm_state *state, int index, real *offset)
{
    const mstmm_body *body = &state->model->bodies[index];
    const real *block = state->workspace + body->block;
    const real *parent = mstmm_block(state->model, state->workspace, body->parent);
    real gap[3];
    for (int i = 0; i < 3; i++) gap[i] = block[MSTMM_BLOCK_SHIFT + i] - body->connection[9 + i];
    mstmm_frames_to_inertial(.A = parent + MSTMM_BLOCK_A, .b = gap, .b_0 = offset);
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

/* The first hinge's own condition on (m, q) at the ground: rows of [A | b]. */
static int root_condition(const mstmm_state *state, real *system)
{
    const int first = next_in_chain(state->model, -1);
    real force[3], moment[3], offset[3];
    memset(system, 0, 6 * 7 * sizeof(real));
    if (state->model->product->kind == MSTMM_PRODUCT_PIN) {
        hinge_axis(state, first, system);
        system[6] = *hinge_tau(state, first);
        return 1;
    }
    hinge_efforts(state, first, force, moment);
    for (int i = 0; i < 3; i++) {
        system[7 * i + i] = 1;
        system[7 * i + 6] = moment[i];
    }
    if (state->model->product->kind == MSTMM_PRODUCT_BALL) return 3;
    hinge_offset(state, first, offset);
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3; /* m - offset x q = moment */
        system[7 * i + 3 + k] = -offset[j];
        system[7 * i + 3 + j] = offset[k];
        system[7 * (3 + i) + 3 + i] = 1;
        system[7 * (3 + i) + 6] = force[i];
    }
    return 6;
}

/* State at the ground from the overall matrix: the tip is free, the first hinge has its efforts;
 * without gravity and efforts where `alone`.  Nonzero: not determined. */
static int ground_state(const mstmm_state *state, const real *overall, int alone, real *root)
{
    real system[7 * ROWS], forces[6];
    memset(root, 0, N * sizeof(real));
    for (int i = 0; i < 3 && !alone; i++) root[i] = -state->model->gravity[i];
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
    real *own = system + 7 * (6 - first);
    const int conditions = root_condition(state, own), rows = 6 - first + conditions;
    for (int i = 0; i < conditions && alone; i++) own[7 * i + 6] = 0;
    if (mstmm_least_squares(rows, 6, 1, system, forces)) return 1;
    memcpy(root + 6, forces, sizeof forces);
    return 0;
}

/* --- matrices and states along the chain --- */

static void multiply_transfer(const real *a, const real *b, real *out)
{
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            real sum = 0;
            for (int k = 0; k < N; k++) sum += a[N * i + k] * b[N * k + j];
            out[N * i + j] = sum;
        }
}

static void apply_transfer(const real *a, const real *z, real *out)
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
    const int next = next_in_chain(model, index);
    const real *output = next < 0 ? nowhere : model->bodies[next].connection + 9;
    real mass[1], r_io[3], r_ic[3], inertia[6], omega[3], force[3], moment[3];
    mstmm_frames_classical_body(.A = block + MSTMM_BLOCK_A, .p = body->body_p,
                                .motion = alone ? mstmm_zeros : block + MSTMM_BLOCK_MOTION,
                                .load = applied, .ro_n = output, .M = mass, .r_IO = r_io,
                                .r_IC = r_ic, .J_I = inertia, .omega = omega, .f_C = force,
                                .m_C = moment);
    mstmm_classical_body_transfer(.M = mass, .r_IO = r_io, .r_IC = r_ic, .J_I = inertia,
                                  .omega = omega, .f_C = force, .m_C = moment, .U = store + BODY,
                                  .F_scale = store + SCALE);
}

static int hinge_matrix(const mstmm_state *state, int index, int alone, real *store)
{
    const mstmm_model *model = state->model;
    const mstmm_body *body = &model->bodies[index];
    const int next = next_in_chain(model, index);
    real axis[3], next_axis[3], offset[3], next_offset[3] = {0}, tau[6] = {0}, omega[3], margin;
    const real *parent = mstmm_block(model, state->workspace, body->parent);
    switch (model->product->kind) {
    case MSTMM_PRODUCT_PIN:
        hinge_axis(state, index, axis);
        hinge_axis(state, next < 0 ? index : next, next_axis);
        if (next >= 0 && !alone) tau[0] = *hinge_tau(state, next);
        mstmm_frames_to_inertial(.A = parent + MSTMM_BLOCK_A,
                                 .b = alone ? mstmm_zeros : parent + MSTMM_BLOCK_MOTION,
                                 .b_0 = omega);
        return mstmm_classical_pin_transfer(.U = store + BODY, .F_scale = store + SCALE, .a = axis,
                                            .u = state->u + body->u, .omega_I = omega,
                                            .a_n = next_axis, .tau_n = tau, .U_h = store + HINGE,
                                            .margin = &margin);
    case MSTMM_PRODUCT_BALL:
        if (next >= 0 && !alone) hinge_efforts(state, next, NULL, tau);
        return mstmm_classical_ball_transfer(.U = store + BODY, .F_scale = store + SCALE,
                                             .tau_n = tau, .U_h = store + HINGE, .margin = &margin);
    default:
        hinge_offset(state, index, offset);
        if (next >= 0) {
            hinge_offset(state, next, next_offset);
            if (!alone) hinge_efforts(state, next, tau, tau + 3);
        }
        return mstmm_classical_acceleration_transfer(.U = store + BODY, .F_scale = store + SCALE,
                                                     .d = offset, .d_n = next_offset, .tau_n = tau,
                                                     .U_h = store + HINGE, .margin = &margin);
    }
}

/* Load on a body: what acts, and what the multipliers of closed loops put there. */
static void chain_load(const mstmm_state *state, int index, int which, real *load)
{
    const mstmm_model *model = state->model;
    memset(load, 0, 6 * sizeof(real));
    if (which < 0) memcpy(load, chain_numbers(state, index) + LOAD, 6 * sizeof(real));
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
            const real x = which < 0 ? chain_multipliers(state)[row] : 1;
            for (int j = 0; j < 6; j++) load[j] -= columns[6 * c + j] * x;
        }
    }
}

/* Overall matrix of the chain, those of its elements kept. */
static int multiply_chain(mstmm_state *state, int which, real *overall)
{
    real step[N * N], load[6];
    memset(overall, 0, N * N * sizeof(real));
    for (int i = 0; i < N; i++) overall[(N + 1) * i] = 1;
    for (int i = next_in_chain(state->model, -1); i >= 0; i = next_in_chain(state->model, i)) {
        real *store = chain_numbers(state, i);
        chain_load(state, i, which, load);
        body_matrix(state, i, load, which >= 0, store);
        const int code = hinge_matrix(state, i, which >= 0, store);
        if (code) return mstmm_fail(state, MSTMM_FAILED_PRODUCT_PIVOT, i, code);
        multiply_transfer(store + HINGE, overall, step);
        multiply_transfer(store + BODY, step, overall);
    }
    return 0;
}

/* Accelerations and deviations of the chain under a load.  Nonzero = failure code. */
static int solve_chain(mstmm_state *state, int which)
{
    const mstmm_model *model = state->model;
    const int alone = which >= 0;
    real overall[N * N], z[N], next[N];
    const int code = multiply_chain(state, which, overall);
    if (code) return code;
    if (ground_state(state, overall, alone, z))
        return mstmm_fail(state, MSTMM_FAILED_PRODUCT_ERROR, 0, 1);
    const real *parent = mstmm_zeros;
    for (int i = next_in_chain(model, -1); i >= 0; i = next_in_chain(model, i)) {
        const mstmm_body *body = &model->bodies[i];
        real *store = chain_numbers(state, i);
        real *block = state->workspace + body->block;
        apply_transfer(store + HINGE, z, next);
        mstmm_frames_state_deviation(.A = block + MSTMM_BLOCK_A,
                                     .motion = alone ? mstmm_zeros : block + MSTMM_BLOCK_MOTION,
                                     .z = next, .delta = store + STATE);
        mstmm_generic_project(body->nu, .Rc = block + MSTMM_BLOCK_R, .r = block + MSTMM_BLOCK_SHIFT,
                              .H = mstmm_of_speeds(block, body->nu, MSTMM_SPEED_H),
                              .delta = store + STATE, .delta_I = parent,
                              .udot = chain_accelerations(state) + body->u);
        parent = store + STATE;
        apply_transfer(store + BODY, next, z);
    }
    return 0;
}

/* --- closed loops --- */

static const real *closure_numbers(const mstmm_state *state, int frame, int64_t first)
{
    return state->workspace + state->model->loops + state->model->looped[frame].closure->numbers +
           first;
}

/* Acceleration of the chain along a direction of a closing hinge. */
static real acceleration_along(const mstmm_state *state, int frame, int direction, int alone)
{
    const int ends[] = {state->model->bodies[frame].parent,
                        state->model->looped[frame].closure->outboard};
    const int64_t columns[] = {MSTMM_CLOSURE_J_A, MSTMM_CLOSURE_J_B};
    real found = alone ? 0 : closure_numbers(state, frame, MSTMM_CLOSURE_L)[direction];
    for (int side = 0; side < 2; side++) {
        if (ends[side] < 0) continue;
        const real *row = closure_numbers(state, frame, columns[side]) + 6 * direction;
        const real *moved = chain_numbers(state, ends[side]) + STATE;
        for (int j = 0; j < 6; j++) found += row[j] * moved[j];
    }
    return found;
}

/* Efforts of closing hinges among what acts on their bodies. */
static void add_efforts(const mstmm_state *state, int frame)
{
    const mstmm_body *own = &state->model->bodies[frame];
    const int ends[] = {own->parent, state->model->looped[frame].closure->outboard};
    const int64_t columns[] = {MSTMM_CLOSURE_J_A, MSTMM_CLOSURE_J_B};
    for (int side = 0; side < 2; side++)
        for (int k = 0; k < own->nu && ends[side] >= 0; k++) {
            const real *row = closure_numbers(state, frame, columns[side]) + 6 * k;
            real *load = chain_numbers(state, ends[side]) + LOAD;
            for (int j = 0; j < 6; j++) load[j] += row[j] * hinge_tau(state, frame)[k];
        }
}

/* One column of the equations: response of all rows to a load. */
static void fill_column(const mstmm_state *state, int which, real *system, int at, int width)
{
    const mstmm_model *model = state->model;
    for (int i = 0; i < model->n_bodies; i++)
        for (int c = 0; c < 6 && model->looped[i].closure; c++) {
            const int row = model->looped[i].closure->rows[c];
            if (row >= 0) system[row * width + at] = acceleration_along(state, i, c, which >= 0);
        }
}

/* x of A x = -b from rows [A | b], by elimination with pivots in columns.  Nonzero: singular. */
static int solve_rows(int n, real *system, real *x)
{
    const int width = n + 1;
    for (int k = 0; k < n; k++) {
        int best = k;
        for (int i = k + 1; i < n; i++)
            if (fabs(system[i * width + k]) > fabs(system[best * width + k])) best = i;
        if (!(fabs(system[best * width + k]) > 0)) return 1;
        for (int j = k; j < width; j++) {
            const real kept = system[k * width + j];
            system[k * width + j] = system[best * width + j];
            system[best * width + j] = kept;
        }
        for (int i = k + 1; i < n; i++) {
            const real share = system[i * width + k] / system[k * width + k];
            for (int j = k; j < width; j++) system[i * width + j] -= share * system[k * width + j];
        }
    }
    for (int k = n - 1; k >= 0; k--) {
        x[k] = -system[k * width + n];
        for (int j = k + 1; j < n; j++) x[k] -= system[k * width + j] * x[j];
        x[k] /= system[k * width + k];
    }
    return 0;
}

/* The same with the loops closed that end on it, behind a sweep; `open` is raised to the largest
 * acceleration of the open chain, of which closing leaves the difference. */
static int solve_closed_chain(mstmm_state *state, real *open)
{
    const mstmm_model *model = state->model;
    const int rows = model->n_rows;
    real *x = chain_multipliers(state), *system = x + rows;
    int code = 0, last = 0;
    for (int i = 0; i < model->n_bodies && !code; i++) {
        if (model->looped[i].closure)
            add_efforts(state, last = i);
        else
            code = mstmm_at_hinge_motion(state, i); /* overwritten by the elimination */
    }
    for (int which = -1; which < rows && !code; which++) {
        code = solve_chain(state, which < 0 ? ACTING : which);
        for (int k = 0; k < model->nu && which < 0; k++)
            *open = fmax(*open, fabs(chain_accelerations(state)[k]));
        if (!code) fill_column(state, which, system, which < 0 ? rows : which, rows + 1);
    }
    if (!code && solve_rows(rows, system, x))
        return mstmm_fail(state, MSTMM_FAILED_PRODUCT_PIVOT, last, 1);
    if (!code) code = solve_chain(state, HELD);
    for (int i = 0; i < model->n_bodies && !code; i++)
        for (int k = 0; k < model->bodies[i].nu && model->looped[i].closure; k++)
            chain_accelerations(state)[model->bodies[i].u + k] = acceleration_along(state, i, k, 0);
    return code;
}

/* --- hooks of the passes --- */

/* Applied loads alone, per body, are what the load passes take from e. */
int mstmm_hook_product_before_loads(mstmm_state *state)
{
    for (int i = 0; i < state->model->n_bodies; i++)
        memcpy(chain_numbers(state, i) + LOAD,
               state->workspace + state->model->bodies[i].block + MSTMM_BLOCK_E, 6 * sizeof(real));
    return 0;
}

int mstmm_hook_product(mstmm_state *state)
{
    const mstmm_model *model = state->model;
    for (int i = 0; i < model->n_bodies; i++) {
        real *load = chain_numbers(state, i) + LOAD;
        const real *e = state->workspace + model->bodies[i].block + MSTMM_BLOCK_E;
        for (int j = 0; j < 6; j++) load[j] -= e[j];
    }
    /* Rows of closed loops are known behind the sweep. */
    return model->looped ? 0 : solve_chain(state, ACTING);
}

/* Largest deviation of the product from the Riccati sweep; keeps the product's values. */
int mstmm_hook_compare_product(mstmm_state *state)
{
    real open = 0;
    const int code = state->model->looped ? solve_closed_chain(state, &open) : 0;
    if (code) return code;
    const real *product = chain_accelerations(state);
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
