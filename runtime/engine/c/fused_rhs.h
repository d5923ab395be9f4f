/* A scene whose accelerations come from code compiled for it. */
#ifndef MSTMM_FUSED_RHS_H
#define MSTMM_FUSED_RHS_H

#include "lanes.h"
#include "scene.h"

/* cdef begin */
/* Fills the integrator's view of `run`. */
void mstmm_scene_system(mstmm_scene_run *run, mstmm_system *system);
/* Number of doubles that `mstmm_scene_compiled` needs. */
int64_t mstmm_compiled_size(const mstmm_fused *one, const mstmm_fused *lanes);
/* From now on `run` evaluates `one`, and several states at a time by `lanes` (or NULL; not used
 * where the work is integrated too, or inputs change with time); p holds the numbers that both
 * read, those of `run->live` inputs written anew.  To be called before
 * mstmm_scene_system.  Everything given must live as long as the run. */
void mstmm_scene_compiled(mstmm_scene_run *run, const mstmm_fused *one, const mstmm_fused *lanes,
                          real *p, real *numbers);
/* Number of doubles that `mstmm_implicit_by_code` needs. */
int64_t mstmm_implicit_code_size(const mstmm_fused *fused);
/* From now on implicit methods use `fused`; p holds the numbers that it reads, as above.  Call it
 * after mstmm_scene_implicit.  All arguments must exist as long as the run. */
void mstmm_implicit_by_code(mstmm_scene_run *run, const mstmm_fused *fused, real *p, real *numbers);

/* Trajectories of a scene without events and memory in SIMD lanes of one thread. */
typedef struct {
    const mstmm_fused *fused;
    const real *p;           /* n x np, or one row for all */
    int64_t p_stride;        /* distance of rows, 0 for one row */
    real *numbers;           /* mstmm_lanes_numbers */
    mstmm_scene_run *settle; /* of this thread: projects states after every step */
    mstmm_live_inputs live;  /* of each trajectory so many inputs change with time, in a row */
    int64_t trajectory[8];   /* in each lane */
    int near[8];             /* the last step of each ended near a singular pose */
} mstmm_scene_lanes;

int64_t mstmm_lanes_numbers(const mstmm_fused *fused);
/* Fills the integrator's view, whose failure codes are the guards' own, and what the group calls. */
void mstmm_scene_lanes_system(mstmm_scene_lanes *lanes, mstmm_system *system, mstmm_group *group);
/* cdef end */

/* Notes the failure that a code of `fused` means; returns its reason. */
static inline int mstmm_fused_failure(mstmm_scene_run *run, const mstmm_fused *fused, int code)
{
    const int *failure = fused->failures + 3 * (code - 1);
    run->failure = (mstmm_failure){failure[0], failure[1], failure[2]};
    return failure[0];
}

#endif
