/* Bounds of conditions between two looks at the motion. */
#ifndef MSTMM_BETWEEN_H
#define MSTMM_BETWEEN_H

#include "scene.h"

/* Lets the integrator enclose what is watched, where `run` has room for it. */
void mstmm_enclose_events(mstmm_scene_run *run, mstmm_system *system);

#endif
