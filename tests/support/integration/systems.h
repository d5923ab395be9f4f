/* What every test system has: parameters, memory, a counter. */
#ifndef MSTMM_TEST_SYSTEMS_H
#define MSTMM_TEST_SYSTEMS_H

#include "integrate.h"

typedef struct parameters {
    double p[8];
    double memory[4];
    long calls; /* whatever the system counts */
    const mstmm_system *system; /* for test_use_lanes */
} parameters;

#endif
