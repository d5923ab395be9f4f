/* Passes of the looped engine in one unit with small kernels that they call: these become part of
 * them, which saves a seventh for planar closed loops.  The build skips the files included here. */
#include "sweep_planar_pin.c"
#include "sweep_loops.c"
#include "sweep_frames.c"
#include "sweep_steps.c"
