/* Direction of the derivatives of one body: coordinates, speeds and accelerations in the arrays of
 * `state->slope`, which are zero elsewhere. */
#ifndef MSTMM_AIM_H
#define MSTMM_AIM_H

#include "sweep.h"

/* The derivatives' arrays are those of the caller of a sweep, who may write them. */
static inline real *mstmm_writable(const real *array) { return (real *)array; }

static inline void mstmm_aim_nowhere(mstmm_state *state, const mstmm_body *body)
{
    real *q = mstmm_writable(state->slope->q) + body->q,
         *u = mstmm_writable(state->slope->u) + body->u;
    real *given = mstmm_writable(state->slope->given) + body->u;
    mstmm_set_zero(q, body->nq);
    mstmm_set_zero(u, body->nu);
    mstmm_set_zero(given, body->nu);
}

/* A coordinate alone, a speed alone. */
static inline void mstmm_aim_coordinate(mstmm_state *state, const mstmm_body *body, int i)
{
    mstmm_aim_nowhere(state, body);
    mstmm_writable(state->slope->q)[body->q + i] = 1;
}

static inline void mstmm_aim_rate(mstmm_state *state, const mstmm_body *body, int j)
{
    mstmm_aim_nowhere(state, body);
    mstmm_writable(state->slope->u)[body->u + j] = 1;
}

/* A speed, the acceleration and the change of the coordinates that come with it in a step. */
static inline void mstmm_aim_unknown(mstmm_state *state, const mstmm_body *body, int j)
{
    const mstmm_tangents *step = state->tangents;
    real *q = mstmm_writable(state->slope->q) + body->q;
    mstmm_aim_rate(state, body, j);
    mstmm_writable(state->slope->u)[body->u + j] = step->rate;
    mstmm_writable(state->slope->given)[body->u + j] = step->s;
    if (body->straight) {
        q[j] = 1 / step->sq;
    } else {
        const real *along =
            step->numbers + body->tangent + MSTMM_TANGENT_ALONG(body->nu, body->nq) + j * body->nq;
        const real share = step->approximate ? 1 / step->sq : 1;
        for (int i = 0; i < body->nq; i++) q[i] = share * along[i];
    }
}

/* True if a law does not depend on an unknown because it acts on another coordinate. */
static inline int mstmm_law_ignores(const mstmm_body *body, const mstmm_law *law, int j)
{
    return law->kind == 0 && body->straight && j != law->speed;
}

static inline void mstmm_aim_no_mode(mstmm_state *state, const mstmm_modal *modal)
{
    for (int i = 0; i < modal->n; i++) {
        mstmm_writable(state->slope->q)[modal->q + i] = 0;
        mstmm_writable(state->slope->u)[modal->u + i] = 0;
        mstmm_writable(state->slope->given)[modal->u + i] = 0;
    }
}

static inline void mstmm_aim_mode(mstmm_state *state, const mstmm_modal *modal, int i)
{
    mstmm_aim_no_mode(state, modal);
    mstmm_writable(state->slope->q)[modal->q + i] = 1 / state->tangents->sq;
    mstmm_writable(state->slope->u)[modal->u + i] = state->tangents->rate;
    mstmm_writable(state->slope->given)[modal->u + i] = state->tangents->s;
}

/* Entry k of a motion, none for -1. */
static inline void mstmm_aim_motion(real *motion, int k)
{
    for (int i = 0; i < 9; i++) motion[i] = i == k;
}

/* Code of an elimination: a negative determinant is no failure if it is counted. */
static inline int mstmm_elimination_code(mstmm_state *state, int code)
{
    if (code != MSTMM_NEGATIVE || !state->tangents->negative) return code;
    *state->tangents->negative = !*state->tangents->negative;
    return 0;
}

/* The body of an element that has an end on the ground. */
static inline int mstmm_force_body(const mstmm_force *force)
{
    return force->body_f < 0 && force->body_t >= 0 ? force->body_t : force->body_f;
}

/* Numbers by place of a body, or (-1) of the ground: they follow its S. */
static inline int64_t mstmm_place_at(const mstmm_model *model, int body)
{
    return body < 0 ? MSTMM_TANGENT_B(0, 0) : model->bodies[body].place;
}

/* Location of S of the tangent: with the body's numbers if it is needed after the elimination of
 * the body, else in reused memory. */
#define mstmm_carried_at(tangents, body) ((tangents)->kept ? (body)->tangent : (body)->carried)

/* The same of a body or (-1) of the ground. */
#define mstmm_tangent_at(state, body)                                                              \
    ((body) < 0 ? 0 : mstmm_carried_at((state)->tangents, &(state)->model->bodies[body]))

#endif
