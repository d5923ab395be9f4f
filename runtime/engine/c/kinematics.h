/* Positions and motions of points at states with given accelerations: kinematics only. */
#ifndef MSTMM_KINEMATICS_H
#define MSTMM_KINEMATICS_H

#include "scene.h"

/* cdef begin */
/* Of one thread; everything is the caller's. */
typedef struct {
    const mstmm_model *model; /* the tree without laws, drives and loads */
    real *workspace;
    const real *memory;
    const real *none; /* nu zeros */
    real *work;       /* nu, written over */
} mstmm_kinematics;

/* Each function returns 0 or a reason, with `failure` filled. */
/* n states one after the other; points: n x n_probes x MSTMM_PROBE_NUMBERS. */
int mstmm_moving_points(const mstmm_kinematics *known, int64_t n, const real *q, const real *u,
                        const real *udot, int n_probes, const mstmm_probe *probes, real *points,
                        mstmm_failure *failure);
/* n_probes x 6 x nu: Jacobians of velocity and angular velocity, rigid bodies only. */
int mstmm_jacobians(const mstmm_kinematics *known, const real *q, int n_probes,
                    const mstmm_probe *probes, real *rows, mstmm_failure *failure);

/* Rotation of increments: the rate of increment `row` due to increment `column` is `value` times
 * speed `by`. */
typedef struct {
    int by, row, column;
    real value;
} mstmm_bracket;

/* Prepared calls for fixed points, rigid bodies only except for positions and velocities. */
typedef struct {
    mstmm_kinematics at;
    int n_probes;
    const mstmm_probe *probes;
    int n_brackets;
    const mstmm_bracket *brackets;
    real *speeds; /* nu, written over */
    real *rows;   /* 6 nu, written over */
    int *way;     /* n_bodies, written over */
} mstmm_points;

/* Called as in single_state.h; the number is ignored.  Positions (n_probes x 3) at q. */
int mstmm_points_places(const void *points, real none, const real *const *rows,
                        real *const *answers);
/* Transformations (n_probes x 4 x 4) from axes of the points to inertial axes at q. */
int mstmm_points_poses(const void *points, real none, const real *const *rows,
                       real *const *answers);
/* Velocities and angular velocities (n_probes x 6) at q and u. */
int mstmm_points_velocities(const void *points, real none, const real *const *rows,
                            real *const *answers);
/* Jacobians of these (n_probes x 6 x nu) at q. */
int mstmm_points_jacobian(const void *points, real none, const real *const *rows,
                          real *const *answers);
/* Rate of these Jacobians along u at q. */
int mstmm_points_jacobian_rate(const void *points, real none, const real *const *rows,
                               real *const *answers);
/* cdef end */

#endif
