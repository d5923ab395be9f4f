/* Motions of points at given states; see kinematics.h. */
#include "kinematics.h"

#include <string.h>

#include "is_finite.h"
#include "kernel_calls.h"
#include "sweep_steps.h"

static mstmm_state kinematic_state(const mstmm_kinematics *known, const real *q, const real *u,
                                   const real *udot, mstmm_failure *failure)
{
    mstmm_state state = {.model = known->model,
                         .workspace = known->workspace,
                         .memory = known->memory,
                         .q = q,
                         .u = u,
                         .given = udot,
                         .required = known->work,
                         .observed = 1,
                         .failure = failure};
    state.qdot = mstmm_spare_qdot(&state);
    mstmm_ground(&state);
    return state;
}

int mstmm_moving_points(const mstmm_kinematics *known, int64_t n, const real *q, const real *u,
                        const real *udot, int n_probes, const mstmm_probe *probes, real *points,
                        mstmm_failure *failure)
{
    const mstmm_model *model = known->model;
    for (int64_t k = 0; k < n; k++) {
        mstmm_state state = kinematic_state(known, q + k * model->nq, u + k * model->nu,
                                            udot + k * model->nu, failure);
        const int code = mstmm_run_motion(&state);
        if (code) return code;
        for (int i = 0; i < n_probes; i++)
            mstmm_point_shown(&state, &probes[i], mstmm_zeros,
                              points +
                                  ((size_t)k * (size_t)n_probes + (size_t)i) * MSTMM_PROBE_NUMBERS);
    }
    return 0;
}

/* Efforts of a unit force or moment against an inertial axis on the speeds towards the root. */
static int path_efforts(mstmm_state *state, const mstmm_probe *probe, int direction, real *row)
{
    const mstmm_body *bodies = state->model->bodies;
    real load[6] = {0};
    load[direction] = -1;
    for (int i = probe->body; i >= 0; i = bodies[i].parent)
        memset(mstmm_block(state->model, state->workspace, i) + MSTMM_BLOCK_E, 0, 6 * sizeof(real));
    real *block = mstmm_block(state->model, state->workspace, probe->body);
    mstmm_frames_applied_load(.A = block + MSTMM_BLOCK_A, .A_F = mstmm_identity,
                              .offset = probe->offset, .F = load, .M = load + 3,
                              .e = block + MSTMM_BLOCK_E);
    for (int i = probe->body; i >= 0; i = bodies[i].parent) {
        const int code = mstmm_at_hinge_efforts(state, i);
        if (code) return code;
        for (int k = 0; k < bodies[i].nu; k++)
            row[bodies[i].u + k] = state->required[bodies[i].u + k];
    }
    return 0;
}

/* After a sweep: Jacobian of the motion of a point (6 x nu). */
static int added_by_speeds(mstmm_state *state, const mstmm_probe *probe, real *rows)
{
    const int64_t nu = state->model->nu;
    int code = 0;
    memset(rows, 0, (size_t)(6 * nu) * sizeof(real));
    for (int k = 0; !code && k < 6 && probe->body >= 0; k++)
        code = path_efforts(state, probe, k, rows + k * nu);
    return code;
}

int mstmm_jacobians(const mstmm_kinematics *known, const real *q, int n_probes,
                    const mstmm_probe *probes, real *rows, mstmm_failure *failure)
{
    mstmm_state state = kinematic_state(known, q, known->none, known->none, failure);
    int code = mstmm_run_motion(&state);
    for (int i = 0; !code && i < n_probes; i++)
        code = added_by_speeds(&state, &probes[i], rows + 6 * i * known->model->nu);
    return code;
}

/* --- one state after the other ---------------------------------------------------------------- */

/* A state after a sweep of its motion; returns 0 where it has none. */
static int run_motion(const mstmm_points *points, const real *q, const real *u, mstmm_state *state,
                      mstmm_failure *failure)
{
    const mstmm_model *model = points->at.model;
    if (!mstmm_finite(model->nq, q) || !mstmm_finite(model->nu, u)) return 0;
    *state = kinematic_state(&points->at, q, u, points->at.none, failure);
    return !mstmm_run_motion(state);
}

int mstmm_points_places(const void *record, real none, const real *const *rows,
                        real *const *answers)
{
    const mstmm_points *points = record;
    real shown[MSTMM_PROBE_NUMBERS];
    mstmm_state state;
    mstmm_failure failure;
    (void)none;
    if (!run_motion(points, rows[0], points->at.none, &state, &failure)) return 1;
    for (int i = 0; i < points->n_probes; i++) {
        mstmm_point_shown(&state, &points->probes[i], mstmm_zeros, shown);
        memcpy(answers[0] + 3 * i, shown, 3 * sizeof(real));
    }
    return 0;
}

int mstmm_points_poses(const void *record, real none, const real *const *rows, real *const *answers)
{
    const mstmm_points *points = record;
    real shown[MSTMM_PROBE_NUMBERS];
    mstmm_state state;
    mstmm_failure failure;
    (void)none;
    if (!run_motion(points, rows[0], points->at.none, &state, &failure)) return 1;
    for (int i = 0; i < points->n_probes; i++) {
        real *pose = answers[0] + 16 * i;
        mstmm_point_shown(&state, &points->probes[i], mstmm_zeros, shown);
        for (int row = 0; row < 3; row++) {
            memcpy(pose + 4 * row, shown + 15 + 3 * row, 3 * sizeof(real));
            pose[4 * row + 3] = shown[row];
            pose[12 + row] = 0;
        }
        pose[15] = 1;
    }
    return 0;
}

int mstmm_points_velocities(const void *record, real none, const real *const *rows,
                            real *const *answers)
{
    const mstmm_points *points = record;
    real shown[MSTMM_PROBE_NUMBERS];
    mstmm_state state;
    mstmm_failure failure;
    (void)none;
    if (!run_motion(points, rows[0], rows[1], &state, &failure)) return 1;
    for (int i = 0; i < points->n_probes; i++) {
        mstmm_point_shown(&state, &points->probes[i], mstmm_zeros, shown);
        memcpy(answers[0] + 6 * i, shown + 3, 3 * sizeof(real));
        memcpy(answers[0] + 6 * i + 3, shown + 9, 3 * sizeof(real));
    }
    return 0;
}

int mstmm_points_jacobian(const void *record, real none, const real *const *rows,
                          real *const *answers)
{
    const mstmm_points *points = record;
    mstmm_failure failure;
    (void)none;
    if (!mstmm_finite(points->at.model->nq, rows[0])) return 1;
    return mstmm_jacobians(&points->at, rows[0], points->n_probes, points->probes, answers[0],
                           &failure);
}

/* Accelerations (6) of a point under speeds that from body `way[first]` on are not those of the
 * last sweep; `way` leads from the point's body to the root. */
static int gains_of(mstmm_state *state, const mstmm_probe *probe, const int *way, int first,
                    real *gains)
{
    real shown[MSTMM_PROBE_NUMBERS];
    for (int k = first; k >= 0; k--) {
        const int parent = state->model->bodies[way[k]].parent;
        const int code = mstmm_at_forward(state, way[k],
                                          mstmm_block(state->model, state->workspace, parent) +
                                              MSTMM_BLOCK_MOTION);
        if (code) return code;
    }
    mstmm_point_shown(state, probe, mstmm_zeros, shown);
    memcpy(gains, shown + 6, 3 * sizeof(real));
    memcpy(gains + 3, shown + 12, 3 * sizeof(real));
    return 0;
}

/* A column of half the change along u of the acceleration at udot = 0, which is quadratic in the
 * speeds: the part of the Jacobian's rate that is symmetric in u and the column's speed. */
static int even_part(mstmm_state *state, const mstmm_points *points, const mstmm_probe *probe,
                     int first, int speed, real size, real *to)
{
    const int64_t nu = state->model->nu;
    const real known = points->speeds[speed];
    real more[6], less[6];
    points->speeds[speed] = known + size;
    int code = gains_of(state, probe, points->way, first, more);
    points->speeds[speed] = known - size;
    if (!code) code = gains_of(state, probe, points->way, first, less);
    points->speeds[speed] = known;
    for (int k = 0; !code && k < 6; k++) to[k * nu + speed] = (more[k] - less[k]) / (4 * size);
    return code;
}

/* The antisymmetric part is their bracket: w x of the rotations, and J times that of speeds. */
static void add_brackets(const mstmm_points *points, const real *u, real *to)
{
    const int64_t nu = points->at.model->nu;
    const real *jacobian = points->rows, *x = jacobian + 3 * nu, *y = x + nu, *z = y + nu;
    real w[3] = {0};
    for (int64_t j = 0; j < nu; j++) w[0] += x[j] * u[j], w[1] += y[j] * u[j], w[2] += z[j] * u[j];
    for (int64_t j = 0; j < nu; j++) {
        to[3 * nu + j] += (w[1] * z[j] - w[2] * y[j]) / 2;
        to[4 * nu + j] += (w[2] * x[j] - w[0] * z[j]) / 2;
        to[5 * nu + j] += (w[0] * y[j] - w[1] * x[j]) / 2;
    }
    for (int n = 0; n < points->n_brackets; n++) {
        const mstmm_bracket *one = &points->brackets[n];
        const real half = u[one->by] * one->value / 2;
        for (int k = 0; k < 6; k++) to[k * nu + one->column] -= half * jacobian[k * nu + one->row];
    }
}

static int jacobian_rate(const mstmm_points *points, const mstmm_probe *probe, const real *q,
                         const real *u, real *to)
{
    const mstmm_body *bodies = points->at.model->bodies;
    const int64_t nu = points->at.model->nu;
    mstmm_state state;
    mstmm_failure failure;
    real size = 1;
    int length = 0, code = 0;
    memset(to, 0, (size_t)(6 * nu) * sizeof(real));
    if (!run_motion(points, q, u, &state, &failure)) return 1;
    if (added_by_speeds(&state, probe, points->rows)) return 1;
    memcpy(points->speeds, u, (size_t)nu * sizeof(real));
    state.u = points->speeds;
    for (int64_t j = 0; j < nu; j++) size = fmax(size, fabs(u[j]));
    for (int i = probe->body; i >= 0; i = bodies[i].parent) points->way[length++] = i;
    /* From the point inwards, so that what is nearer to the root moves as the sweep left it. */
    for (int first = 0; first < length; first++) {
        const mstmm_body *body = &bodies[points->way[first]];
        for (int k = 0; !code && k < body->nu; k++)
            code = even_part(&state, points, probe, first, body->u + k, size, to);
    }
    add_brackets(points, u, to);
    return code;
}

int mstmm_points_jacobian_rate(const void *record, real none, const real *const *rows,
                               real *const *answers)
{
    const mstmm_points *points = record;
    const int64_t count = 6 * (int64_t)points->at.model->nu;
    (void)none;
    for (int i = 0; i < points->n_probes; i++)
        if (jacobian_rate(points, &points->probes[i], rows[0], rows[1], answers[0] + count * i))
            return 1;
    return !mstmm_finite(count * points->n_probes, answers[0]);
}
