/* Bounds of conditions between two evaluation times. */
#ifndef MSTMM_EVENT_BOUNDS_H
#define MSTMM_EVENT_BOUNDS_H

#include "scene.h"

/* Makes the integrator enclose the conditions if `run` has memory for it. */
void mstmm_enclose_events(mstmm_scene_run *run, mstmm_system *system);

#endif
