/* Projection of the states of a run on their constraints, by code compiled for its scene or else by
 * the looped engine. */
#include <math.h>
#include <string.h>

#include "fused_rhs.h"
#include "loop_closure.h"

/* Maximum number of choices of rows at the end of a step. */
#define CHOICES 3

typedef struct {
    mstmm_scene_run *run;
    double t, *y;
} compiled_state;

/* Element index of an open loop: frame of closure k; couplings follow all bodies. */
static int closure_frame(const mstmm_model *model, int k)
{
    for (int i = 0; i < model->n_bodies; i++)
        if (model->looped[i].closure && k-- == 0) return i;
    return model->n_bodies + k;
}

static real largest_gap(const mstmm_scene_run *run, const real *gaps, int *where)
{
    real found = 0;
    int at = 0;
    for (int k = 0; k < 6 * run->fused->n_closures; k++) {
        if (fabs(gaps[k]) <= found) continue;
        found = fabs(gaps[k]);
        at = k / 6;
    }
    if (found > 0) *where = closure_frame(run->model, at);
    return found;
}

static int compiled_gaps(void *context, mstmm_gaps *found)
{
    const compiled_state *at = context;
    mstmm_scene_run *run = at->run;
    const mstmm_fused *fused = run->fused;
    real *dq = run->fused_numbers + fused->nu, *gap = dq + fused->nq + fused->nu;
    real *apart = gap + 6 * fused->n_closures;
    const int code = fused->gaps(run->fused_p, &at->t, at->y, at->y + fused->nq, run->memory,
                                 run->fused_numbers, dq, gap, apart);
    if (code) return mstmm_fused_failure(run, fused, code);
    found->met = largest_gap(run, gap, &found->where_met);
    found->repeated = largest_gap(run, apart, &found->where_repeated);
    for (int i = 0; i < fused->nq; i++) at->y[i] += dq[i];
    mstmm_unit_quaternions(run->n_quaternions, run->quaternions, at->y);
    return 0;
}

static int compiled_slips(void *context)
{
    const compiled_state *at = context;
    mstmm_scene_run *run = at->run;
    const mstmm_fused *fused = run->fused;
    real *du = run->fused_numbers + fused->nu, *u = at->y + fused->nq;
    const int code = fused->slips(run->fused_p, &at->t, at->y, u, run->memory, run->fused_numbers,
                                  du, &run->strain);
    if (code) return mstmm_fused_failure(run, fused, code);
    for (int i = 0; i < fused->nu; i++) u[i] += du[i];
    return 0;
}

static int close_loops(mstmm_scene_run *run, double t, double *y)
{
    const mstmm_model *model = run->model;
    if (!run->fused) {
        const int code = mstmm_close_loops(model, run->workspace, t, y, y + model->nq, run->memory,
                                           run->n_quaternions, run->quaternions, run->on_positions,
                                           &run->failure);
        run->strain = mstmm_strain(model, run->workspace);
        return code;
    }
    compiled_state at = {run, t, y};
    mstmm_renew_inputs(&run->live, t, run->memory, run->fused_p);
    const int near = model->strained >= 0 && run->memory[model->strained] > 0;
    const mstmm_closing by = {&at, compiled_gaps, run->on_positions ? NULL : compiled_slips, near};
    return mstmm_remove_gaps(&by, model, &run->failure);
}

int mstmm_scene_close_loops(mstmm_scene_run *run, double t, double *y)
{
    const mstmm_model *model = run->model;
    int code = 0, changed = model->n_choices > 0;
    run->rechosen = 0;
    if (!changed) return close_loops(run, t, y);
    for (int k = 0; k < CHOICES && changed && !code; k++) {
        code = close_loops(run, t, y);
        if (!code)
            code = mstmm_choose_rows(model, run->workspace, t, y, run->memory, &changed,
                                     &run->failure);
        run->rechosen |= changed;
    }
    return code;
}

/* Coordinates of a stage with closed gaps, if possible. */
static const double *stage_coordinates(mstmm_scene_run *run, double t, const double *y)
{
    const mstmm_model *model = run->model;
    real *closed = run->speeds + model->nu;
    const real strain = run->strain;
    const mstmm_failure failure = run->failure;
    memcpy(closed, y, (size_t)(model->nq + model->nu) * sizeof(real));
    const int code = close_loops(run, t, closed);
    run->strain = strain;
    run->failure = failure;
    return code ? y : closed;
}

int mstmm_stage_state(mstmm_scene_run *run, double t, const double **y, const double **u)
{
    if (!run->speeds || !(run->memory[run->model->strained] > 0)) return 0;
    if (!run->model->loops_singular) *y = stage_coordinates(run, t, *y);
    *u = *y + run->model->nq;
    return mstmm_stage_speeds(run, t, *y, u);
}

int mstmm_stage_speeds(mstmm_scene_run *run, double t, const double *y, const double **u)
{
    const mstmm_model *model = run->model;
    const mstmm_fused *fused = run->fused;
    real *speeds = run->speeds, strain;
    if (!speeds || !(run->memory[model->strained] > 0)) return 0;
    const int code = fused ? fused->slips(run->fused_p, &t, y, *u, run->memory, run->fused_numbers,
                                          speeds, &strain)
                           : mstmm_correction(model, run->workspace, MSTMM_SLIP, 0, t, y, *u,
                                              run->memory, speeds, NULL, &run->failure);
    if (code) return fused ? mstmm_fused_failure(run, fused, code) : code;
    for (int i = 0; i < model->nu; i++) speeds[i] += (*u)[i];
    *u = speeds;
    return 0;
}
