/* Runs of bodies that are swept as links: a rigid body behind a hinge that moves about and along z,
 * one kernel a pass, and between the passes no more in memory than the next pass reads. */
#ifndef MSTMM_LINKS_H
#define MSTMM_LINKS_H

#include "sweep.h"

/* cdef begin */
/* Numbers of a link in the workspace: bias motion and, over it, the deviation; load; turn; shift;
 * then g (nu) and G (6 nu). */
#define MSTMM_LINK_MOTION 0
#define MSTMM_LINK_LOAD 9
#define MSTMM_LINK_TURN 15
#define MSTMM_LINK_SHIFT 17
#define MSTMM_LINK_FIXED 18
#define MSTMM_LINK_PER_SPEED 7

/* Numbers of a link that stay: link (5), b (11), p of the hinge (1 at most). */
#define MSTMM_LINK_NUMBERS 17

/* Splits the bodies into runs; returns their number.  `runs` holds n_bodies entries and `numbers`
 * one per body; links lie in the workspace from `place`; `size` receives how much they take.
 * `gathered` (MSTMM_LINK_NUMBERS per body) receives the links' numbers side by side; NULL: they are
 * few and shared, and stay where they are. */
int mstmm_fill_runs(const mstmm_model *model, mstmm_branch *runs, const real **numbers,
                    real *gathered, int64_t place, int64_t *size);
/* cdef end */

/* Where one link finds its kernels and its numbers, and those of its neighbours. */
typedef struct {
    mstmm_state *state;
    int index, nu;
    void (*angle)(void), (*forward)(void), (*condense)(void), (*recover)(void);
    const real *numbers, *q, *u, *tau, *outer_motion, *outer_delta, *inner;
    real *link, *qdot, *udot, *outer;
} mstmm_link_at;

#endif
