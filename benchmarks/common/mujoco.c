/* MuJoCo's forward dynamics behind the signature of native.h: the functions that lead to
 * accelerations without constraints, and nothing else of mj_forward. */
#include <mujoco/mujoco.h>
#include <string.h>

#include "native.h"

typedef struct {
    const mjModel *model;
    mjData *data;
} place;

static int evaluate(const double *context, const double *t, const double *q, const double *u,
                    const double *memory, const double *efforts, double *qdot, double *udot)
{
    const place *at = (const place *)context;
    const mjModel *m = at->model;
    mjData *d = at->data;
    (void)t, (void)memory, (void)qdot;
    memcpy(d->qpos, q, sizeof(double) * m->nq);
    memcpy(d->qvel, u, sizeof(double) * m->nv);
    mj_kinematics(m, d);
    mj_comPos(m, d);
    mj_crb(m, d);
    mj_factorM(m, d);
    mj_comVel(m, d);
    mj_rne(m, d, 0, d->qfrc_bias);
    for (int i = 0; i < m->nv; i++) d->qfrc_smooth[i] = efforts[i] - d->qfrc_bias[i];
    mj_solveM(m, d, udot, d->qfrc_smooth, 1);
    return 0;
}

const accelerations mujoco_accelerations = evaluate;

/* Steps of the model's integrator from a state; q and u are overwritten with the end. */
void mujoco_run(const place *at, long steps, double *q, double *u)
{
    const mjModel *m = at->model;
    mjData *d = at->data;
    mj_resetData(m, d);
    memcpy(d->qpos, q, sizeof(double) * m->nq);
    memcpy(d->qvel, u, sizeof(double) * m->nv);
    for (long k = 0; k < steps; k++) mj_step(m, d);
    memcpy(q, d->qpos, sizeof(double) * m->nq);
    memcpy(u, d->qvel, sizeof(double) * m->nv);
}
