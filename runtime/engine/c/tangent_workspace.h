/* Working memory of the residual and its tangent. */
#ifndef MSTMM_TANGENT_PARTS_H
#define MSTMM_TANGENT_PARTS_H

#include <string.h>

#include "tangent.h"

/* Parts of `work`: state, accelerations and the rest of what a sweep writes, then a second
 * workspace and the direction. */
typedef struct {
    real *q, *u, *a, *required, *qdot, *shadow, *d_q, *d_u, *d_a, *d_qdot, *answer, *column;
    real *still, *change, *still_efforts;
    int64_t used, used_by_residual;
} mstmm_parts;

static inline mstmm_parts cut_tangent_work(const mstmm_model *model, int64_t slots, real *work)
{
    mstmm_parts at = {.used = 0};
    const int64_t nq = model->nq, nu = model->nu;
    const struct {
        real **to;
        int64_t count;
    } all[] = {
        {&at.q, nq},
        {&at.u, nu},
        {&at.a, nu},
        {&at.required, nu},
        {&at.qdot, nq},
        {&at.d_q, nq},
        {&at.d_u, nu},
        {&at.d_a, nu},
        {&at.d_qdot, nq},
        {&at.answer, nu},
        {&at.column, nu},
        {&at.still, nq},
        {&at.change, nq},
        {&at.still_efforts, nu},
        {&at.shadow, model->workspace + slots},
    };
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++) {
        if (work) *all[i].to = work + at.used;
        if (all[i].to == &at.shadow) at.used_by_residual = at.used;
        at.used += all[i].count;
    }
    return at;
}

static inline mstmm_parts tangent_parts(const mstmm_tangent *at)
{
    return cut_tangent_work(at->model, at->slots, at->work);
}

static inline mstmm_state tangent_state(mstmm_tangent *at, const mstmm_parts *parts)
{
    return (mstmm_state){.model = at->model,
                         .workspace = at->workspace,
                         .t = at->t,
                         .q = parts->q,
                         .u = parts->u,
                         .memory = at->memory,
                         .given = parts->a,
                         .required = parts->required,
                         .qdot = parts->qdot,
                         .failure = &at->failure,
                         .residual = 1};
}

/* The state of the last residual: driven coordinates have been filled in. */
static inline mstmm_state known_state(mstmm_tangent *at, const mstmm_parts *parts)
{
    mstmm_state state = tangent_state(at, parts);
    if (at->model->n_drives) {
        state.q = mstmm_filled_q(&state);
        state.u = mstmm_filled_u(&state);
    }
    return state;
}

/* Steps with which the tangent was factored. */
static inline mstmm_tangents tangent_steps(const mstmm_tangent *at)
{
    return (mstmm_tangents){.numbers = at->numbers,
                            .rate = at->rate,
                            .s = at->s,
                            .sq = at->sq,
                            .kappa = at->kappa,
                            .kept = at->kept};
}

static inline mstmm_state tangent_slope(mstmm_tangent *at, const mstmm_parts *parts, real *required)
{
    mstmm_state slope = tangent_state(at, parts);
    slope.workspace = parts->shadow;
    slope.t = 0;
    slope.q = parts->d_q;
    slope.u = parts->d_u;
    slope.given = parts->d_a;
    slope.required = required;
    slope.qdot = parts->d_qdot;
    return slope;
}

#endif
