/* Where points are and how they move at states whose accelerations are given: kinematics alone. */
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
/* n_probes x 6 x nu: velocity and angular velocity of each by the speeds, of rigid bodies. */
int mstmm_jacobians(const mstmm_kinematics *known, const real *q, int n_probes,
                    const mstmm_probe *probes, real *rows, mstmm_failure *failure);

/* Increments turn by themselves: the rate of increment `row` by increment `column` is `value` times
 * speed `by`. */
typedef struct {
    int by, row, column;
    real value;
} mstmm_bracket;

/* Points that are asked for again and again, of rigid bodies but for places and velocities. */
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

/* Called as alone.h tells; the number is not looked at.  Of q: places (n_probes x 3). */
int mstmm_points_places(const void *points, real none, const real *const *rows,
                        real *const *answers);
/* Of q: the matrices (n_probes x 4 x 4) that take places in axes of the points to inertial ones. */
int mstmm_points_poses(const void *points, real none, const real *const *rows,
                       real *const *answers);
/* Of q and u: velocities and angular velocities (n_probes x 6). */
int mstmm_points_velocities(const void *points, real none, const real *const *rows,
                            real *const *answers);
/* Of q: what each speed adds to them (n_probes x 6 x nu). */
int mstmm_points_jacobian(const void *points, real none, const real *const *rows,
                          real *const *answers);
/* Of q and u: the rate of that along u. */
int mstmm_points_jacobian_rate(const void *points, real none, const real *const *rows,
                               real *const *answers);
/* cdef end */

#endif
