/* Equations of a step of implicit methods: residual, its derivative, and the factored tangent on
 * the tree and off it; see tangent.h. */
#include "off_tree_coupling.h"
#include "sweep_steps.h"

/* --- residual --- */

/* Power that drives and holds feed in. */
static real power_of_imposed(const mstmm_state *state, const real *required)
{
    const mstmm_model *model = state->model;
    real power = 0;
    for (int i = 0; model->n_imposed && i < model->n_bodies; i++) {
        const mstmm_body *body = &model->bodies[i];
        if (!mstmm_imposed_count(body, state->memory)) continue;
        for (int j = body->u; j < body->u + body->nu; j++)
            if (body->imposed_mask[j - body->u]) power += required[j] * state->u[j];
    }
    return power;
}

int mstmm_residual(mstmm_tangent *at, real t, const real *q, const real *u, const real *a, real *r,
                   mstmm_balance *balance)
{
    const mstmm_model *model = at->model;
    const mstmm_parts parts = tangent_parts(at);
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
    mstmm_state state = tangent_state(at, &parts);
    state.balance = balance;
    if (balance) balance->power = balance->potential = 0;
    mstmm_ground(&state);
    if (!code) code = mstmm_run_inverse_dynamics(&state);
    if (code) return code;
    mstmm_lacking(at, at->workspace, parts.answer, parts.required);
    at->known = 1;
    if (balance) balance->power += power_of_imposed(&state, parts.required);
    memcpy(r, parts.required, (size_t)model->nu * sizeof(real));
    mstmm_tangent_free(at, r);
    return 0;
}

static int equal_numbers(const real *one, const real *other, int n)
{
    return !memcmp(one, other, (size_t)n * sizeof(real));
}

int mstmm_residual_is_at(const mstmm_tangent *at, real t, const real *q, const real *u,
                         const real *a)
{
    const mstmm_model *model = at->model;
    const mstmm_parts parts = tangent_parts(at);
    return at->known && !(at->t < t) && !(at->t > t) && equal_numbers(parts.q, q, model->nq) &&
           equal_numbers(parts.u, u, model->nu) && (!a || equal_numbers(parts.a, a, model->nu));
}

int mstmm_residual_slope(mstmm_tangent *at, real d_t, const real *d_q, const real *d_u,
                         const real *d_a, real *d_r)
{
    const mstmm_parts parts = tangent_parts(at);
    mstmm_state state = known_state(at, &parts), slope = tangent_slope(at, &parts, d_r);
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
    mstmm_tangent_free(at, d_r);
    return 0;
}

/* --- tangent --- */

static void clear_direction(const mstmm_model *model, const mstmm_parts *parts)
{
    memset(parts->d_q, 0, (size_t)model->nq * sizeof(real));
    memset(parts->d_u, 0, (size_t)model->nu * sizeof(real));
    memset(parts->d_a, 0, (size_t)model->nu * sizeof(real));
}

static void set_steps(mstmm_tangent *at, real rate, real s, real sq, real kappa)
{
    at->rate = rate;
    at->s = s;
    at->sq = sq;
    at->kappa = kappa;
}

/* Passes of the tangent from no direction at all; `negative` is that of mstmm_tangents. */
static int run_tangent(mstmm_tangent *at, int (*run)(mstmm_state *), int *negative, int kept)
{
    const mstmm_parts parts = tangent_parts(at);
    at->approximate = 0;
    at->kept = kept;
    mstmm_tangents step = tangent_steps(at);
    step.negative = negative;
    mstmm_state state = known_state(at, &parts), slope = tangent_slope(at, &parts, parts.answer);
    state.slope = &slope;
    state.tangents = &step;
    clear_direction(at->model, &parts);
    memset(slope.workspace, 0, MSTMM_BLOCK_FIXED * sizeof(real)); /* the ground's */
    return run(&state);
}

int mstmm_tangent_contributions(mstmm_tangent *at, real rate, real s, real sq)
{
    set_steps(at, rate, s, sq, 0);
    return run_tangent(at, mstmm_run_tangent_contributions, NULL, 1);
}

int mstmm_tangent_factor(mstmm_tangent *at, real rate, real s, real sq, real kappa)
{
    set_steps(at, rate, s, sq, kappa);
    /* Without couplings a body that they stabilise may be unstable. */
    int negative = 0;
    /* If loads need poses, all bodies are initialised before the first elimination. */
    const int kept = at->keeps || at->model->needs_pose || at->model->product;
    const int code =
        run_tangent(at, mstmm_run_tangent, at->n_coupled || at->counts ? &negative : NULL, kept);
    return code || !at->n_coupled ? code : mstmm_across_factor(at, negative);
}

/* --- tangent of laws alone --- */

/* Unknown are accelerations: of the increments they are what carries the others along. */
static mstmm_tangents laws_steps(const mstmm_tangent *at)
{
    return (mstmm_tangents){.numbers = at->numbers,
                            .rate = at->rate / at->s,
                            .s = 1,
                            .sq = at->s * at->sq,
                            .approximate = 1};
}

int mstmm_laws_factor(mstmm_tangent *at, real rate, real s, real sq, real kappa)
{
    const mstmm_parts parts = tangent_parts(at);
    set_steps(at, rate, s, sq, kappa);
    at->approximate = 1;
    mstmm_tangents step = laws_steps(at);
    mstmm_state state = known_state(at, &parts), slope = tangent_slope(at, &parts, parts.answer);
    state.slope = &slope;
    state.tangents = &step;
    clear_direction(at->model, &parts);
    return mstmm_run_approximate_tangent(&state);
}

int mstmm_laws_solve(mstmm_tangent *at, const real *r, const real *dq, const real *du, real *a)
{
    const mstmm_parts parts = tangent_parts(at);
    mstmm_tangents step = laws_steps(at);
    mstmm_state state = known_state(at, &parts), slope = tangent_slope(at, &parts, parts.answer);
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
    return mstmm_run_approximate_solution(&state);
}

/* --- solutions --- */

static int solve_speeds_by_laws(mstmm_tangent *at, const real *r, real *du)
{
    const int code = mstmm_laws_solve(at, r, NULL, NULL, du);
    for (int j = 0; j < at->model->nu; j++) du[j] /= at->s;
    return code;
}

int mstmm_tangent_solve(mstmm_tangent *at, const real *r, const mstmm_known *known, real *x)
{
    int code = 0;
    if (at->approximate) return solve_speeds_by_laws(at, r, x);
    if (known && !at->kept) { /* first call with known increments: more will follow */
        at->keeps = 1;
        code = mstmm_tangent_factor(at, at->rate, at->s, at->sq, at->kappa);
    }
    return code ? code : mstmm_across_solve(at, r, known, NULL, x);
}

/* An inverse time so large that coordinates stay within rounding. */
#define STILL 1e200

int mstmm_accelerations_rate(mstmm_tangent *at, real *rate)
{
    const int nu = at->model->nu;
    const mstmm_parts parts = tangent_parts(at);
    real *missing = mstmm_across_missing(at);
    clear_direction(at->model, &parts);
    int code = mstmm_residual_slope(at, 1, parts.d_q, parts.d_u, parts.d_a, parts.still_efforts);
    if (code) return code;
    mstmm_rows_along(at, parts.shadow, parts.answer, missing);
    for (int j = 0; j < nu; j++) parts.still_efforts[j] = -parts.still_efforts[j];
    for (int k = 0; k < at->couplings->n_rows; k++) missing[k] = -missing[k];
    code = mstmm_tangent_factor(at, 0, 1, STILL, 0);
    return code ? code : mstmm_across_solve(at, parts.still_efforts, NULL, missing, rate);
}
