/* Bounces, for the other engine files. */
#ifndef MSTMM_BOUNCE_H
#define MSTMM_BOUNCE_H

#include "scene.h"

/* What an event strikes, and how its value grows with the places it reads. */
typedef struct mstmm_strike {
    const mstmm_scene_run *run;
    const mstmm_event_action *action;
    const real *slopes, *efforts; /* 1 + n_slopes; nu */
} mstmm_strike;

/* Throws the state back from an event that has come to hold; MSTMM_FIRE_*, or < 0: a reason. */
int mstmm_bounce(mstmm_scene_run *run, int event, real t, real *y);
/* Is the state behind an event that throws back, whose value there is g, and moves on into it? */
int mstmm_lets_through(mstmm_scene_run *run, int event, real t, const real *y, real g);

#endif
