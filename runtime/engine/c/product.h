/* The plain product of classical matrices along a chain, for its own files; see product.c. */
#ifndef MSTMM_PRODUCT_H
#define MSTMM_PRODUCT_H

#include "sweep.h"

#define N 13       /* numbers of a state: rdd, omegadot, m, q, 1 */
#define BODY 0     /* transfer matrix of the body */
#define HINGE 169  /* transfer matrix of its inboard hinge */
#define SCALE 338  /* magnitudes of the body's force rows */
#define STATE 374  /* deviation of its acceleration at P */
#define LOAD 380   /* what acts on it, body axes at P */

/* What loads the chain: all that acts, or that and the multipliers of closed loops; from 0 on, the
 * multiplier of that row of closed loops is one, and all is at rest without gravity. */
#define ACTING (-2)
#define HELD (-1)

/* The next body of the chain behind one (-1: the ground), frames of hinges that close loops left
 * out; -1 behind the last. */
static inline int mstmm_product_next(const mstmm_model *model, int index)
{
    for (int i = index + 1; i < model->n_bodies; i++)
        if (!model->looped || !model->looped[i].closure) return i;
    return -1;
}

/* Numbers of a body: two matrices, scales, its deviation, its load. */
static inline real *mstmm_product_numbers(const mstmm_state *state, int index)
{
    return state->workspace + state->model->product->place +
           (size_t)MSTMM_PRODUCT_PER_BODY * index;
}

/* Accelerations of all speeds, behind all bodies. */
static inline real *mstmm_product_accelerations(const mstmm_state *state)
{
    return mstmm_product_numbers(state, state->model->n_bodies);
}

/* Multipliers of closed loops, one a row, and behind them the equations that give them. */
static inline real *mstmm_product_multipliers(const mstmm_state *state)
{
    return mstmm_product_accelerations(state) + state->model->nu;
}

/* Efforts of a body's hinge. */
static inline const real *mstmm_product_tau(const mstmm_state *state, int index)
{
    const mstmm_body *body = &state->model->bodies[index];
    return mstmm_of_speeds(state->workspace + body->block, body->nu, MSTMM_SPEED_TAU);
}

/* Efforts of a hinge as a force (where it is asked for) and a moment, its axis, and the offset of P
 * from Q, zero for pins and balls; inertial axes. */
void mstmm_product_efforts(const mstmm_state *state, int index, real *force, real *moment);
void mstmm_product_axis(const mstmm_state *state, int index, real *axis);
void mstmm_product_offset(const mstmm_state *state, int index, real *offset);

/* State at the ground from the overall matrix: the tip is free, the first hinge has its efforts;
 * without gravity and efforts where `alone`.  Nonzero: not determined. */
int mstmm_product_root(const mstmm_state *state, const real *overall, int alone, real *root);
/* Accelerations and deviations of the chain under a load.  Nonzero = failure code. */
int mstmm_product_chain(mstmm_state *state, int load);
/* The same with the loops closed that end on it, behind a sweep; `open` is raised to the largest
 * acceleration of the open chain, of which closing leaves the difference. */
int mstmm_product_closed(mstmm_state *state, real *open);

#endif
