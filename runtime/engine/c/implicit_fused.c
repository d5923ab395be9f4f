/* Interface of a small scene to implicit methods, by code compiled for it.  If its guards fail, the
 * looped engine is used, which names the cause or needs no such guard. */
#include <string.h>

#include "fused_rhs.h"

#define CODE(run) ((run)->implicit_code.fused)

/* The numbers that the code reads, with those of inputs at t. */
static const real *parameters(const mstmm_scene_run *run, real t)
{
    mstmm_renew_inputs(&run->live, t, run->memory, run->implicit_code.p);
    return run->implicit_code.p;
}

static mstmm_implicit_parts cut_implicit_numbers(int64_t nq, int64_t nu, real *numbers)
{
    mstmm_implicit_parts at = {.used = 0};
    const struct {
        real **to;
        int64_t count;
    } all[] = {
        {&at.t, 1},
        {&at.q, nq},
        {&at.u, nu},
        {&at.a, nu},
        {&at.steps, 3},
        {&at.slopes, nu * (nq + nu)},
        {&at.factors, nu * nu},
        {&at.still_q, nq},
        {&at.still_u, nu},
        {&at.known_q, nq},
        {&at.known_a, nu},
        {&at.right, nu},
    };
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++) {
        if (numbers) *all[i].to = numbers + at.used;
        at.used += all[i].count;
    }
    return at;
}

int64_t mstmm_implicit_code_size(const mstmm_fused *fused)
{
    return cut_implicit_numbers(fused->nq, fused->nu, NULL).used;
}

static int fused_residual(void *context, double t, const double *y, const double *a, double *r,
                          double *work)
{
    mstmm_scene_run *run = context;
    const mstmm_fused *code = CODE(run);
    const real *u = y + code->nq;
    const int wanted = work && run->with_power;
    const int failed =
        wanted ? code->residual_power(parameters(run, t), &t, y, u, run->memory, a, r, work)
               : code->residual(parameters(run, t), &t, y, u, run->memory, a, r);
    return failed ? run->implicit_code.looped.residual(run, t, y, a, r, work) : 0;
}

static int fused_residual_rate(void *context, double t, const double *y, const double *a,
                               double *r_t)
{
    mstmm_scene_run *run = context;
    const mstmm_fused *code = CODE(run);
    if (run->steady) {
        memset(r_t, 0, (size_t)code->nu * sizeof(real));
        return 0;
    }
    const int failed =
        code->residual_rate(parameters(run, t), &t, y, y + code->nq, run->memory, a, r_t);
    return failed ? run->implicit_code.looped.residual_rate(run, t, y, a, r_t) : 0;
}

/* Rates do not depend on time. */
static int fused_rates(void *context, const double *q, const double *u, double *dq)
{
    mstmm_scene_run *run = context;
    const real t = 0;
    const int failed = CODE(run)->rates(parameters(run, t), &t, q, u, run->memory, u, dq);
    return failed ? run->implicit_code.looped.rates(run, q, u, dq) : 0;
}

static int fused_tangent(void *context, double t, const double *y, const double *a, double s,
                         double sq, int kappa)
{
    mstmm_scene_run *run = context;
    const mstmm_fused *code = CODE(run);
    const mstmm_implicit_parts at = run->implicit_code.parts;
    *at.t = t;
    memcpy(at.q, y, (size_t)(code->nq + code->nu) * sizeof(real)); /* u follows q */
    memcpy(at.a, a, (size_t)code->nu * sizeof(real));
    at.steps[0] = s;
    at.steps[1] = sq;
    at.steps[2] = kappa;
    /* Without kappa no increments are known, and no slopes are wanted. */
    const int failed =
        kappa && code->tangent_slopes
            ? code->tangent_slopes(parameters(run, *at.t), at.t, at.q, at.u, run->memory, at.a,
                                   at.steps, at.slopes, at.factors)
            : code->tangent(parameters(run, *at.t), at.t, at.q, at.u, run->memory, at.a, at.steps,
                            at.factors);
    run->implicit_code.looped_tangent = failed;
    return failed ? run->implicit_code.looped.tangent(run, t, y, a, s, sq, kappa) : 0;
}

/* The approximate tangent saves nothing in a small scene: the looped engine provides it. */
static int fused_laws(void *context, double t, const double *y, const double *a, double s,
                      double sq, int kappa)
{
    mstmm_scene_run *run = context;
    run->implicit_code.looped_tangent = 1;
    return run->implicit_code.looped.laws(run, t, y, a, s, sq, kappa);
}

static int fused_coordinates(const mstmm_scene_run *run, const mstmm_implicit_parts *at,
                             const real *x, const real *rho, real *dq)
{
    return CODE(run)->coordinates(parameters(run, *at->t), at->t, at->q, at->u, run->memory, at->a,
                                  at->steps, x, rho, dq);
}

/* Known increments move to the right-hand side: dq_0 of rho_q, -rho_u of the accelerations. */
static int move_known_to_right(const mstmm_scene_run *run, const mstmm_implicit_parts *at,
                               const double *rho_q, const double *rho_u, const double *r)
{
    const mstmm_fused *code = CODE(run);
    for (int j = 0; j < code->nu; j++) at->known_a[j] = rho_u ? -rho_u[j] : 0;
    mstmm_tangent_free(run->base, at->known_a);
    const int failed = fused_coordinates(run, at, at->still_u, rho_q, at->known_q);
    if (failed) return failed;
    return code->rest(parameters(run, *at->t), at->t, at->q, at->u, run->memory, at->a, at->slopes,
                      r, at->known_q, at->known_a, at->right);
}

static int fused_solve(void *context, const double *r, const double *rho_q, const double *rho_u,
                       double *dq, double *du, double *da)
{
    mstmm_scene_run *run = context;
    const mstmm_fused *code = CODE(run);
    const mstmm_implicit *looped = &run->implicit_code.looped;
    const mstmm_implicit_parts at = run->implicit_code.parts;
    if (run->implicit_code.looped_tangent) return looped->solve(run, r, rho_q, rho_u, dq, du, da);
    const real *rho = rho_q ? rho_q : at.still_q;
    int failed = 0;
    if (rho_q || rho_u)
        failed = move_known_to_right(run, &at, rho, rho_u, r);
    else
        memcpy(at.right, r, (size_t)code->nu * sizeof(real));
    mstmm_tangent_free(run->base, at.right);
    if (!failed) failed = code->solution(at.factors, at.right, du);
    if (!failed) failed = fused_coordinates(run, &at, du, rho, dq);
    if (failed) { /* guards have passed at this point before: not to be expected */
        run->failure =
            (mstmm_failure){.reason = MSTMM_FAILED_TANGENT, .element = -1, .code = failed};
        return MSTMM_FAILED_TANGENT;
    }
    for (int j = 0; j < code->nu; j++) da[j] = at.steps[0] * du[j] - (rho_u ? rho_u[j] : 0);
    mstmm_tangent_free(run->base, da);
    return 0;
}

void mstmm_implicit_by_code(mstmm_scene_run *run, const mstmm_fused *fused, real *p, real *numbers)
{
    run->implicit_code =
        (mstmm_implicit_code){.fused = fused,
                              .p = p,
                              .looped = run->implicit,
                              .parts = cut_implicit_numbers(fused->nq, fused->nu, numbers)};
    run->implicit.residual = fused_residual;
    run->implicit.residual_rate = fused_residual_rate;
    if (run->implicit.rates) run->implicit.rates = fused_rates;
    run->implicit.tangent = fused_tangent;
    run->implicit.laws = fused_laws;
    run->implicit.laws_spare = 0;
    run->implicit.solve = fused_solve;
}
