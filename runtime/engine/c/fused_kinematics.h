/* Points of a scene by its compiled code: kinematics only, one state at a time. */
#ifndef MSTMM_FUSED_KINEMATICS_H
#define MSTMM_FUSED_KINEMATICS_H

#include "fused.h"
#include "mstmm.h"

/* cdef begin */
/* Everything is the caller's. */
typedef struct {
    int n_probes;
    const mstmm_fused *const *codes; /* n_probes, each of the probe's body */
    const real *ends;                /* n_probes x 12: offset and axes in those of the body */
    const real *p, *memory;          /* what all codes read */
    const real *none;                /* nu zeros */
} mstmm_compiled_points;

/* The same as those of mstmm_points in kinematics.h, called alike and with the same answers. */
int mstmm_compiled_points_places(const void *points, real none, const real *const *rows,
                                 real *const *answers);
int mstmm_compiled_points_poses(const void *points, real none, const real *const *rows,
                                real *const *answers);
int mstmm_compiled_points_velocities(const void *points, real none, const real *const *rows,
                                     real *const *answers);
int mstmm_compiled_points_jacobian(const void *points, real none, const real *const *rows,
                                   real *const *answers);
int mstmm_compiled_points_jacobian_rate(const void *points, real none, const real *const *rows,
                                        real *const *answers);
/* cdef end */

#endif
