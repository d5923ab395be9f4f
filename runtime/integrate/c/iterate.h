/* Stages of iterated Runge-Kutta methods. */
#ifndef MSTMM_ITERATE_H
#define MSTMM_ITERATE_H

#include "work.h"

/* Stages 1 .. s - 1 of an iterated method. */
int mstmm_iterate(const mstmm_work *work);

#endif
