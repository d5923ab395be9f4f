/* Boundary conditions of a chain whose matrices are multiplied: the ground's state from the overall
 * matrix, by least squares. */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "kernel_calls.h"
#include "product.h"

#define ROWS 12

void mstmm_product_efforts(const mstmm_state *state, int index, real *force, real *moment)
{
    const mstmm_body *body = &state->model->bodies[index];
    real *block = state->workspace + body->block;
    const real *tau = mstmm_product_tau(state, index), *axes = block + MSTMM_BLOCK_A;
    if (body->nu == 6) mstmm_frames_turned(.A = axes, .b = tau, .b_0 = force);
    mstmm_frames_turned(.A = axes, .b = tau + body->nu - 3, .b_0 = moment);
}

void mstmm_product_axis(const mstmm_state *state, int index, real *axis)
{
    static const real z[3] = {0, 0, 1};
    const real *block = state->workspace + state->model->bodies[index].block;
    mstmm_frames_turned(.A = block + MSTMM_BLOCK_A, .b = z, .b_0 = axis);
}

void mstmm_product_offset(const mstmm_state *state, int index, real *offset)
{
    const mstmm_body *body = &state->model->bodies[index];
    const real *block = state->workspace + body->block;
    const real *parent = mstmm_block(state->model, state->workspace, body->parent);
    real gap[3];
    for (int i = 0; i < 3; i++) gap[i] = block[MSTMM_BLOCK_SHIFT + i] - body->connection[9 + i];
    mstmm_frames_turned(.A = parent + MSTMM_BLOCK_A, .b = gap, .b_0 = offset);
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

/* The first hinge's own condition on (m, q) at the ground: rows of [A | b]. */
static int root_condition(const mstmm_state *state, real *system)
{
    const int first = mstmm_product_next(state->model, -1);
    real force[3], moment[3], offset[3];
    memset(system, 0, 6 * 7 * sizeof(real));
    if (state->model->product->kind == MSTMM_PRODUCT_PIN) {
        mstmm_product_axis(state, first, system);
        system[6] = *mstmm_product_tau(state, first);
        return 1;
    }
    mstmm_product_efforts(state, first, force, moment);
    for (int i = 0; i < 3; i++) {
        system[7 * i + i] = 1;
        system[7 * i + 6] = moment[i];
    }
    if (state->model->product->kind == MSTMM_PRODUCT_BALL) return 3;
    mstmm_product_offset(state, first, offset);
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3; /* m - offset x q = moment */
        system[7 * i + 3 + k] = -offset[j];
        system[7 * i + 3 + j] = offset[k];
        system[7 * (3 + i) + 3 + i] = 1;
        system[7 * (3 + i) + 6] = force[i];
    }
    return 6;
}

int mstmm_product_root(const mstmm_state *state, const real *overall, int alone, real *root)
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
    if (solve_boundary(rows, system, forces)) return 1;
    memcpy(root + 6, forces, sizeof forces);
    return 0;
}
