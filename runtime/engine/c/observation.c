/* Observation of states: motion of points, loads, efforts, energies. */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "kernel_calls.h"
#include "loop_closure.h"
#include "scene.h"
#include "sweep_steps.h"

static mstmm_state observed_state(const mstmm_model *model, real *workspace, real t,
                                  const real *memory, mstmm_failure *failure)
{
    return (mstmm_state){.model = model,
                         .workspace = workspace,
                         .t = t,
                         .memory = memory,
                         .observed = 1,
                         .failure = failure};
}

/* State as `mstmm_accelerations_kept` left it: coordinates filled, hinges known, poses computed. */
static int complete_state(mstmm_state *state, const real *q, const real *u)
{
    const mstmm_model *model = state->model;
    state->q = model->n_drives ? mstmm_filled_q(state) : q;
    state->u = model->n_drives ? mstmm_filled_u(state) : u;
    state->qdot = mstmm_spare_qdot(state);
    for (int i = 0; i < model->n_bodies; i++) {
        int code = model->bodies[i].section ? mstmm_at_section_motion(state, i)
                                            : mstmm_at_hinge_motion(state, i);
        if (code) return code;
    }
    state->hinges_known = 1;
    return mstmm_run_poses_only(state);
}

void mstmm_point_shown(const mstmm_state *state, const mstmm_probe *probe, const real *delta,
                       real *out)
{
    const real *block = mstmm_block(state->model, state->workspace, probe->body);
    const int moves = probe->body >= 0;
    const real *a = block + MSTMM_BLOCK_A;
    const real *motion = moves ? block + MSTMM_BLOCK_MOTION : mstmm_zeros;
    mstmm_frames_point(.A = a, .x = block + MSTMM_BLOCK_X, .v = block + MSTMM_BLOCK_V,
                       .motion = motion, .delta = delta, .offset = probe->offset,
                       .gravity = moves ? state->model->gravity : mstmm_zeros, .x_K = out,
                       .v_K = out + 3, .a_K = out + 6);
    mstmm_frames_angular_motion(.A = a, .motion = motion, .delta = delta, .w_K = out + 9,
                                .alpha_K = out + 12);
    mstmm_frames_end_frame(.A = a, .R_end = probe->axes, .A_end = out + 15);
}

/* After a sweep, which leaves deviations from the bias motion. */
static void observe_probe(const mstmm_state *state, const mstmm_probe *probe, real *out)
{
    const real *block = mstmm_block(state->model, state->workspace, probe->body);
    mstmm_point_shown(state, probe, block + MSTMM_BLOCK_DELTA, out);
}

static void observe_hinges(const mstmm_state *state, const real *udot,
                           const mstmm_observation *wanted)
{
    const mstmm_model *model = state->model;
    for (int i = 0; i < model->n_bodies; i++) {
        const mstmm_body *body = &model->bodies[i];
        real *block = state->workspace + body->block;
        real load[6], force[3], moment[3];
        mstmm_frames_reaction(.S = block + MSTMM_BLOCK_S, .e = block + MSTMM_BLOCK_E,
                              .delta = block + MSTMM_BLOCK_DELTA, .A = block + MSTMM_BLOCK_A,
                              .f = load, .force = force, .moment = moment);
        if (wanted->loads) {
            mstmm_frames_moment_about(.A = block + MSTMM_BLOCK_A, .offset = body->connection + 12,
                                      .f = load, .moment = moment);
            memcpy(wanted->loads + 6 * (size_t)i, force, sizeof force);
            memcpy(wanted->loads + 6 * (size_t)i + 3, moment, sizeof moment);
        }
        if (!wanted->efforts) continue;
        real *efforts = wanted->efforts + body->u;
        mstmm_generic_effort(body->nu, .H = mstmm_of_speeds(block, body->nu, MSTMM_SPEED_H),
                             .f = load, .tau = efforts);
        for (int j = 0; j < body->nu; j++) efforts[j] += body->rotor[j] * udot[body->u + j];
        if (model->n_couplings) mstmm_efforts_without_couplings(state, i, efforts);
    }
}

/* Kinetic energy of a body with the rotors of its inboard hinge, and what it comes from: its
 * inertia and, of a flexible one, its momentum. */
static real kinetic_energy(mstmm_state *state, int i, real *inertia, real *momentum)
{
    const mstmm_body *body = &state->model->bodies[i];
    const real *block = state->workspace + body->block;
    real sum, energy;
    if (body->modal) {
        mstmm_at_momentum(state, i, inertia, momentum, &sum);
    } else {
        mstmm_body_inertia(body->kernels->inertia, .p = body->body_p, .S = inertia);
        mstmm_body_energy(body->kernels->energy, .p = body->body_p, .v = block + MSTMM_BLOCK_V,
                          .w = block + MSTMM_BLOCK_MOTION, .T = &sum);
    }
    for (int j = 0; j < body->nu; j++) {
        mstmm_frames_rotor_energy(.J = body->rotor + j, .u = state->u + body->u + j, .T = &energy);
        sum += energy;
    }
    return sum;
}

static void observe_sums(mstmm_state *state, const mstmm_balance *balance, real *sums)
{
    const mstmm_model *model = state->model;
    memset(sums, 0, MSTMM_SUM_NUMBERS * sizeof(real));
    for (int i = 0; i < model->n_bodies; i++) {
        const real *block = state->workspace + model->bodies[i].block;
        const real *a = block + MSTMM_BLOCK_A, *x = block + MSTMM_BLOCK_X;
        const real *v = block + MSTMM_BLOCK_V, *w = block + MSTMM_BLOCK_MOTION;
        real inertia[21], momentum[6], energy;
        sums[0] += kinetic_energy(state, i, inertia, momentum);
        if (model->bodies[i].modal)
            mstmm_frames_carried_momentum(.A = a, .x = x, .h = momentum, .p = sums + 4,
                                          .L = sums + 7);
        else
            mstmm_frames_momentum(.S = inertia, .A = a, .x = x, .v = v, .w = w, .L = sums + 4,
                                  .K = sums + 7);
        mstmm_frames_gravity_energy(.S = inertia, .A = a, .x = x, .gravity = model->gravity,
                                    .V = &energy);
        sums[1] += energy;
    }
    sums[2] = balance->potential;
    sums[3] = balance->power;
}

int mstmm_observe(const mstmm_model *model, real *workspace, real t, const real *q, const real *u,
                  const real *memory, const mstmm_observation *wanted, mstmm_failure *failure)
{
    mstmm_state state = observed_state(model, workspace, t, memory, failure);
    mstmm_balance balance;
    real *qdot = mstmm_spare_qdot(&state), *udot = mstmm_spare_udot(&state);
    int code =
        mstmm_accelerations_kept(model, workspace, t, q, u, memory, qdot, udot, &balance, failure);
    if (!code) code = complete_state(&state, q, u);
    if (code) return code;
    if (wanted->udot) memcpy(wanted->udot, udot, (size_t)model->nu * sizeof(real));
    if (wanted->points)
        for (int k = 0; k < wanted->n_probes; k++)
            observe_probe(&state, &wanted->probes[k],
                          wanted->points + (size_t)k * MSTMM_PROBE_NUMBERS);
    if (wanted->loads || wanted->efforts) observe_hinges(&state, udot, wanted);
    if (wanted->sums) observe_sums(&state, &balance, wanted->sums);
    for (int r = 0; wanted->rows && r < model->n_rows; r++)
        wanted->rows[r] = mstmm_row_numbers(model, workspace, r)[MSTMM_ROW_X];
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
        if (one.rows) one.rows += k * model->n_rows;
        *failed_at = k;
        int code = mstmm_observe(model, workspace, t[k], q + k * model->nq, u + k * model->nu,
                                 memory + k * model->n_memory, &one, failure);
        if (code) return code;
    }
    return 0;
}

int mstmm_kinetic_energies(const mstmm_model *model, real *workspace, int64_t n, const real *q,
                           const real *u, const real *memory, const real *still, real *efforts,
                           real *energies, mstmm_failure *failure)
{
    int code = 0;
    for (int64_t k = 0; k < n && !code; k++) {
        mstmm_state state = observed_state(model, workspace, 0, memory, failure);
        real inertia[21], momentum[6];
        code = mstmm_inverse_dynamics(model, workspace, 0, q, u + k * model->nu, memory, still,
                                      efforts, failure);
        if (!code) code = complete_state(&state, q, u + k * model->nu);
        for (int i = 0; i < model->n_bodies && !code; i++)
            energies[k * model->n_bodies + i] = kinetic_energy(&state, i, inertia, momentum);
    }
    return code;
}

int mstmm_accelerations_many(const mstmm_model *model, real *workspace, int64_t n, const real *t,
                             const real *q, const real *u, const real *memory, const real *efforts,
                             real *qdot, real *udot, mstmm_failure *failure, int64_t *failed_at)
{
    for (int64_t k = 0; k < n; k++) {
        *failed_at = k;
        int code = mstmm_accelerations(model, workspace, t[k], q + k * model->nq, u + k * model->nu,
                                       memory + k * model->n_memory,
                                       efforts ? efforts + k * model->nu : NULL,
                                       qdot + k * model->nq, udot + k * model->nu, NULL, failure);
        if (code) return code;
    }
    return 0;
}

/* --- states of a run --- */

/* Poses and velocities of all bodies of a state with speeds u, to be read from `state`. */
static int motion_state(mstmm_scene_run *run, real t, const real *y, const real *u,
                        mstmm_state *state)
{
    *state = observed_state(run->model, run->workspace, t, run->memory, &run->failure);
    state->q = y;
    state->u = u;
    state->qdot = mstmm_spare_qdot(state);
    mstmm_ground(state);
    return mstmm_run_motion(state);
}

int mstmm_probes_seen(mstmm_scene_run *run, real t, const real *y, const real *u)
{
    if (!run->n_probes) return 0;
    real *one = run->probe_values + 6 * run->n_probes;
    mstmm_state state;
    const int code = motion_state(run, t, y, u, &state);
    if (code) return code;
    for (int k = 0; k < run->n_probes; k++) {
        observe_probe(&state, &run->probes[k], one);
        memcpy(run->probe_values + 6 * k, one, 6 * sizeof(real));
    }
    return 0;
}

int mstmm_kinetic_seen(mstmm_scene_run *run, real t, const real *y, const real *u, real *energy)
{
    mstmm_state state;
    real inertia[21], momentum[6];
    const int code = motion_state(run, t, y, u, &state);
    *energy = 0;
    for (int i = 0; i < run->model->n_bodies && !code; i++)
        *energy += kinetic_energy(&state, i, inertia, momentum);
    return code;
}

int mstmm_probes_tape(mstmm_scene_run *run, const mstmm_tape *tape, real t, const real *y,
                      real *values)
{
    const mstmm_state state = {
        .model = run->model, .workspace = run->workspace, .t = t, .memory = run->memory};
    const real *u = y + run->model->nq;
    const int code = mstmm_probes_seen(run, t, y, u);
    if (code) return code;
    const real *inputs[] = {&t, y, u, run->probe_values, mstmm_input_numbers(&state)};
    real *outputs[] = {values};
    return mstmm_tape_run(tape, inputs, mstmm_slots(&state), outputs) ? MSTMM_FAILED_EXPRESSION : 0;
}
