/* One state at a time; see alone.h. */
#include "alone.h"

#include "finite.h"

static int is_state(const mstmm_model *model, real t, const real *q, const real *u)
{
    return isfinite(t) && mstmm_finite(model->nq, q) && mstmm_finite(model->nu, u);
}

int mstmm_alone_accelerations(const mstmm_alone *alone, real t, const void *q, const void *u,
                              const void *efforts)
{
    const mstmm_model *model = alone->model;
    mstmm_failure failure;
    int failed;
    if (!is_state(model, t, q, u)) return 1;
    if (alone->fused) {
        mstmm_renew_inputs(&alone->live, t, alone->memory, alone->p);
        failed = alone->fused->accelerations(alone->p, &t, q, u, alone->memory,
                                             efforts ? efforts : alone->none, alone->qdot,
                                             alone->found);
    } else {
        failed = mstmm_accelerations(model, alone->workspace, t, q, u, alone->memory, efforts,
                                     alone->qdot, alone->found, NULL, &failure);
    }
    return failed || !mstmm_finite(model->nu, alone->found);
}

int mstmm_alone_efforts(const mstmm_alone *alone, real t, const void *q, const void *u,
                        const void *udot)
{
    const mstmm_model *model = alone->model;
    mstmm_failure failure;
    int failed;
    if (!is_state(model, t, q, u) || !mstmm_finite(model->nu, udot)) return 1;
    if (alone->inverse) {
        mstmm_renew_inputs(&alone->live, t, alone->memory, alone->p);
        failed = alone->inverse->required(alone->p, &t, q, u, alone->memory, udot, alone->found);
    } else {
        failed = mstmm_inverse_dynamics(model, alone->workspace, t, q, u, alone->memory, udot,
                                        alone->found, &failure);
    }
    return failed || !mstmm_finite(model->nu, alone->found);
}

int mstmm_alone_mass(const mstmm_alone *alone, const void *q)
{
    const mstmm_model *model = alone->inertia;
    const real t = 0;
    mstmm_failure failure;
    int failed;
    if (!mstmm_finite(model->nq, q)) return 1;
    if (alone->inverse)
        failed = alone->inverse->mass(alone->p, &t, q, alone->none, alone->memory, alone->none,
                                      alone->matrix);
    else
        failed = mstmm_mass_matrix(model, alone->workspace, q, alone->memory, alone->matrix,
                                   alone->work, &failure);
    return failed || !mstmm_finite((int64_t)model->nu * model->nu, alone->matrix);
}
