/* Stages of iterated Runge-Kutta methods. */
#ifndef MSTMM_ITERATED_RUNGE_KUTTA_H
#define MSTMM_ITERATED_RUNGE_KUTTA_H

#include "workspace.h"

/* Stages 1 .. s - 1 of an iterated method. */
int mstmm_iterate(const mstmm_work *work);

#endif
