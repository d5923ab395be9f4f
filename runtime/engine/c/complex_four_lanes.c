/* The sweeps in complex numbers once more, for processors that take four doubles at a time. */
#include "harmonic_response.h"

#ifdef MSTMM_FOUR_LANES
#pragma GCC target("avx2")
#define MSTMM_LANES 4
#include "complex_steps.c"
#endif
