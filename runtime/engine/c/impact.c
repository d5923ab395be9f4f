/* Bounces: one impulse reverses the approach velocity of an event; closed loops stay closed.
 *
 * An event holds where g(t, q, x) >= 0.  Its rate v = g_t + A u is that with which it is met; the
 * impulse acts along A^T: u' = u - (1 + e) v / (A w) w, w = M^-1 A^T among closed loops, so that
 * v' = -e v.  See docs/explanation/closed-loops.md. */
#include <math.h>
#include <string.h>

#include "impact.h"
#include "kernel_calls.h"
#include "loop_closure.h"

/* Rebound speed, relative to the largest one of this event so far, that counts as rest. */
#define AT_REST 1e-6
/* Smallest response of the event, relative to the sum of its terms' magnitudes. */
#define MOVED 1e-12

/* Relative positions and speeds, of those that the event reads or of 1 rad or m and 1 s, that are
 * still on it, and do not move against it; as runtime/run/scene_system.py has it. */
#define CLOSE 1e-9

/* Numbers of a bounce: derivatives of its event, efforts, and three columns of speeds. */
typedef struct {
    real *slopes, *efforts, *speeds, *before, *answer;
} parts;

static parts impact_parts(const mstmm_scene_run *run, const mstmm_event_action *action)
{
    const int nu = run->model->nu;
    parts at = {.slopes = action->numbers};
    at.efforts = at.slopes + 1 + action->n_slopes;
    at.speeds = at.efforts + nu;
    at.before = at.speeds + nu;
    at.answer = at.before + nu;
    return at;
}

int mstmm_hook_apply_impact(mstmm_state *state)
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

/* Change of the speeds by efforts and forces along the derivatives of the event (NULL: none); it
 * includes the correction of velocity errors of closed loops. */
static int speed_change(mstmm_scene_run *run, const mstmm_strike *strike, real t, const real *y,
                        real *change)
{
    const mstmm_model *model = run->model;
    mstmm_state state = {.model = model,
                         .workspace = run->workspace,
                         .t = t,
                         .q = y,
                         .u = y + model->nq,
                         .memory = run->memory,
                         .observed = 1,
                         .level = MSTMM_SLIP,
                         .strike = strike,
                         .failure = &run->failure};
    return mstmm_run_correction_from_zero(&state, change);
}

/* How the event is met with other speeds than those of y. */
static int approach_at(mstmm_scene_run *run, const mstmm_event_action *action, const real *slopes,
                       real t, const real *y, const real *u, mstmm_meeting *found)
{
    const int code = mstmm_probes_seen(run, t, y, u);
    if (code) return code;
    *found = (mstmm_meeting){.rate = slopes[0], .size = fabs(slopes[0])};
    for (int k = 0; k < action->n_slopes; k++) {
        const int place = action->places[2 * k], at = -1 - place;
        const real *probe = run->probe_values + 6 * (at / 3) + at % 3;
        const real speed = place >= 0 ? u[action->places[2 * k + 1]] : probe[3];
        const real far = place >= 0 ? y[place] : probe[0];
        found->rate += slopes[1 + k] * speed;
        found->size += fabs(slopes[1 + k] * speed);
        found->steepness += fabs(slopes[1 + k]);
        found->reach += fabs(slopes[1 + k]) * fmax(1, fabs(far));
    }
    return 0;
}

/* w = M^-1 A^T with closed loops, and the correction of their velocity errors without impact. */
static int impulse_response(mstmm_scene_run *run, const mstmm_event_action *action, parts at,
                            real t, const real *y)
{
    const int nu = run->model->nu;
    const mstmm_strike strike = {
        .run = run, .action = action, .slopes = at.slopes, .efforts = at.efforts};
    memset(at.efforts, 0, (size_t)nu * sizeof(real));
    for (int k = 0; k < action->n_slopes; k++)
        if (action->places[2 * k] >= 0) at.efforts[action->places[2 * k + 1]] += at.slopes[1 + k];
    int code = speed_change(run, NULL, t, y, at.before);
    if (!code) code = speed_change(run, &strike, t, y, at.answer);
    for (int j = 0; j < nu; j++) {
        at.answer[j] -= at.before[j];
        at.speeds[j] = y[run->model->nq + j] + at.answer[j];
    }
    return code;
}

int mstmm_meeting_of(mstmm_scene_run *run, int event, real t, const real *y, const real *u,
                     mstmm_meeting *found)
{
    const mstmm_event_action *action = &run->events[event];
    const int code = mstmm_probes_tape(run, action->slopes, t, y, action->numbers);
    return code ? code : approach_at(run, action, action->numbers, t, y, u, found);
}

/* Impact: new speeds in y. */
static int strike(mstmm_scene_run *run, int event, parts at, real t, real *y, real before)
{
    const mstmm_event_action *action = &run->events[event];
    real *u = y + run->model->nq;
    mstmm_meeting behind;
    int code = impulse_response(run, action, at, t, y);
    if (!code) code = approach_at(run, action, at.slopes, t, y, at.speeds, &behind);
    if (!code && !(behind.rate - before > MOVED * behind.size)) {
        run->failure.element = event;
        code = run->failure.reason = MSTMM_FAILED_BOUNCE;
    }
    if (code) return code;
    const real push = -(1 + action->restitution) * before / (behind.rate - before);
    for (int j = 0; j < run->model->nu; j++) u[j] += at.before[j] + push * at.answer[j];
    return 0;
}

/* Impact with its work: positions do not change, so that all of it is kinetic energy.  It contains
 * the work of drives and moving walls, which the impulse along the derivatives does not. */
static int strike_with_work(mstmm_scene_run *run, int event, parts at, real t, real *y, real before)
{
    real *u = y + run->model->nq, had, has;
    int code = mstmm_kinetic_seen(run, t, y, u, &had);
    if (!code) code = strike(run, event, at, t, y, before);
    if (!code) code = mstmm_kinetic_seen(run, t, y, u, &has);
    if (!code) u[run->model->nu] += has - had;
    return code;
}

int mstmm_bounce(mstmm_scene_run *run, int event, real t, real *y)
{
    const mstmm_event_action *action = &run->events[event];
    real *fastest = run->memory + action->release;
    mstmm_meeting before;
    int code = mstmm_meeting_of(run, event, t, y, y + run->model->nq, &before);
    if (!code && !(before.rate > 0)) return MSTMM_FIRE_CONTINUE; /* it leaves already */
    if (!code)
        code = (run->with_power ? strike_with_work : strike)(run, event, impact_parts(run, action),
                                                             t, y, before.rate);
    if (code) return -code;
    *fastest = fmax(*fastest, before.rate);
    const int rests = action->restitution * before.rate < AT_REST * *fastest;
    return rests ? MSTMM_FIRE_STOP : MSTMM_FIRE_RESTART;
}

int mstmm_lets_through(mstmm_scene_run *run, int event, real t, const real *y, real g)
{
    mstmm_meeting at;
    if (!run->events[event].slopes) return 0;
    if (mstmm_meeting_of(run, event, t, y, y + run->model->nq, &at)) return 0;
    return g > CLOSE * at.reach && at.rate > CLOSE * (at.size + at.steepness);
}
