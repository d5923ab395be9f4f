/* Calls on single states; see single_state.h. */
#include "single_state.h"

#include <string.h>

#include "is_finite.h"
#include "loop_closure.h"
#include "sweep_steps.h"

static int is_finite_state(const mstmm_model *model, real t, const real *const *rows)
{
    return isfinite(t) && mstmm_finite(model->nq, rows[0]) && mstmm_finite(model->nu, rows[1]);
}

int mstmm_alone_accelerations(const void *record, real t, const real *const *rows,
                              real *const *answers)
{
    const mstmm_alone *alone = record;
    const mstmm_model *model = alone->model;
    const real *q = rows[0], *u = rows[1], *efforts = rows[2];
    mstmm_failure failure;
    int failed;
    if (!is_finite_state(model, t, rows)) return 1;
    if (alone->fused) {
        mstmm_renew_inputs(&alone->live, t, alone->memory, alone->p);
        failed =
            alone->fused->accelerations(alone->p, &t, q, u, alone->memory,
                                        efforts ? efforts : alone->none, alone->qdot, answers[0]);
    } else {
        failed = mstmm_accelerations(model, alone->workspace, t, q, u, alone->memory, efforts,
                                     alone->qdot, answers[0], NULL, &failure);
    }
    return failed || !mstmm_finite(model->nu, answers[0]);
}

int mstmm_alone_efforts(const void *record, real t, const real *const *rows, real *const *answers)
{
    const mstmm_alone *alone = record;
    const mstmm_model *model = alone->model;
    const real *q = rows[0], *u = rows[1], *udot = rows[2];
    mstmm_failure failure;
    int failed;
    if (!is_finite_state(model, t, rows) || !mstmm_finite(model->nu, udot)) return 1;
    if (alone->inverse) {
        mstmm_renew_inputs(&alone->live, t, alone->memory, alone->p);
        failed = alone->inverse->required(alone->p, &t, q, u, alone->memory, udot, answers[0]);
    } else {
        failed = mstmm_inverse_dynamics(model, alone->workspace, t, q, u, alone->memory, udot,
                                        answers[0], &failure);
    }
    return failed || !mstmm_finite(model->nu, answers[0]);
}

int mstmm_alone_mass(const void *record, real none, const real *const *rows, real *const *answers)
{
    const mstmm_alone *alone = record;
    const mstmm_model *model = alone->inertia;
    const real t = 0, *q = rows[0];
    mstmm_failure failure;
    int failed;
    (void)none;
    if (!mstmm_finite(model->nq, q)) return 1;
    if (alone->inverse)
        failed = alone->inverse->mass(alone->p, &t, q, alone->none, alone->memory, alone->none,
                                      answers[0]);
    else
        failed = mstmm_mass_matrix(model, alone->workspace, q, alone->memory, answers[0],
                                   alone->work, &failure);
    return failed || !mstmm_finite((int64_t)model->nu * model->nu, answers[0]);
}

/* Fills the sums over the scene. */
static int sum_scene(const mstmm_alone *alone, real t, const real *const *rows, real *sums)
{
    const mstmm_observation wanted = {.sums = sums};
    mstmm_failure failure;
    if (!is_finite_state(alone->model, t, rows)) return 1;
    const int failed = mstmm_observe(alone->model, alone->workspace, t, rows[0], rows[1],
                                     alone->memory, &wanted, &failure);
    return failed || !mstmm_finite(MSTMM_SUM_NUMBERS, sums);
}

int mstmm_alone_energy(const void *record, real t, const real *const *rows, real *const *answers)
{
    real sums[MSTMM_SUM_NUMBERS];
    const int failed = sum_scene(record, t, rows, sums);
    *answers[0] = failed ? 0 : sums[0] + sums[1] + sums[2];
    return failed;
}

int mstmm_alone_momentum(const void *record, real t, const real *const *rows, real *const *answers)
{
    real sums[MSTMM_SUM_NUMBERS];
    const int failed = sum_scene(record, t, rows, sums);
    if (!failed) memcpy(answers[0], sums + 4, 6 * sizeof(real));
    return failed;
}

/* Unit quaternion after dt at its rate, which is perpendicular to it. */
static void turn_quaternion(real dt, const real *rate, real *four)
{
    const real speed =
        sqrt(rate[0] * rate[0] + rate[1] * rate[1] + rate[2] * rate[2] + rate[3] * rate[3]);
    for (int k = 0; speed > 0 && k < 4; k++)
        four[k] = cos(speed * dt) * four[k] + sin(speed * dt) / speed * rate[k];
}

int mstmm_alone_moved(const void *record, real dt, const real *const *rows, real *const *answers)
{
    const mstmm_alone *alone = record;
    const mstmm_model *model = alone->inertia;
    real *q = answers[0], *rate = alone->qdot;
    mstmm_failure failure;
    if (!is_finite_state(model, dt, rows)) return 1;
    memcpy(q, rows[0], (size_t)model->nq * sizeof(real));
    mstmm_unit_quaternions(alone->n_quaternions, alone->quaternions, q);
    mstmm_state state = {.model = model,
                         .workspace = alone->workspace,
                         .memory = alone->memory,
                         .q = q,
                         .u = rows[1],
                         .qdot = rate,
                         .failure = &failure};
    for (int i = 0; i < model->n_bodies; i++)
        if (mstmm_at_hinge_motion(&state, i)) return 1;
    for (int k = 0; k < alone->n_quaternions; k++) {
        const int first = alone->quaternions[k];
        turn_quaternion(dt, rate + first, q + first);
        memset(rate + first, 0, 4 * sizeof(real));
    }
    for (int i = 0; i < model->nq; i++) q[i] += rate[i] * dt;
    return !mstmm_finite(model->nq, q);
}
