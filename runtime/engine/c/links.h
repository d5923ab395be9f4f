/* Runs of bodies that are swept as links: a rigid body on a hinge that moves about and along z or
 * rotates about a point.  One kernel per pass; only numbers for the next pass are stored. */
#ifndef MSTMM_LINKS_H
#define MSTMM_LINKS_H

#include "sweep.h"

/* cdef begin */
/* Numbers of a link in the workspace: bias motion and, over it, the deviation; load; shift; then
 * g (nu), G (6 nu), and the turn: cosine and sine, or a rotation (9). */
#define MSTMM_LINK_MOTION 0
#define MSTMM_LINK_LOAD 9
#define MSTMM_LINK_SHIFT 15
#define MSTMM_LINK_FIXED 16
#define MSTMM_LINK_PER_SPEED 7
#define MSTMM_LINK_ANGLE 2
#define MSTMM_LINK_ROTATION 9

/* Numbers of a link that stay: b (11), p of the hinge (1 at most), and as many as its kernels have
 * of the connection. */
#define MSTMM_LINK_OWN 12

/* Splits the bodies into runs; returns their number.  `runs` holds n_bodies entries and `numbers`
 * one per body; links are in the workspace from `place`; `size` receives their total size.
 * `gathered` receives the links' numbers side by side; NULL: they are few and shared, and stay
 * where they are. */
int mstmm_fill_runs(const mstmm_model *model, mstmm_branch *runs, const real **numbers,
                    real *gathered, int64_t place, int64_t *size);
/* cdef end */

#define MSTMM_LINK_TURN(nu) (MSTMM_LINK_FIXED + MSTMM_LINK_PER_SPEED * (nu))

/* Kernels and numbers of one link and of its neighbours. */
typedef struct {
    mstmm_state *state;
    int index, nu;
    void (*turn)(void), (*forward)(void), (*condense)(void), (*recover)(void);
    const real *numbers, *q, *u, *tau, *outer_motion, *outer_delta, *inner;
    real *link, *qdot, *udot, *outer;
} mstmm_link_at;

#endif
