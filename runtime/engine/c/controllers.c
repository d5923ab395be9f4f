/* Measured quantities of a state, by expressions, and the controllers that use them. */
#include <math.h>
#include <string.h>

#include "controllers.h"
#include "is_finite.h"

static const real SAME = 1e-9; /* of a sample time: a time so near to a sample is the sample */

int mstmm_evaluate_measure(mstmm_scene_run *run, const mstmm_measure *measure, real t,
                           const real *y, real *numbers)
{
    const mstmm_model *model = run->model;
    const mstmm_observation *shown = &measure->shown;
    const real *u = y + model->nq;
    if (measure->observes) {
        if (run->base) run->base->known = 0; /* for the workspace is the same */
        const int code =
            mstmm_observe(model, run->workspace, t, y, u, run->memory, shown, &run->failure);
        if (code) return code;
    }
    mstmm_state state = {.model = model,
                         .workspace = run->workspace,
                         .t = t,
                         .memory = run->memory,
                         .failure = &run->failure};
    const real *inputs[] = {&t,
                            y,
                            u,
                            shown->points,
                            shown->loads,
                            shown->efforts,
                            shown->udot,
                            shown->sums,
                            mstmm_input_numbers(&state)};
    real *outputs[] = {numbers};
    return mstmm_tape_run(measure->tape, inputs, mstmm_slots(&state), outputs)
               ? MSTMM_FAILED_EXPRESSION
               : 0;
}

/* to += M from, M of n rows */
static void add_product(int n, int columns, const real *m, const real *from, real *to)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < columns; j++) to[i] += m[i * columns + j] * from[j];
}

static int is_due(const mstmm_controller *one, real *memory, real t)
{
    const real Ts = one->sample_time;
    if (isnan(memory[0])) memory[0] = ceil(t / Ts - SAME);
    return t >= (memory[0] - SAME) * Ts;
}

static int update_controller(const mstmm_controller *one, real *memory, real t)
{
    real *x = memory + 1, *u = x + one->n_x;
    for (int j = 0; j < one->n_y; j++) one->y[j] -= one->reference[j];
    memcpy(u, one->offset, (size_t)one->n_u * sizeof(real));
    add_product(one->n_u, one->n_x, one->C, x, u);
    add_product(one->n_u, one->n_y, one->D, one->y, u);
    memset(one->next, 0, (size_t)one->n_x * sizeof(real));
    add_product(one->n_x, one->n_x, one->A, x, one->next);
    add_product(one->n_x, one->n_y, one->B, one->y, one->next);
    memcpy(x, one->next, (size_t)one->n_x * sizeof(real));
    memory[0] = floor(t / one->sample_time + SAME) + 1;
    return mstmm_finite(one->n_x + one->n_u, x);
}

static int note_controller_failure(mstmm_scene_run *run, int number)
{
    run->failure = (mstmm_failure){MSTMM_FAILED_CONTROLLER, number, 0};
    return MSTMM_FAILED_CONTROLLER;
}

int mstmm_controllers_act(mstmm_scene_run *run, real t, const real *y)
{
    int due = 0;
    for (int k = 0; k < run->n_controllers; k++) {
        const mstmm_controller *one = &run->controllers[k];
        if (!is_due(one, run->memory + one->memory, t)) continue;
        const int code = mstmm_evaluate_measure(run, one->measure, t, y, one->y);
        if (code) return code;
        if (!mstmm_finite(one->n_y, one->y)) return note_controller_failure(run, k);
        due = 1;
    }
    for (int k = 0; due && k < run->n_controllers; k++) {
        const mstmm_controller *one = &run->controllers[k];
        real *memory = run->memory + one->memory;
        if (is_due(one, memory, t) && !update_controller(one, memory, t))
            return note_controller_failure(run, k);
    }
    if (due && run->base) run->base->known = 0;
    return -due;
}
