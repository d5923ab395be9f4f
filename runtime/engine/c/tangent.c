/* Entries of the residual and its tangent; see tangent.h.  The passes are printed from the schedule
 * (sweep_steps.c). */
#include "tangent.h"

#include <string.h>

#include "across.h"
#include "derivative_direction.h"
#include "sweep_steps.h"
#include "cache_tiling.h"

int64_t mstmm_bend_numbers(int n);
int64_t mstmm_port_numbers(int n);

/* Places of S from `place` on, where memory stays at hand: as tiles go from the tips to the root, a
 * place is taken again once all of its tile are eliminated.  Meanwhile bodies with places that are
 * free tell the next such body in `place`. */
static int64_t lay_carried(mstmm_model *model, int64_t place)
{
    int64_t unused = -1;
    for (int end = model->n_bodies, begun = end; end > 0; end -= MSTMM_TILE) {
        const int first = end > MSTMM_TILE ? end - MSTMM_TILE : 0;
        const int least = mstmm_least_parent(model, first, end);
        for (; begun > least; begun--) {
            mstmm_body *body = &model->bodies[begun - 1];
            body->carried = (int)(unused < 0 ? place : model->bodies[unused].carried);
            if (unused < 0)
                place += MSTMM_TANGENT_B(0, 0);
            else
                unused = model->bodies[unused].place;
        }
        for (int i = first; i < end; i++) {
            model->bodies[i].place = unused;
            unused = i;
        }
    }
    return place;
}

int64_t mstmm_tangent_lay(mstmm_model *model)
{
    /* The ground has an S that nobody reads, and a place that does not change. */
    int64_t place = MSTMM_TANGENT_B(0, 0) + MSTMM_PLACE_NUMBERS(0, 0);
    place = lay_carried(model, place);
    for (int i = 0; i < model->n_bodies; i++) {
        mstmm_body *body = &model->bodies[i];
        const int known = body->kernels->slope_tape || body->kernels->hinge_slope;
        if (!known || !body->kernels->bias_load_slope || !body->kernels->load_by_motion) return -1 - i;
        body->tangent = place;
        place += MSTMM_TANGENT_NUMBERS(body->nu, body->nq);
        body->place = 0;
        if (body->placed) {
            body->place = place;
            place += MSTMM_PLACE_NUMBERS(body->nu, body->nq);
        }
        if (body->modal) {
            body->modal->tangent = place;
            place += mstmm_bend_numbers(body->modal->n);
        }
        if (body->section && !body->section->inward) {
            body->section->tangent = place;
            place += mstmm_port_numbers(body->section->modal->n);
        }
    }
    for (int k = 0; k < model->n_forces; k++)
        if (!model->forces[k].wrench_slope) return -1 - model->n_bodies - k;
    return place;
}

int64_t mstmm_tangent_work(const mstmm_model *model, int64_t slots)
{
    return cut(model, slots, NULL).used;
}

int64_t mstmm_residual_work(const mstmm_model *model)
{
    return cut(model, 0, NULL).used_by_residual;
}

/* Prescribed speeds have no equations. */
static void without_imposed(const mstmm_model *model, const real *memory, real *rows)
{
    for (int i = 0; model->n_imposed && i < model->n_bodies; i++) {
        const mstmm_body *body = &model->bodies[i];
        if (!mstmm_imposed(body, memory)) continue;
        for (int j = 0; j < body->nu; j++)
            if (body->imposed_mask[j]) rows[body->u + j] = 0;
    }
}

void mstmm_tangent_free(const mstmm_tangent *at, real *entries)
{
    without_imposed(at->model, at->memory, entries);
}

/* Power that drives and holds feed in. */
static real power_of_imposed(const mstmm_state *state, const real *required)
{
    const mstmm_model *model = state->model;
    real power = 0;
    for (int i = 0; model->n_imposed && i < model->n_bodies; i++) {
        const mstmm_body *body = &model->bodies[i];
        if (!mstmm_imposed(body, state->memory)) continue;
        for (int j = body->u; j < body->u + body->nu; j++)
            if (body->imposed_mask[j - body->u]) power += required[j] * state->u[j];
    }
    return power;
}

int mstmm_residual(mstmm_tangent *at, real t, const real *q, const real *u, const real *a, real *r,
                   mstmm_balance *balance)
{
    const mstmm_model *model = at->model;
    const mstmm_parts parts = parts_of(at);
    at->t = t;
    memcpy(parts.q, q, (size_t)model->nq * sizeof(real));
    memcpy(parts.u, u, (size_t)model->nu * sizeof(real));
    at->known = 0;
    int code = 0;
    if (!a || model->looped) /* leaves the multipliers of closed loops in the workspace */
        code = mstmm_accelerations(model, at->workspace, t, parts.q, parts.u, at->memory, NULL,
                                   parts.qdot, parts.a, NULL, &at->failure);
    if (a) memcpy(parts.a, a, (size_t)model->nu * sizeof(real));
    if (model->looped) mstmm_set_own_apart(at, parts.a, parts.answer);
    mstmm_state state = state_of(at, &parts);
    state.balance = balance;
    if (balance) balance->power = balance->potential = 0;
    mstmm_ground(&state);
    if (!code) code = mstmm_run_inverse_dynamics(&state);
    if (code) return code;
    mstmm_lacking(at, at->workspace, parts.answer, parts.required);
    at->known = 1;
    if (balance) balance->power += power_of_imposed(&state, parts.required);
    memcpy(r, parts.required, (size_t)model->nu * sizeof(real));
    without_imposed(model, at->memory, r);
    return 0;
}

static int same(const real *one, const real *other, int n)
{
    return !memcmp(one, other, (size_t)n * sizeof(real));
}

int mstmm_residual_is_at(const mstmm_tangent *at, real t, const real *q, const real *u,
                         const real *a)
{
    const mstmm_model *model = at->model;
    const mstmm_parts parts = parts_of(at);
    return at->known && !(at->t < t) && !(at->t > t) && same(parts.q, q, model->nq)
           && same(parts.u, u, model->nu) && (!a || same(parts.a, a, model->nu));
}

int mstmm_residual_slope(mstmm_tangent *at, real d_t, const real *d_q, const real *d_u,
                         const real *d_a, real *d_r)
{
    const mstmm_parts parts = parts_of(at);
    mstmm_state state = known_state(at, &parts), slope = slope_of(at, &parts, d_r);
    memmove(parts.d_a, d_a, (size_t)at->model->nu * sizeof(real));
    mstmm_set_own_apart(at, parts.d_a, parts.answer);
    slope.t = d_t;
    slope.q = d_q;
    slope.u = d_u;
    state.slope = &slope;
    memset(slope.workspace, 0, MSTMM_BLOCK_FIXED * sizeof(real)); /* the ground's */
    mstmm_keep_multipliers(at->model, slope.workspace);
    const int code = mstmm_run_required_slope(&state);
    if (code) return code;
    mstmm_lacking(at, slope.workspace, parts.answer, d_r);
    without_imposed(at->model, at->memory, d_r);
    return 0;
}

static void take_steps(mstmm_tangent *at, real rate, real s, real sq, real kappa)
{
    at->rate = rate;
    at->s = s;
    at->sq = sq;
    at->kappa = kappa;
}

/* Passes of the tangent from no direction at all; `negative` is that of mstmm_tangents. */
static int run_tangent(mstmm_tangent *at, int (*run)(mstmm_state *), int *negative, int kept)
{
    const mstmm_model *model = at->model;
    const mstmm_parts parts = parts_of(at);
    mstmm_tangents step = {.numbers = at->numbers, .rate = at->rate, .s = at->s, .sq = at->sq,
                           .kappa = at->kappa, .negative = negative, .kept = kept};
    mstmm_state state = known_state(at, &parts), slope = slope_of(at, &parts, parts.answer);
    state.slope = &slope;
    state.tangents = &step;
    at->laws_alone = 0;
    at->kept = kept;
    memset(parts.d_q, 0, (size_t)model->nq * sizeof(real));
    memset(parts.d_u, 0, (size_t)model->nu * sizeof(real));
    memset(parts.d_a, 0, (size_t)model->nu * sizeof(real));
    memset(slope.workspace, 0, MSTMM_BLOCK_FIXED * sizeof(real)); /* the ground's */
    return run(&state);
}

int mstmm_tangent_brought(mstmm_tangent *at, real rate, real s, real sq)
{
    take_steps(at, rate, s, sq, 0);
    return run_tangent(at, mstmm_run_tangent_brought, NULL, 1);
}

int mstmm_tangent_factor(mstmm_tangent *at, real rate, real s, real sq, real kappa)
{
    take_steps(at, rate, s, sq, kappa);
    /* Without couplings a body that they stabilise may be unstable. */
    int negative = 0;
    /* If loads need poses, all bodies are initialised before the first elimination. */
    const int kept = at->keeps || at->model->needs_pose || at->model->product;
    const int code = run_tangent(at, mstmm_run_tangent,
                                 at->n_coupled || at->counts ? &negative : NULL, kept);
    return code || !at->n_coupled ? code : mstmm_across_factor(at, negative);
}

int64_t mstmm_tangent_pivots(const mstmm_tangent *at, int *sizes, real *pivots)
{
    int64_t place = 0;
    for (int i = 0; i < at->model->n_bodies; i++) {
        const mstmm_body *one = &at->model->bodies[i];
        const mstmm_modal *modal = mstmm_modal_of(one);
        int columns[6];
        const int shapes = one->idle || !one->modal ? 0 : mstmm_modes_of(modal);
        const int speeds =
            one->idle || one->section ? 0 : mstmm_free_speeds(at->memory, one, columns);
        const int64_t from[] = {shapes ? modal->tangent + MSTMM_BEND_D(shapes) : 0,
                                one->tangent + MSTMM_TANGENT_INVERSE(one->nu, one->nq)};
        sizes[2 * i] = shapes;
        sizes[2 * i + 1] = speeds;
        for (int part = 0; part < 2; part++) {
            const int count = sizes[2 * i + part] * sizes[2 * i + part];
            if (pivots) memcpy(pivots + place, at->numbers + from[part], sizeof(real) * (size_t)count);
            place += count;
        }
    }
    return place;
}

/* Unknown are accelerations: of the increments they are what carries the others along. */
static mstmm_tangents steps_of_laws(const mstmm_tangent *at)
{
    return (mstmm_tangents){.numbers = at->numbers, .rate = at->rate / at->s, .s = 1,
                            .sq = at->s * at->sq, .laws_alone = 1};
}

int mstmm_laws_factor(mstmm_tangent *at, real rate, real s, real sq, real kappa)
{
    const mstmm_model *model = at->model;
    const mstmm_parts parts = parts_of(at);
    take_steps(at, rate, s, sq, kappa);
    at->laws_alone = 1;
    mstmm_tangents step = steps_of_laws(at);
    mstmm_state state = known_state(at, &parts), slope = slope_of(at, &parts, parts.answer);
    state.slope = &slope;
    state.tangents = &step;
    memset(parts.d_q, 0, (size_t)model->nq * sizeof(real));
    memset(parts.d_u, 0, (size_t)model->nu * sizeof(real));
    memset(parts.d_a, 0, (size_t)model->nu * sizeof(real));
    return mstmm_run_laws_alone(&state);
}

int mstmm_laws_solve(mstmm_tangent *at, const real *r, const real *dq, const real *du, real *a)
{
    const mstmm_parts parts = parts_of(at);
    mstmm_tangents step = steps_of_laws(at);
    mstmm_state state = known_state(at, &parts), slope = slope_of(at, &parts, parts.answer);
    state.slope = &slope;
    state.tangents = &step;
    state.column = r;
    state.answer = a;
    step.shifted = dq && du;
    if (step.shifted) {
        slope.q = dq;
        slope.u = du;
    }
    memset(slope.workspace, 0, MSTMM_BLOCK_FIXED * sizeof(real)); /* the ground's */
    return mstmm_run_laws_solution(&state);
}

static int solve_by_laws(mstmm_tangent *at, const real *r, real *du)
{
    const int code = mstmm_laws_solve(at, r, NULL, NULL, du);
    for (int j = 0; j < at->model->nu; j++) du[j] /= at->s;
    return code;
}

int mstmm_tangent_solve(mstmm_tangent *at, const real *r, const mstmm_known *known, real *x)
{
    return at->laws_alone ? solve_by_laws(at, r, x) : mstmm_across_solve(at, r, known, NULL, x);
}

/* An inverse time so large that coordinates stay within rounding. */
#define STILL 1e200

int mstmm_accelerations_rate(mstmm_tangent *at, real *rate)
{
    const int nq = at->model->nq, nu = at->model->nu;
    const mstmm_parts parts = parts_of(at);
    real *missing = mstmm_across_missing(at);
    memset(parts.d_q, 0, (size_t)nq * sizeof(real));
    memset(parts.d_u, 0, (size_t)nu * sizeof(real));
    memset(parts.d_a, 0, (size_t)nu * sizeof(real));
    int code = mstmm_residual_slope(at, 1, parts.d_q, parts.d_u, parts.d_a, parts.still_efforts);
    if (code) return code;
    mstmm_rows_along(at, parts.shadow, parts.answer, missing);
    for (int j = 0; j < nu; j++) parts.still_efforts[j] = -parts.still_efforts[j];
    for (int k = 0; k < at->couplings->n_rows; k++) missing[k] = -missing[k];
    code = mstmm_tangent_factor(at, 0, 1, STILL, 0);
    return code ? code : mstmm_across_solve(at, parts.still_efforts, NULL, missing, rate);
}

/* Prescribed coordinates and speeds do not change and have no rates. */
static void without_imposed_coordinates(const mstmm_model *model, const real *memory, real *dq)
{
    for (int i = 0; model->n_imposed && i < model->n_bodies; i++) {
        const mstmm_body *body = &model->bodies[i];
        if (!mstmm_imposed(body, memory)) continue;
        if (body->n_imposed == body->nu)
            memset(dq + body->q, 0, (size_t)body->nq * sizeof(real));
        else /* rates are speeds where some of them alone are driven */
            for (int j = 0; j < body->nu; j++)
                if (body->imposed_mask[j]) dq[body->q + j] = 0;
    }
}

void mstmm_rates_slope(const mstmm_tangent *at, real *d_rates)
{
    memcpy(d_rates, parts_of(at).d_qdot, (size_t)at->model->nq * sizeof(real));
    without_imposed_coordinates(at->model, at->memory, d_rates);
}

int mstmm_tangent_rates(mstmm_tangent *at, const real *q, const real *u, real *dq)
{
    const mstmm_model *model = at->model;
    const mstmm_parts parts = parts_of(at);
    mstmm_state state = state_of(at, &parts);
    state.q = q;
    state.u = u;
    state.qdot = dq;
    for (int i = 0; i < model->n_bodies; i++) {
        const mstmm_body *body = &model->bodies[i];
        if (body->straight) {
            memcpy(dq + body->q, u + body->u, (size_t)body->nu * sizeof(real));
        } else {
            const int code = mstmm_at_hinge_motion(&state, i);
            if (code) return code;
        }
        if (body->modal)
            memcpy(dq + body->modal->q, u + body->modal->u, (size_t)body->modal->n * sizeof(real));
    }
    without_imposed_coordinates(model, at->memory, dq);
    return 0;
}

/* dq of a hinge whose rates go by its coordinates, with laws alone: what it changes the rates by is
 * taken from itself once. */
static int once_around(mstmm_state *state, const mstmm_tangent *at, const mstmm_body *body, int i)
{
    real *d_q = mstmm_aimed(state->slope->q) + body->q, *dq = state->tangents->change + body->q;
    int code = 0;
    for (int round = 0; !code && round < (at->kappa > 0 ? 2 : 1); round++) {
        code = mstmm_at_rates_change(state, i);
        for (int j = 0; j < body->nq; j++) d_q[j] = dq[j] /= at->sq;
    }
    memset(d_q, 0, (size_t)body->nq * sizeof(real));
    return code;
}

int mstmm_tangent_coordinates(mstmm_tangent *at, const real *du, const real *rho, real *dq)
{
    const mstmm_model *model = at->model;
    const mstmm_parts parts = parts_of(at);
    mstmm_tangents step = {.numbers = at->numbers, .rate = at->rate, .s = at->s, .sq = at->sq, .kappa = at->kappa,
                           .rho = rho ? rho : parts.still, .change = dq};
    mstmm_state state = known_state(at, &parts), slope = slope_of(at, &parts, parts.answer);
    state.slope = &slope;
    state.tangents = &step;
    memset(parts.d_q, 0, (size_t)model->nq * sizeof(real));
    slope.u = du;
    for (int i = 0; i < model->n_bodies; i++) {
        const mstmm_body *body = &model->bodies[i];
        if (body->straight) {
            for (int j = 0; j < body->nu; j++)
                dq[body->q + j] = (du[body->u + j] + step.rho[body->q + j]) / at->sq;
        } else {
            const int code = at->laws_alone ? once_around(&state, at, body, i)
                                            : mstmm_at_lagged(&state, i);
            if (code) return code;
        }
        if (!body->modal) continue;
        for (int j = 0; j < body->modal->n; j++) {
            const int place = body->modal->q + j;
            dq[place] = (du[body->modal->u + j] + step.rho[place]) / at->sq;
        }
    }
    without_imposed_coordinates(model, at->memory, dq);
    return 0;
}
