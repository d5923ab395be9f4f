/* A scene whose accelerations come from code compiled for it: the integrator's right-hand side, for
 * one state and for several in SIMD lanes.  The looped engine does events and projections. */
#include <math.h>
#include <string.h>

#include "fused_rhs.h"
#include "loop_closure.h"

/* Results for closed loops: a change of the coordinates or speeds, and gaps. */
static int64_t closing_size(const mstmm_fused *one)
{
    return one->n_closures ? one->nq + one->nu + 12 * (int64_t)one->n_closures : 0;
}

/* Numbers that compiled code reads besides the state: the efforts, which are zero here; and for
 * lanes, where entry i stands `lanes` times, the parameters and the memory.  Between them stands
 * what closes loops. */
int64_t mstmm_compiled_size(const mstmm_fused *one, const mstmm_fused *lanes)
{
    const int64_t width = lanes ? lanes->lanes : 0;
    return one->nu + closing_size(one) + width * (one->nu + one->np + one->n_memory);
}

static void repeat_in_lanes(int64_t count, int lanes, const real *from, real *to)
{
    for (int64_t i = 0; i < count; i++)
        for (int j = 0; j < lanes; j++) to[i * lanes + j] = from[i];
}

static real *lanes_efforts(const mstmm_scene_run *run)
{
    return run->fused_numbers + run->fused->nu + closing_size(run->fused);
}

static real *lanes_p(const mstmm_scene_run *run)
{
    return lanes_efforts(run) + (int64_t)run->fused_lanes->lanes * run->fused->nu;
}

static real *lanes_memory(const mstmm_scene_run *run)
{
    return lanes_p(run) + (int64_t)run->fused_lanes->lanes * run->fused->np;
}

void mstmm_scene_compiled(mstmm_scene_run *run, const mstmm_fused *one, const mstmm_fused *lanes,
                          real *p, real *numbers)
{
    run->fused = one;
    run->fused_lanes = run->with_power || run->live.n ? NULL : lanes;
    run->fused_p = p;
    run->fused_numbers = numbers;
    memset(numbers, 0, (size_t)mstmm_compiled_size(one, lanes) * sizeof *numbers);
    if (run->fused_lanes) repeat_in_lanes(one->np, lanes->lanes, p, lanes_p(run));
}

static int fused_rhs(void *context, double t, const double *y, double *dy)
{
    mstmm_scene_run *run = context;
    const mstmm_fused *fused = run->fused;
    mstmm_renew_inputs(&run->live, t, run->memory, run->fused_p);
    const double *u = y + fused->nq;
    const int open = mstmm_stage_state(run, t, &y, &u);
    if (open) return open;
    const int code = fused->accelerations(run->fused_p, &t, y, u, run->memory, run->fused_numbers,
                                          dy, dy + fused->nq);
    return code ? mstmm_fused_failure(run, fused, code) : 0;
}

static int fused_rhs_with_power(void *context, double t, const double *y, double *dy)
{
    mstmm_scene_run *run = context;
    const mstmm_fused *fused = run->fused;
    real power = 0, potential;
    if (!fused->accelerations_power) { /* only impacts do work */
        dy[fused->nq + fused->nu] = 0;
        return fused_rhs(context, t, y, dy);
    }
    mstmm_renew_inputs(&run->live, t, run->memory, run->fused_p);
    const double *u = y + fused->nq;
    const int open = mstmm_stage_state(run, t, &y, &u);
    if (open) return open;
    const int code =
        fused->accelerations_power(run->fused_p, &t, y, u, run->memory, run->fused_numbers, dy,
                                   dy + fused->nq, &power, &potential);
    dy[fused->nq + fused->nu] = code ? 0 : power;
    return code ? mstmm_fused_failure(run, fused, code) : 0;
}

static int fused_rhs_in_lanes(void *context, const double *t, const double *y, double *dy,
                              int *codes)
{
    mstmm_scene_run *run = context;
    const mstmm_fused *fused = run->fused_lanes;
    const int64_t start = (int64_t)fused->nq * fused->lanes;
    if (fused->n_memory)
        repeat_in_lanes(fused->n_memory, fused->lanes, run->memory, lanes_memory(run));
    const int any = fused->accelerations_lanes(lanes_p(run), t, y, y + start, lanes_memory(run),
                                               lanes_efforts(run), dy, dy + start, codes);
    for (int lane = 0; any && lane < fused->lanes; lane++)
        if (codes[lane]) codes[lane] = mstmm_fused_failure(run, fused, codes[lane]);
    return any;
}

void mstmm_scene_system(mstmm_scene_run *run, mstmm_system *system)
{
    mstmm_looped_system(run, system);
    if (!run->fused) return;
    system->rhs = run->with_power ? fused_rhs_with_power : fused_rhs;
    if (!run->fused_lanes) return;
    system->lanes = run->fused_lanes->lanes;
    system->rhs_lanes = fused_rhs_in_lanes;
}

/* --- trajectories in SIMD lanes ----------------------------------------------------------- */

static int settle_lane(void *context, double t, double *y)
{
    mstmm_scene_lanes *lanes = context;
    return mstmm_scene_settle(lanes->settle, t, y);
}

/* The inputs of every lane's trajectory at its own time. */
static void renew_lanes(const mstmm_scene_lanes *lanes, const double *t)
{
    const mstmm_live_inputs *live = &lanes->live;
    const int width = lanes->fused->lanes;
    for (int lane = 0; lane < width; lane++)
        for (int i = 0; i < live->n; i++) {
            const mstmm_input *input = &live->inputs[lanes->trajectory[lane] * live->n + i];
            const int *places = live->places + MSTMM_INPUT_NUMBERS * i;
            const real *numbers = mstmm_input_at(input, t[lane]);
            for (int k = 0; k < MSTMM_INPUT_NUMBERS; k++)
                if (places[k] >= 0) lanes->numbers[places[k] * width + lane] = numbers[k];
        }
}

/* mstmm_stage_speeds of one lane, in place among those of all.  Where there are none they stay:
 * what is evaluated with them says why. */
static void project_lane_speeds(const mstmm_scene_lanes *lanes, int lane, real t, const real *y,
                                real *speeds, real *one)
{
    mstmm_scene_run *run = lanes->settle;
    const int64_t width = lanes->fused->lanes, nq = lanes->fused->nq, nu = lanes->fused->nu;
    for (int64_t i = 0; i < nq + nu; i++) one[i] = y[i * width + lane];
    const real *u = one + nq;
    mstmm_renew_inputs(&run->live, t, run->memory, run->fused_p);
    run->memory[run->model->strained] = 1;
    if (mstmm_stage_speeds(run, t, one, &u)) return;
    for (int64_t i = 0; i < nu; i++) speeds[i * width + lane] = u[i];
}

/* Speeds of states inside steps. */
static const real *lanes_speeds(const mstmm_scene_lanes *lanes, const double *t, const double *y)
{
    const mstmm_fused *fused = lanes->fused;
    const int64_t width = fused->lanes, nu = fused->nu;
    const real *u = y + fused->nq * width;
    real *speeds = lanes->numbers + width * (fused->np + nu);
    int any = 0;
    for (int lane = 0; lane < width; lane++) any |= lanes->near[lane];
    if (!any) return u;
    memcpy(speeds, u, (size_t)(width * nu) * sizeof(real));
    for (int lane = 0; lane < width; lane++)
        if (lanes->near[lane])
            project_lane_speeds(lanes, lane, t[lane], y, speeds, speeds + width * nu);
    return speeds;
}

static int lanes_rhs(void *context, const double *t, const double *y, double *dy, int *codes)
{
    const mstmm_scene_lanes *lanes = context;
    const mstmm_fused *fused = lanes->fused;
    const int64_t width = fused->lanes, start = fused->nq * width;
    if (lanes->live.n) renew_lanes(lanes, t);
    const real *efforts = lanes->numbers + width * fused->np, *u = lanes_speeds(lanes, t, y);
    return fused->accelerations_lanes(lanes->numbers, t, y, u, efforts, efforts, dy, dy + start,
                                      codes);
}

static void lanes_enter(void *context, int lane, int64_t trajectory)
{
    mstmm_scene_lanes *lanes = context;
    const real *p = lanes->p + trajectory * lanes->p_stride;
    lanes->trajectory[lane] = trajectory;
    lanes->near[lane] = 0;
    for (int64_t i = 0; i < lanes->fused->np; i++)
        lanes->numbers[i * lanes->fused->lanes + lane] = p[i];
}

static void lanes_accept(void *context, int lane)
{
    mstmm_scene_lanes *lanes = context;
    const mstmm_scene_run *run = lanes->settle;
    lanes->near[lane] = run->speeds && run->strain > run->model->loops_strain;
}

int64_t mstmm_lanes_numbers(const mstmm_fused *fused)
{
    return (int64_t)fused->lanes * (fused->np + 2 * fused->nu) + fused->nq + fused->nu;
}

void mstmm_scene_lanes_system(mstmm_scene_lanes *lanes, mstmm_system *system, mstmm_group *group)
{
    mstmm_scene_system(lanes->settle, system);
    memset(lanes->numbers, 0, (size_t)mstmm_lanes_numbers(lanes->fused) * sizeof(real));
    system->context = lanes;
    if (system->accept) system->accept = settle_lane;
    system->lanes = lanes->fused->lanes;
    system->rhs_lanes = lanes_rhs;
    group->system = system;
    group->enter = lanes_enter;
    group->accepted = lanes_accept;
}
