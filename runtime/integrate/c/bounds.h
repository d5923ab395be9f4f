/* Bounds of a quantity between two times, and of its rate. */
#ifndef MSTMM_BOUNDS_H
#define MSTMM_BOUNDS_H

/* cdef begin */
typedef struct mstmm_bounds {
    double lo, hi;             /* -INFINITY, INFINITY: anything */
    double slope_lo, slope_hi; /* 1/s */
} mstmm_bounds;
/* cdef end */

#endif
