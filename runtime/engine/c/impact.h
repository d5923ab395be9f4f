/* Bounces, for the other engine files. */
#ifndef MSTMM_IMPACT_H
#define MSTMM_IMPACT_H

#include "scene.h"

/* Event that bounces: derivatives of its value with respect to the positions that it reads. */
typedef struct mstmm_strike {
    const mstmm_scene_run *run;
    const mstmm_event_action *action;
    const real *slopes, *efforts; /* 1 + n_slopes; nu */
} mstmm_strike;

/* Applies the impact of an event that has become true; MSTMM_FIRE_*, or < 0: a reason. */
int mstmm_bounce(mstmm_scene_run *run, int event, real t, real *y);
/* True if the state is past an event that bounces, with value g, and moves further into it. */
int mstmm_lets_through(mstmm_scene_run *run, int event, real t, const real *y, real g);

#endif
