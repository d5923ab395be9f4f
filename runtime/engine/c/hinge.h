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
    return body->tape ? mstmm_hinge_interpreted(state, body, to)
                      : mstmm_hinge_hinge_by(body->hinge, to);
}
int mstmm_hinge_slope_interpreted(mstmm_state *state, const mstmm_body *body,
                                  struct mstmm_hinge_hinge_slope to);

static inline int mstmm_hinge_slope_of_by(mstmm_state *state, const mstmm_body *body,
                                          struct mstmm_hinge_hinge_slope to)
{
    return body->slope_tape ? mstmm_hinge_slope_interpreted(state, body, to)
                            : mstmm_hinge_hinge_slope_by(body->hinge_slope, to);
}
#define mstmm_hinge_slope_of(state, body, ...)                                                     \
    mstmm_hinge_slope_of_by(state, body, (struct mstmm_hinge_hinge_slope){__VA_ARGS__})
#define mstmm_hinge_of(state, body, ...)                                                           \
    mstmm_hinge_of_by(state, body, (struct mstmm_hinge_hinge){__VA_ARGS__})

#endif
