/* Closed loops in the plain product: both ends of a cut hinge are boundaries of the chain, which
 * the hinge's conditions tie together.
 *
* Along the chain every state is linear in the loads between the two ends.  One
 * multiplier for each direction that the hinge holds makes them equal and opposite; that the ends
 * accelerate alike along these directions are as many equations, whose columns are products of the
 * same matrices under one multiplier alone. */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "product.h"
#include "sweep_steps.h"

static const real *numbers_of(const mstmm_state *state, int frame, int64_t first)
{
    return state->workspace + state->model->loops + state->model->looped[frame].closure->numbers +
           first;
}

/* Acceleration of the chain along a direction of a closing hinge. */
static real along(const mstmm_state *state, int frame, int direction, int alone)
{
    const int ends[] = {state->model->bodies[frame].parent,
                        state->model->looped[frame].closure->outboard};
    const int64_t columns[] = {MSTMM_CLOSURE_J_A, MSTMM_CLOSURE_J_B};
    real found = alone ? 0 : numbers_of(state, frame, MSTMM_CLOSURE_L)[direction];
    for (int side = 0; side < 2; side++) {
        if (ends[side] < 0) continue;
        const real *row = numbers_of(state, frame, columns[side]) + 6 * direction;
        const real *moved = mstmm_product_numbers(state, ends[side]) + STATE;
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
            const real *row = numbers_of(state, frame, columns[side]) + 6 * k;
            real *load = mstmm_product_numbers(state, ends[side]) + LOAD;
            for (int j = 0; j < 6; j++) load[j] += row[j] * mstmm_product_tau(state, frame)[k];
        }
}

/* One column of the equations: response of all rows to a load. */
static void column(const mstmm_state *state, int which, real *system, int at, int width)
{
    const mstmm_model *model = state->model;
    for (int i = 0; i < model->n_bodies; i++)
        for (int c = 0; c < 6 && model->looped[i].closure; c++) {
            const int row = model->looped[i].closure->rows[c];
            if (row >= 0) system[row * width + at] = along(state, i, c, which >= 0);
        }
}

/* x of A x = -b from rows [A | b], by elimination with pivots in columns.  Nonzero: singular. */
static int solved(int n, real *system, real *x)
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

int mstmm_product_closed(mstmm_state *state, real *open)
{
    const mstmm_model *model = state->model;
    const int rows = model->n_rows;
    real *x = mstmm_product_multipliers(state), *system = x + rows;
    int code = 0, last = 0;
    for (int i = 0; i < model->n_bodies && !code; i++) {
        if (model->looped[i].closure) add_efforts(state, last = i);
        else code = mstmm_at_hinge_motion(state, i); /* overwritten by the elimination */
    }
    for (int which = -1; which < rows && !code; which++) {
        code = mstmm_product_chain(state, which < 0 ? ACTING : which);
        for (int k = 0; k < model->nu && which < 0; k++)
            *open = fmax(*open, fabs(mstmm_product_accelerations(state)[k]));
        if (!code) column(state, which, system, which < 0 ? rows : which, rows + 1);
    }
    if (!code && solved(rows, system, x))
        return mstmm_fail(state, MSTMM_FAILED_PRODUCT_PIVOT, last, 1);
    if (!code) code = mstmm_product_chain(state, HELD);
    for (int i = 0; i < model->n_bodies && !code; i++)
        for (int k = 0; k < model->bodies[i].nu && model->looped[i].closure; k++)
            mstmm_product_accelerations(state)[model->bodies[i].u + k] = along(state, i, k, 0);
    return code;
}
