/* The hinge kernel of a body: compiled, or interpreted where there was no compiler. */
#ifndef MSTMM_HINGE_H
#define MSTMM_HINGE_H

#include "kernel_calls.h"
#include "sweep.h"

int mstmm_hinge_interpreted(mstmm_state *state, const mstmm_body *body,
                            struct mstmm_hinge_hinge to);

static inline int mstmm_hinge_of_by(mstmm_state *state, const mstmm_body *body,
                                    struct mstmm_hinge_hinge to)
{
    return body->kernels->tape ? mstmm_hinge_interpreted(state, body, to)
                               : mstmm_hinge_hinge_by(body->kernels->hinge, to);
}
int mstmm_hinge_slope_interpreted(mstmm_state *state, const mstmm_body *body,
                                  struct mstmm_hinge_hinge_slope to);

static inline int mstmm_hinge_slope_of_by(mstmm_state *state, const mstmm_body *body,
                                          struct mstmm_hinge_hinge_slope to)
{
    return body->kernels->slope_tape ? mstmm_hinge_slope_interpreted(state, body, to)
                                     : mstmm_hinge_hinge_slope_by(body->kernels->hinge_slope, to);
}

/* All derivatives of the rates, by kernels of the hinge's own or one direction at a time. */
int mstmm_hinge_rates_along(mstmm_state *state, const mstmm_body *body, int of_speeds, real *rows);

static inline int mstmm_hinge_rates_by_coordinates_of_by(mstmm_state *state, const mstmm_body *body,
                                                         struct mstmm_hinge_rates_by_coordinates to)
{
    return body->kernels->rates_by_coordinates
               ? mstmm_hinge_rates_by_coordinates_by(body->kernels->rates_by_coordinates, to)
               : mstmm_hinge_rates_along(state, body, 0, to.J);
}

static inline int mstmm_hinge_rates_by_speeds_of_by(mstmm_state *state, const mstmm_body *body,
                                                    struct mstmm_hinge_rates_by_speeds to)
{
    return body->kernels->rates_by_speeds
               ? mstmm_hinge_rates_by_speeds_by(body->kernels->rates_by_speeds, to)
               : mstmm_hinge_rates_along(state, body, 1, to.J);
}
#define mstmm_hinge_rates_by_coordinates_of(state, body, ...)                                      \
    mstmm_hinge_rates_by_coordinates_of_by(state, body,                                            \
                                           (struct mstmm_hinge_rates_by_coordinates){__VA_ARGS__})
#define mstmm_hinge_rates_by_speeds_of(state, body, ...)                                           \
    mstmm_hinge_rates_by_speeds_of_by(state, body,                                                 \
                                      (struct mstmm_hinge_rates_by_speeds){__VA_ARGS__})
#define mstmm_hinge_slope_of(state, body, ...)                                                     \
    mstmm_hinge_slope_of_by(state, body, (struct mstmm_hinge_hinge_slope){__VA_ARGS__})
#define mstmm_hinge_of(state, body, ...)                                                           \
    mstmm_hinge_of_by(state, body, (struct mstmm_hinge_hinge){__VA_ARGS__})

#endif
