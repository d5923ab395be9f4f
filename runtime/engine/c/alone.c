/* One state at a time; see alone.h. */
#include "alone.h"

#include "finite.h"

static int is_state(const mstmm_model *model, real t, const real *q, const real *u)
{
    return isfinite(t) && mstmm_finite(model->nq, q) && mstmm_finite(model->nu, u);
}

int mstmm_alone_accelerations(const mstmm_alone *alone, real t, const real *q, const real *u,
                              const real *efforts, real *udot)
{
    const mstmm_model *model = alone->model;
    mstmm_failure failure;
    int failed;
    if (!is_state(model, t, q, u)) return 1;
    if (alone->fused) {
        mstmm_renew_inputs(&alone->live, t, alone->memory, alone->p);
        failed = alone->fused->accelerations(alone->p, &t, q, u, alone->memory,
                                             efforts ? efforts : alone->none, alone->qdot, udot);
    } else {
        failed = mstmm_accelerations(model, alone->workspace, t, q, u, alone->memory, efforts,
                                     alone->qdot, udot, NULL, &failure);
    }
    return failed || !mstmm_finite(model->nu, udot);
}

int mstmm_alone_efforts(const mstmm_alone *alone, real t, const real *q, const real *u,
                        const real *udot, real *efforts)
{
    const mstmm_model *model = alone->model;
    mstmm_failure failure;
    if (!is_state(model, t, q, u) || !mstmm_finite(model->nu, udot)) return 1;
    return mstmm_inverse_dynamics(model, alone->workspace, t, q, u, alone->memory, udot, efforts,
                                  &failure)
           || !mstmm_finite(model->nu, efforts);
}

int mstmm_alone_mass(const mstmm_alone *alone, const real *q, real *matrix)
{
    const mstmm_model *model = alone->inertia;
    mstmm_failure failure;
    return !mstmm_finite(model->nq, q)
           || mstmm_mass_matrix(model, alone->workspace, q, alone->memory, matrix, alone->work,
                                &failure)
           || !mstmm_finite((int64_t)model->nu * model->nu, matrix);
}
