/* Tapes over intervals: bounds of their values and of the slopes of these along the motion. */
#ifndef MSTMM_TAPE_BOUNDS_H
#define MSTMM_TAPE_BOUNDS_H

#include "bounds.h"
#include "tape.h"

/* Runs a tape without guards in `slots` (n_slots), of which the caller has filled those of the
 * inputs that are read; writes the bounds of its outputs, all of one array.  Rounding is not
 * allowed for: the last few digits of a bound may be wrong. */
void mstmm_tape_bounds(const mstmm_tape *tape, mstmm_bounds *slots, mstmm_bounds *outputs);

#endif
