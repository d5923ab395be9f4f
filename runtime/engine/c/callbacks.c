/* Call-backs of the integrator: a run of a scene, evaluated by the looped engine. */
#include <math.h>
#include <string.h>

#include "impact.h"
#include "controllers.h"
#include "event_bounds.h"
#include "kernel_calls.h"
#include "loop_closure.h"
#include "scene.h"

/* From so many times the strain that is near a singular pose on, what rounding makes of the rows is
 * worth this relative error of a step, and so much for each part of the strain. */
#define SINGULAR 10
#define ATTAINABLE 1e-10
#define OF_STRAIN 2e-6

static int scene_rhs(void *context, double t, const double *y, double *dy)
{
    mstmm_scene_run *run = context;
    const mstmm_model *model = run->model;
    mstmm_balance balance;
    const double *u = y + model->nq;
    int code = mstmm_stage_state(run, t, &y, &u);
    if (!code)
        code =
            mstmm_accelerations(model, run->workspace, t, y, u, run->memory, NULL, dy,
                                dy + model->nq, run->with_power ? &balance : NULL, &run->failure);
    if (run->with_power) dy[model->nq + model->nu] = code ? 0 : balance.power;
    return code;
}

/* Twist memory of the quaternion laws: the turn the last accepted step ended in. */
static void remember_twists(mstmm_scene_run *run, const real *y)
{
    const mstmm_model *model = run->model;
    for (int k = 0; k < model->n_laws; k++) {
        const mstmm_law *law = &model->laws[k];
        if (law->twist < 0) continue;
        const mstmm_body *body = &model->bodies[law->body];
        real tau[6], potential, power, twist;
        mstmm_law_quaternion(law->evaluate, .p = law->p, .q = y + body->q + law->coordinate,
                             .u = mstmm_zeros, .B = law->axes, .effort = mstmm_zeros,
                             .twist_ref = run->memory + law->twist, .tau = tau, .V = &potential,
                             .P = &power, .twist = &twist);
        run->memory[law->twist] = twist;
    }
}

/* Unit quaternions, driven values, and closed loops. */
static int project_state(mstmm_scene_run *run, real t, real *y)
{
    const mstmm_model *model = run->model;
    mstmm_unit_quaternions(run->n_quaternions, run->quaternions, y);
    const int code =
        mstmm_fill_driven(model, run->workspace, t, y, y + model->nq, run->memory, &run->failure);
    return code || !model->looped ? code : mstmm_scene_close_loops(run, t, y);
}

int mstmm_scene_settle(mstmm_scene_run *run, real t, real *y)
{
    const int code = project_state(run, t, y);
    if (code) return code;
    remember_twists(run, y);
    if (run->base) run->base->known = 0;
    return 0;
}

int mstmm_scene_settle_many(mstmm_scene_run *run, int64_t n, int64_t width, const real *t,
                            real *memory, real *y)
{
    const int m = run->model->n_memory;
    real *own = run->memory;
    int first = 0;
    for (int64_t k = 0; k < n; k++) {
        run->memory = m ? memory + k * m : own; /* the projection writes the final turn */
        const int code = mstmm_scene_settle(run, t[k], y + k * width);
        if (code && !first) first = code;
    }
    run->memory = own;
    return first;
}

static int scene_accept(void *context, double t, double *y)
{
    mstmm_scene_run *run = context;
    const int code = mstmm_scene_settle(run, t, y), place = run->model->strained;
    const real usual = run->model->loops_strain;
    if (place >= 0) run->memory[place] = run->strain > usual;
    const real noise = fmax(ATTAINABLE, OF_STRAIN * run->strain);
    run->attainable = usual > 0 && run->strain > SINGULAR * usual ? noise : 0;
    const int forgets = run->rechosen ? -1 : 0;
    const int acted = code ? code : mstmm_controllers_act(run, t, y);
    return acted ? acted : forgets;
}

/* A state inside a step, to be projected, after the numbers of the probes. */
static int project_inside(mstmm_scene_run *run, real t, const real **y)
{
    real *own = run->probe_values + 6 * run->n_probes + MSTMM_PROBE_NUMBERS;
    if (!run->closes) return 0;
    memcpy(own, *y, (size_t)(run->model->nq + run->model->nu) * sizeof(real));
    *y = own;
    return project_state(run, t, own);
}

static int scene_events(void *context, double t, const double *y, double *g)
{
    mstmm_scene_run *run = context;
    const int code = project_inside(run, t, &y);
    return code ? code : mstmm_probes_tape(run, run->event_tape, t, y, g);
}

static int scene_fire(void *context, int event, double t, double *y)
{
    mstmm_scene_run *run = context;
    const mstmm_event_action *action = &run->events[event];
    if (run->base) run->base->known = 0;
    if (action->slopes) return mstmm_bounce(run, event, t, y);
    if (action->action == MSTMM_FIRE_RESTART) run->memory[action->release] = 1;
    return action->action;
}

static int scene_lets_through(void *context, int event, double t, const double *y, double g)
{
    return project_inside(context, t, &y) ? 0 : mstmm_lets_through(context, event, t, y, g);
}

/* True if there is anything to do after a step. */
static int needs_settling(const mstmm_scene_run *run)
{
    const mstmm_model *model = run->model;
    for (int k = 0; k < model->n_laws; k++)
        if (model->laws[k].twist >= 0) return 1;
    return run->n_quaternions > 0 || model->n_drives > 0 || run->n_controllers > 0 || model->looped;
}

void mstmm_looped_system(mstmm_scene_run *run, mstmm_system *system)
{
    const mstmm_model *model = run->model;
    memset(system, 0, sizeof *system);
    system->context = run;
    system->n_state = model->nq + model->nu + (run->with_power ? 1 : 0);
    system->n_error = system->n_state; /* the work too: its power has additional kinks */
    system->rhs = scene_rhs;
    system->accept = needs_settling(run) ? scene_accept : NULL;
    system->attainable = run->model->looped ? &run->attainable : NULL;
    system->n_events = run->n_events;
    system->n_switches = run->n_switches;
    system->events = scene_events;
    system->fire = scene_fire;
    system->lets_through = scene_lets_through;
    mstmm_enclose_events(run, system);
    system->n_memory = model->n_memory;
    system->memory = run->memory;
}
