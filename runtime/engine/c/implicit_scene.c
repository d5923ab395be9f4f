/* Interface of a scene to implicit methods: residual and factored tangent. */
#include <string.h>

#include "loop_closure.h"
#include "scene.h"
#include "sweep_steps.h"

static int note_tangent_failure(mstmm_scene_run *run, const mstmm_tangent *at, int code)
{
    if (code) run->failure = at->failure;
    return code;
}

/* With closed loops: what accelerations are beyond those that the constrained motion has. */
static int excess_accelerations(mstmm_scene_run *run, double t, const double *y, const double *a,
                                double *r, mstmm_balance *balance)
{
    const mstmm_model *model = run->model;
    real *qdot = run->known, *f = qdot + model->nq;
    const int code = mstmm_accelerations(model, run->workspace, t, y, y + model->nq, run->memory,
                                         NULL, qdot, f, balance, &run->failure);
    for (int j = 0; !code && j < model->nu; j++) r[j] = a[j] - f[j];
    if (!code) mstmm_tangent_free(run->base, r);
    return code;
}

/* And than those by which steps end with closed gaps. */
static int excess_placing_accelerations(void *context, double t, const double *y, const double *a,
                                        double closing, double *r)
{
    mstmm_scene_run *run = context;
    const mstmm_model *model = run->model;
    real *qdot = run->known, *found = qdot + model->nq;
    const int code =
        mstmm_placing_accelerations(model, run->workspace, closing, t, y, y + model->nq, a,
                                    run->memory, qdot, found, &run->failure);
    for (int j = 0; !code && j < model->nu; j++) r[j] = a[j] - found[j];
    if (!code) mstmm_tangent_free(run->base, r);
    return code;
}

static int looped_residual(void *context, double t, const double *y, const double *a, double *r,
                           double *work)
{
    mstmm_scene_run *run = context;
    mstmm_balance balance;
    const int wanted = work && run->with_power;
    if (run->model->looped) {
        const int code = excess_accelerations(run, t, y, a, r, wanted ? &balance : NULL);
        if (wanted) *work = code ? 0 : balance.power;
        return code;
    }
    const int code =
        mstmm_residual(run->stage, t, y, y + run->model->nq, a, r, wanted ? &balance : NULL);
    if (wanted) *work = code ? 0 : balance.power;
    return note_tangent_failure(run, run->stage, code);
}

/* The point at which the equations are linearised, unless it is there already. */
static int move_base(mstmm_scene_run *run, double t, const double *y, const double *a)
{
    const real *u = y + run->model->nq;
    if (run->model->looped) a = NULL; /* slopes are those of the accelerations there */
    if (mstmm_residual_is_at(run->base, t, y, u, a)) return 0;
    return note_tangent_failure(run, run->base,
                                mstmm_residual(run->base, t, y, u, a, run->known, NULL));
}

static int looped_residual_rate(void *context, double t, const double *y, const double *a,
                                double *r_t)
{
    mstmm_scene_run *run = context;
    const mstmm_model *model = run->model;
    real *still = run->known;
    memset(r_t, 0, (size_t)model->nu * sizeof(real));
    if (run->steady) return 0;
    const int code = move_base(run, t, y, a);
    if (code) return code;
    if (model->looped) {
        const int failure = mstmm_accelerations_rate(run->base, r_t);
        for (int j = 0; j < model->nu; j++) r_t[j] = -r_t[j];
        return note_tangent_failure(run, run->base, failure);
    }
    memset(still, 0, (size_t)(model->nq + 2 * model->nu) * sizeof(real));
    return note_tangent_failure(run, run->base,
                                mstmm_residual_slope(run->base, 1, still, still + model->nq,
                                                     still + model->nq + model->nu, r_t));
}

static int looped_slope(void *context, double t, const double *y, const double *a, const double *dq,
                        const double *du, double *d_rates, double *d_r)
{
    mstmm_scene_run *run = context;
    int code = move_base(run, t, y, a);
    if (code) return code;
    memset(run->known, 0, (size_t)run->model->nu * sizeof(real));
    code = mstmm_residual_slope(run->base, 0, dq, du, run->known, d_r);
    if (!code) mstmm_rates_slope(run->base, d_rates);
    return note_tangent_failure(run, run->base, code);
}

static int looped_rates(void *context, const double *q, const double *u, double *dq)
{
    mstmm_scene_run *run = context;
    return note_tangent_failure(run, run->stage, mstmm_tangent_rates(run->stage, q, u, dq));
}

static int looped_tangent(void *context, double t, const double *y, const double *a, double s,
                          double sq, int kappa)
{
    mstmm_scene_run *run = context;
    const int code = move_base(run, t, y, a);
    return code ? code
                : note_tangent_failure(run, run->base,
                                       mstmm_tangent_factor(run->base, 1, s, sq, kappa));
}

static int looped_laws(void *context, double t, const double *y, const double *a, double s,
                       double sq, int kappa)
{
    mstmm_scene_run *run = context;
    const int code = move_base(run, t, y, a);
    return code ? code
                : note_tangent_failure(run, run->base,
                                       mstmm_laws_factor(run->base, 1, s, sq, kappa));
}

/* With the approximate tangent known increments use it too: methods that accept any tangent need
 * the same one everywhere. */
static int looped_solve_by_laws(mstmm_scene_run *run, const double *r, const double *rho_q,
                                const double *rho_u, double *dq, double *du, double *da)
{
    const int nu = run->model->nu, known = rho_q || rho_u;
    mstmm_tangent *base = run->base;
    real *known_q = run->known, *known_u = known_q + run->model->nq;
    int code = 0;
    for (int j = 0; j < nu; j++) known_u[j] = rho_u ? rho_u[j] / base->s : 0;
    mstmm_tangent_free(base, known_u);
    if (known) code = mstmm_tangent_coordinates(base, known_u, rho_q, known_q);
    if (!code) code = mstmm_laws_solve(base, r, known ? known_q : NULL, known_u, da);
    for (int j = 0; !code && j < nu; j++) du[j] = da[j] / base->s + known_u[j];
    if (!code) code = mstmm_tangent_coordinates(base, du, rho_q, dq);
    return note_tangent_failure(run, base, code);
}

/* Known increments: the coordinates' of rho_q, -rho_u of the accelerations. */
static int looped_solve(void *context, const double *r, const double *rho_q, const double *rho_u,
                        double *dq, double *du, double *da)
{
    mstmm_scene_run *run = context;
    const int nq = run->model->nq, nu = run->model->nu;
    mstmm_tangent *base = run->base;
    if (base->approximate) return looped_solve_by_laws(run, r, rho_q, rho_u, dq, du, da);
    real *known_q = run->known, *still = known_q + nq, *known_a = still + nu;
    const mstmm_known known = {.q = known_q, .a = known_a};
    const int evaluated = run->implicit.evaluated, some = rho_q || rho_u || evaluated;
    int code = 0;
    if (some) {
        memset(still, 0, (size_t)nu * sizeof(real));
        for (int j = 0; j < nu; j++)
            known_a[j] = -((rho_u ? rho_u[j] : 0) + (evaluated ? r[j] : 0));
        mstmm_tangent_free(base, known_a);
        code = mstmm_tangent_coordinates(base, still, rho_q, known_q);
    }
    /* The requested residual of accelerations is a known increment; efforts are balanced. */
    if (!code) code = mstmm_tangent_solve(base, evaluated ? still : r, some ? &known : NULL, du);
    if (!code) code = mstmm_tangent_coordinates(base, du, rho_q, dq);
    for (int j = 0; !code && j < nu; j++) da[j] = base->s * du[j] - (rho_u ? rho_u[j] : 0);
    if (!code) mstmm_tangent_free(base, da);
    return note_tangent_failure(run, base, code);
}

/* Values prescribed by drives at t, and zero accelerations of held hinges. */
static int looped_impose(void *context, double t, double *y, double *a)
{
    mstmm_scene_run *run = context;
    const mstmm_model *model = run->model;
    mstmm_tangent_free(run->stage, a);
    if (!model->n_drives) return 0;
    mstmm_state state = {.model = model,
                         .workspace = run->workspace,
                         .t = t,
                         .q = y,
                         .u = y + model->nq,
                         .memory = run->memory,
                         .failure = &run->failure};
    const int code = mstmm_run_prescribed_values(&state);
    if (code) return code;
    memcpy(y, state.q, (size_t)model->nq * sizeof(real));
    memcpy(y + model->nq, state.u, (size_t)model->nu * sizeof(real));
    for (int k = 0; k < model->n_drives; k++) {
        const mstmm_drive *drive = &model->drives[k];
        const mstmm_body *body = &model->bodies[drive->body];
        if (mstmm_imposed_count(body, run->memory))
            a[body->u + drive->speed] = mstmm_drive_values(&state)[3 * k + 2];
    }
    return 0;
}

static int has_imposed_speeds(const mstmm_model *model)
{
    for (int i = 0; i < model->n_bodies; i++)
        if (model->bodies[i].n_imposed) return 1;
    return 0;
}

/* True if the rates of all coordinates are the speeds in the same order.  Driven ones have none. */
static int is_straight(const mstmm_model *model)
{
    if (has_imposed_speeds(model)) return 0;
    for (int i = 0; i < model->n_bodies; i++)
        if (!model->bodies[i].straight) return 0;
    return 1;
}

void mstmm_scene_implicit(mstmm_scene_run *run, mstmm_system *system)
{
    const mstmm_model *model = run->model;
    for (int i = 0; i < model->n_bodies; i++) {
        const mstmm_body *body = &model->bodies[i];
        for (int j = 0; j < body->nu; j++) /* the vector part of a quaternion is last */
            run->coordinates[body->u + j] =
                body->q + j + (j + 3 >= body->nu ? body->nq - body->nu : 0);
        for (int j = 0; body->modal && j < body->modal->n; j++)
            run->coordinates[body->modal->u + j] = body->modal->q + j;
    }
    run->implicit = (mstmm_implicit){
        .n_q = model->nq,
        .n_u = model->nu,
        .evaluated = model->looped != NULL,
        .coordinates = run->coordinates,
        .residual = looped_residual,
        .residual_rate = looped_residual_rate,
        .rates = is_straight(model) ? NULL : looped_rates,
        .tangent = looped_tangent,
        .laws = model->looped ? NULL : looped_laws,
        .laws_spare = 1,
        .solve = looped_solve,
        .slope = looped_slope,
        .impose = has_imposed_speeds(model) ? looped_impose : NULL,
    };
    system->implicit = &run->implicit;
}

static void ask_positions(void *context, int asked)
{
    mstmm_scene_run *run = context;
    run->on_positions = run->base->on_positions = asked;
}

void mstmm_scene_on_positions(mstmm_scene_run *run)
{
    if (!run->model->looped) return; /* no rows, no constraints */
    run->implicit.placing = excess_placing_accelerations;
    run->implicit.ask_positions = ask_positions;
    ask_positions(run, 1);
}
