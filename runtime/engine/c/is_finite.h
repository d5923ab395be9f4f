/* Whether numbers are all finite. */
#ifndef MSTMM_FINITE_H
#define MSTMM_FINITE_H

#include <math.h>
#include <stdint.h>

#include "mstmm.h"

/* Sums of several are quicker than one after the other, and what is not finite makes its sum so; a
 * sum that overflows although its terms are finite is examined again. */
static inline int mstmm_finite(int64_t count, const real *numbers)
{
    real sums[8] = {0};
    int64_t k = 0;
    for (; k + 8 <= count; k += 8)
        for (int j = 0; j < 8; j++) sums[j] += numbers[k + j];
    for (; k < count; k++) sums[0] += numbers[k];
    for (int j = 1; j < 8; j++) sums[0] += sums[j];
    if (isfinite(sums[0])) return 1;
    for (k = 0; k < count; k++)
        if (!isfinite(numbers[k])) return 0;
    return 1;
}

#endif
