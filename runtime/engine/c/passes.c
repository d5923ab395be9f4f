/* Passes of the looped engine in one unit with small kernels that they call: these become part of
 * them, which takes a seventh off closed loops in a plane.  The build leaves out what stands here. */
#include "sweep_planar_pin.c"
#include "sweep_loops.c"
#include "sweep_frames.c"
#include "sweep_steps.c"
