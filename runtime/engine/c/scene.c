/* Observation of states, and the integrator's call-backs. */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "elements.h"
#include "compiled.h"
#include "modal.h"

typedef int (*energy_kernel)(const real *p, const real *v, const real *w, real *energy);
typedef int (*inertia_kernel)(const real *p, real *inertia);
typedef int (*quaternion_law)(const real *p, const real *q, const real *u, const real *axes,
                              const real *effort, const real *reference, real *tau,
                              real *potential, real *power, real *twist);

static mstmm_state state_of(const mstmm_model *model, real *workspace, real t, const real *memory,
                            mstmm_failure *failure)
{
    return (mstmm_state){.model = model, .workspace = workspace, .t = t, .memory = memory,
                         .observed = 1, .failure = failure};
}

/* State as `mstmm_accelerations` left it: coordinates filled, hinges known, poses computed. */
static int complete(mstmm_state *state, const real *q, const real *u)
{
    const mstmm_model *model = state->model;
    const real *scratch = state->workspace + model->scratch;
    state->q = model->n_drives ? scratch : q;
    state->u = model->n_drives ? scratch + model->nq : u;
    state->values = state->workspace + model->scratch + model->nq + model->nu;
    state->slots = state->values + model->n_values + 3 * model->n_drives;
    real *qdot = state->slots + model->tape_slots;
    for (int i = 0; i < model->n_bodies; i++) {
        const mstmm_body *body = &model->bodies[i];
        int code = body->section ? mstmm_section_motion(state, i)
                                 : mstmm_hinge_motion(state, i, qdot + body->q);
        if (code) return code;
    }
    mstmm_pose_pass(state, 1);
    return 0;
}

static void observe_probe(const mstmm_state *state, const mstmm_probe *probe, real *out)
{
    const real *block = mstmm_block(state->model, state->workspace, probe->body);
    static const real rest[9] = {0};
    const real *motion = probe->body < 0 ? rest : block + MSTMM_BLOCK_MOTION;
    const real *gravity = probe->body < 0 ? rest : state->model->gravity;
    mstmm_sweep_frames_point(block + MSTMM_BLOCK_A, block + MSTMM_BLOCK_X, block + MSTMM_BLOCK_V,
                             motion, block + MSTMM_BLOCK_DELTA, probe->offset, gravity, out,
                             out + 3, out + 6);
    mstmm_sweep_frames_turning(block + MSTMM_BLOCK_A, motion, block + MSTMM_BLOCK_DELTA, out + 9,
                               out + 12);
    mstmm_sweep_frames_end_frame(block + MSTMM_BLOCK_A, probe->axes, out + 15);
}

static void observe_hinges(const mstmm_state *state, const real *udot,
                           const mstmm_observation *wanted)
{
    const mstmm_model *model = state->model;
    for (int i = 0; i < model->n_bodies; i++) {
        const mstmm_body *body = &model->bodies[i];
        real *block = state->workspace + body->block;
        real load[6], force[3], moment[3];
        mstmm_sweep_frames_reaction(block + MSTMM_BLOCK_S, block + MSTMM_BLOCK_E,
                                    block + MSTMM_BLOCK_DELTA, block + MSTMM_BLOCK_A, load, force,
                                    moment);
        if (wanted->loads) {
            mstmm_sweep_frames_moment_at(block + MSTMM_BLOCK_A, body->held, load, moment);
            memcpy(wanted->loads + 6 * (size_t)i, force, sizeof force);
            memcpy(wanted->loads + 6 * (size_t)i + 3, moment, sizeof moment);
        }
        if (!wanted->efforts) continue;
        real *efforts = wanted->efforts + body->u;
        mstmm_effort(body->nu, mstmm_h(block, body->nu), load, efforts);
        for (int j = 0; j < body->nu; j++) efforts[j] += body->rotor[j] * udot[body->u + j];
    }
}

static void observe_sums(const mstmm_state *state, const mstmm_balance *balance, real *sums)
{
    const mstmm_model *model = state->model;
    memset(sums, 0, MSTMM_SUM_NUMBERS * sizeof(real));
    for (int i = 0; i < model->n_bodies; i++) {
        const mstmm_body *body = &model->bodies[i];
        const real *block = state->workspace + body->block;
        const real *a = block + MSTMM_BLOCK_A, *x = block + MSTMM_BLOCK_X;
        const real *v = block + MSTMM_BLOCK_V, *w = block + MSTMM_BLOCK_MOTION;
        real inertia[21], momentum[6], energy;
        if (body->modal) {
            mstmm_modal_momentum(state, i, inertia, momentum, &energy);
            mstmm_sweep_frames_carried_momentum(a, x, momentum, sums + 4, sums + 7);
        } else {
            ((inertia_kernel)body->inertia)(body->body_p, inertia);
            ((energy_kernel)body->energy)(body->body_p, v, w, &energy);
            mstmm_sweep_frames_momentum(inertia, a, x, v, w, sums + 4, sums + 7);
        }
        sums[0] += energy;
        for (int j = 0; j < body->nu; j++) {
            mstmm_sweep_frames_rotor_energy(body->rotor + j, state->u + body->u + j, &energy);
            sums[0] += energy;
        }
        mstmm_sweep_frames_gravity_energy(inertia, a, x, model->gravity, &energy);
        sums[1] += energy;
    }
    sums[2] = balance->potential;
    sums[3] = balance->power;
}

int mstmm_observe(const mstmm_model *model, real *workspace, real t, const real *q, const real *u,
                  const real *memory, const mstmm_observation *wanted, mstmm_failure *failure)
{
    mstmm_state state = state_of(model, workspace, t, memory, failure);
    mstmm_balance balance;
    real *slots = workspace + model->scratch + model->nq + model->nu + model->n_values +
                  3 * model->n_drives;
    real *qdot = slots + model->tape_slots, *udot = qdot + model->nq;
    int code =
        mstmm_accelerations_kept(model, workspace, t, q, u, memory, qdot, udot, &balance, failure);
    if (!code) code = complete(&state, q, u);
    if (code) return code;
    if (wanted->udot) memcpy(wanted->udot, udot, (size_t)model->nu * sizeof(real));
    if (wanted->points)
        for (int k = 0; k < wanted->n_probes; k++)
            observe_probe(&state, &wanted->probes[k],
                          wanted->points + (size_t)k * MSTMM_PROBE_NUMBERS);
    if (wanted->loads || wanted->efforts) observe_hinges(&state, udot, wanted);
    if (wanted->sums) observe_sums(&state, &balance, wanted->sums);
    return 0;
}

int mstmm_observe_many(const mstmm_model *model, real *workspace, int64_t n, const real *t,
                       const real *q, const real *u, const real *memory,
                       const mstmm_observation *wanted, mstmm_failure *failure, int64_t *failed_at)
{
    for (int64_t k = 0; k < n; k++) {
        mstmm_observation one = *wanted;
        if (one.points) one.points += k * one.n_probes * MSTMM_PROBE_NUMBERS;
        if (one.loads) one.loads += k * model->n_bodies * 6;
        if (one.efforts) one.efforts += k * model->nu;
        if (one.udot) one.udot += k * model->nu;
        if (one.sums) one.sums += k * MSTMM_SUM_NUMBERS;
        *failed_at = k;
        int code = mstmm_observe(model, workspace, t[k], q + k * model->nq, u + k * model->nu,
                                 memory + k * model->n_memory, &one, failure);
        if (code) return code;
    }
    return 0;
}

int mstmm_accelerations_many(const mstmm_model *model, real *workspace, int64_t n, const real *t,
                             const real *q, const real *u, const real *memory,
                             const real *efforts, real *qdot, real *udot, mstmm_failure *failure,
                             int64_t *failed_at)
{
    for (int64_t k = 0; k < n; k++) {
        *failed_at = k;
        int code = mstmm_accelerations(model, workspace, t[k], q + k * model->nq,
                                       u + k * model->nu, memory + k * model->n_memory,
                                       efforts ? efforts + k * model->nu : NULL,
                                       qdot + k * model->nq, udot + k * model->nu, NULL, failure);
        if (code) return code;
    }
    return 0;
}

/* --- call-backs of the integrator ----------------------------------------------------------- */

static int scene_rhs(void *context, double t, const double *y, double *dy)
{
    mstmm_scene_run *run = context;
    const mstmm_model *model = run->model;
    mstmm_balance balance;
    int code = mstmm_accelerations(model, run->workspace, t, y, y + model->nq, run->memory, NULL,
                                   dy, dy + model->nq, run->with_power ? &balance : NULL,
                                   &run->failure);
    if (run->with_power) dy[model->nq + model->nu] = code ? 0 : balance.power;
    return code;
}

/* Twist memory of the quaternion laws: the turn the last accepted step ended in. */
static void remember_twists(mstmm_scene_run *run, const real *y)
{
    static const real zero[6] = {0};
    const mstmm_model *model = run->model;
    for (int k = 0; k < model->n_laws; k++) {
        const mstmm_law *law = &model->laws[k];
        if (law->twist < 0) continue;
        const mstmm_body *body = &model->bodies[law->body];
        real tau[6], potential, power, twist;
        ((quaternion_law)law->evaluate)(law->p, y + body->q + law->coordinate, zero, law->axes,
                                        zero, run->memory + law->twist, tau, &potential, &power,
                                        &twist);
        run->memory[law->twist] = twist;
    }
}

int mstmm_scene_settle(mstmm_scene_run *run, real t, real *y)
{
    const mstmm_model *model = run->model;
    for (int k = 0; k < run->n_quaternions; k++) {
        real *unit = y + run->quaternions[k];
        real norm = sqrt(unit[0] * unit[0] + unit[1] * unit[1] + unit[2] * unit[2] +
                         unit[3] * unit[3]);
        for (int j = 0; j < 4; j++) unit[j] /= norm;
    }
    if (model->n_drives) {
        mstmm_state state = state_of(model, run->workspace, t, run->memory, &run->failure);
        int code = mstmm_state_begin(&state, y, y + model->nq);
        if (code) return code;
        memcpy(y, state.q, (size_t)model->nq * sizeof(real));
        memcpy(y + model->nq, state.u, (size_t)model->nu * sizeof(real));
    }
    remember_twists(run, y);
    return 0;
}

int mstmm_scene_settle_many(mstmm_scene_run *run, int64_t n, int64_t width, const real *t,
                            real *memory, real *y)
{
    const int m = run->model->n_memory;
    real *own = run->memory;
    int first = 0;
    for (int64_t k = 0; k < n; k++) {
        run->memory = m ? memory + k * m : own; /* settling writes the turn it ends in */
        const int code = mstmm_scene_settle(run, t[k], y + k * width);
        if (code && !first) first = code;
    }
    run->memory = own;
    return first;
}

static int scene_accept(void *context, double t, double *y)
{
    return mstmm_scene_settle(context, t, y);
}

static int scene_events(void *context, double t, const double *y, double *g)
{
    mstmm_scene_run *run = context;
    const mstmm_model *model = run->model;
    const real *u = y + model->nq;
    real *slots = run->workspace + model->scratch + model->nq + model->nu + model->n_values +
                  3 * model->n_drives;
    if (run->n_probes) {
        mstmm_state state = state_of(model, run->workspace, t, run->memory, &run->failure);
        real *qdot = slots + model->tape_slots, *one = run->probe_values + 6 * run->n_probes;
        int code = mstmm_state_begin(&state, y, u);
        if (!code) code = mstmm_forward_pass(&state, qdot);
        if (code) return code;
        mstmm_pose_pass(&state, 0);
        for (int k = 0; k < run->n_probes; k++) {
            observe_probe(&state, &run->probes[k], one);
            memcpy(run->probe_values + 6 * k, one, 6 * sizeof(real));
        }
    }
    const real *inputs[] = {&t, y, u, run->probe_values};
    real *outputs[] = {g};
    return mstmm_tape_run(run->event_tape, inputs, slots, outputs)
               ? MSTMM_FAILED_EXPRESSION
               : 0;
}

static int scene_fire(void *context, int event, double t, double *y)
{
    mstmm_scene_run *run = context;
    const mstmm_event_action *action = &run->events[event];
    (void)t;
    (void)y;
    if (action->action == MSTMM_FIRE_RESTART) run->memory[action->release] = 1;
    return action->action;
}

/* Is there anything for `mstmm_scene_settle` to do? */
static int needs_settling(const mstmm_scene_run *run)
{
    const mstmm_model *model = run->model;
    for (int k = 0; k < model->n_laws; k++)
        if (model->laws[k].twist >= 0) return 1;
    return run->n_quaternions > 0 || model->n_drives > 0;
}

void mstmm_scene_system(mstmm_scene_run *run, mstmm_system *system)
{
    const mstmm_model *model = run->model;
    memset(system, 0, sizeof *system);
    system->context = run;
    system->n_state = model->nq + model->nu + (run->with_power ? 1 : 0);
    system->n_error = system->n_state; /* the work too: its power has kinks that motion has not */
    system->rhs = scene_rhs;
    system->accept = needs_settling(run) ? scene_accept : NULL;
    system->n_events = run->n_events;
    system->n_switches = run->n_switches;
    system->events = scene_events;
    system->fire = scene_fire;
    system->n_memory = model->n_memory;
    system->memory = run->memory;
    if (run->fused) mstmm_compiled_system(run, system);
}
