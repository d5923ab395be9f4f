/* Bounces: what an event strikes is thrown back by one impulse, and closed loops stay closed.
 *
 * An event holds where g(t, q, x) >= 0.  Its rate v = g_t + A u is that with which it is met; the
 * impulse acts along A^T: u' = u - (1 + e) v / (A w) w, w = M^-1 A^T among closed loops, so that
 * v' = -e v.  See docs/theory/loops.md. */
#include <math.h>
#include <string.h>

#include "bounce.h"
#include "kernel_calls.h"
#include "sweep_steps.h"

/* Rebound in parts of the fastest one of this event so far, at which it has come to rest. */
#define AT_REST 1e-6
/* Least answer of the event, in parts of what its terms could give. */
#define MOVED 1e-12

/* Numbers of a bounce: slopes of its event, efforts, and three columns of speeds. */
typedef struct {
    real *slopes, *efforts, *speeds, *before, *answer;
} parts;

static parts parts_of(const mstmm_scene_run *run, const mstmm_event_action *action)
{
    const int nu = run->model->nu;
    parts at = {.slopes = action->numbers};
    at.efforts = at.slopes + 1 + action->n_slopes;
    at.speeds = at.efforts + nu;
    at.before = at.speeds + nu;
    at.answer = at.before + nu;
    return at;
}

int mstmm_hook_struck(mstmm_state *state)
{
    const mstmm_strike *strike = state->strike;
    if (!strike) return 0;
    for (int i = 0; i < state->model->n_bodies; i++) {
        const mstmm_body *body = &state->model->bodies[i];
        real *block = state->workspace + body->block;
        memcpy(mstmm_of_speeds(block, body->nu, MSTMM_SPEED_TAU), strike->efforts + body->u,
               (size_t)body->nu * sizeof(real));
    }
    for (int k = 0; k < strike->action->n_slopes; k++) {
        const int place = strike->action->places[2 * k], at = -1 - place;
        if (place >= 0) continue;
        const mstmm_probe *probe = &strike->run->probes[at / 3];
        real *block = mstmm_block(state->model, state->workspace, probe->body);
        real force[3] = {0, 0, 0};
        force[at % 3] = strike->slopes[1 + k];
        mstmm_frames_applied_load(.A = block + MSTMM_BLOCK_A, .A_F = mstmm_identity,
                                  .offset = probe->offset, .F = force, .M = mstmm_zeros,
                                  .e = block + MSTMM_BLOCK_E);
    }
    return 0;
}

/* Change of the speeds, by efforts and forces along the slopes of the event (NULL: by none): what
 * stops the slip of closed loops is in it. */
static int answered(mstmm_scene_run *run, const mstmm_strike *strike, real t, const real *y,
                    real *change)
{
    const mstmm_model *model = run->model;
    mstmm_state state = {.model = model, .workspace = run->workspace, .t = t, .q = y,
                         .u = y + model->nq, .memory = run->memory, .udot = change, .observed = 1,
                         .level = MSTMM_SLIP, .strike = strike, .failure = &run->failure};
    memset(change, 0, (size_t)model->nu * sizeof(real));
    state.given = change;
    state.qdot = mstmm_spare_qdot(&state);
    mstmm_ground(&state);
    return mstmm_run_correction(&state);
}

/* Rate of the event with other speeds than those of y: *rate, and the sum of its terms' sizes. */
static int met(mstmm_scene_run *run, const mstmm_event_action *action, const real *slopes, real t,
               const real *y, const real *u, real *rate, real *size)
{
    const int code = mstmm_probes_seen(run, t, y, u);
    if (code) return code;
    *rate = slopes[0];
    *size = fabs(slopes[0]);
    for (int k = 0; k < action->n_slopes; k++) {
        const int place = action->places[2 * k], at = -1 - place;
        const real speed = place >= 0 ? u[action->places[2 * k + 1]]
                                      : run->probe_values[6 * (at / 3) + 3 + at % 3];
        *rate += slopes[1 + k] * speed;
        *size += fabs(slopes[1 + k] * speed);
    }
    return 0;
}

static int slopes_at(mstmm_scene_run *run, const mstmm_event_action *action, real t, const real *y,
                     real *slopes)
{
    mstmm_state state = {.model = run->model, .workspace = run->workspace, .t = t,
                         .memory = run->memory};
    const real *u = y + run->model->nq;
    const int code = mstmm_probes_seen(run, t, y, u);
    if (code) return code;
    const real *inputs[] = {&t, y, u, run->probe_values, mstmm_input_numbers(&state)};
    real *outputs[] = {slopes};
    return mstmm_tape_run(action->slopes, inputs, mstmm_slots(&state), outputs)
               ? MSTMM_FAILED_EXPRESSION
               : 0;
}

/* w = M^-1 A^T among closed loops, and what stops their slip without a strike. */
static int thrown(mstmm_scene_run *run, const mstmm_event_action *action, parts at, real t,
                  const real *y)
{
    const int nu = run->model->nu;
    const mstmm_strike strike = {.run = run, .action = action, .slopes = at.slopes,
                                 .efforts = at.efforts};
    memset(at.efforts, 0, (size_t)nu * sizeof(real));
    for (int k = 0; k < action->n_slopes; k++)
        if (action->places[2 * k] >= 0) at.efforts[action->places[2 * k + 1]] += at.slopes[1 + k];
    int code = answered(run, NULL, t, y, at.before);
    if (!code) code = answered(run, &strike, t, y, at.answer);
    for (int j = 0; j < nu; j++) {
        at.answer[j] -= at.before[j];
        at.speeds[j] = y[run->model->nq + j] + at.answer[j];
    }
    return code;
}

int mstmm_bounce(mstmm_scene_run *run, int event, real t, real *y)
{
    const mstmm_event_action *action = &run->events[event];
    const parts at = parts_of(run, action);
    real *u = y + run->model->nq, *fastest = run->memory + action->release;
    real before = 0, behind = 0, size = 0;
    int code = slopes_at(run, action, t, y, at.slopes);
    if (!code) code = met(run, action, at.slopes, t, y, u, &before, &size);
    if (!code && !(before > 0)) return MSTMM_FIRE_CONTINUE; /* it leaves already */
    if (!code) code = thrown(run, action, at, t, y);
    if (!code) code = met(run, action, at.slopes, t, y, at.speeds, &behind, &size);
    if (!code && !(behind - before > MOVED * size)) {
        run->failure.element = event;
        code = run->failure.reason = MSTMM_FAILED_BOUNCE;
    }
    if (code) return -code;
    const real push = -(1 + action->restitution) * before / (behind - before);
    for (int j = 0; j < run->model->nu; j++) u[j] += at.before[j] + push * at.answer[j];
    /* An impulse does its size times the mean of the speeds along it before and behind, which are
     * the rates but for what the event itself moves by. */
    if (run->with_power)
        u[run->model->nu] += push * ((1 - action->restitution) * before / 2 - at.slopes[0]);
    *fastest = fmax(*fastest, before);
    const int rests = action->restitution * before < AT_REST * *fastest;
    return rests ? MSTMM_FIRE_STOP : MSTMM_FIRE_RESTART;
}
