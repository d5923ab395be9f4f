/* Inputs and signals of a scene: polynomials in time, piece by piece, whose numbers expressions
 * read; inputs that are held stand in the run's memory instead. */
#ifndef MSTMM_INPUTS_H
#define MSTMM_INPUTS_H

#include <stdint.h>
#include <string.h>

#include "mstmm.h"

/* cdef begin */
/* Numbers of a piece: t0, c0, c1, c2, c3; its value is c0 + c1 s + c2 s^2 + c3 s^3, s = t - t0. */
#define MSTMM_INPUT_NUMBERS 5

typedef struct {
    int64_t n_knots;
    const real *knots;   /* ascending: at each the next piece begins */
    const real *numbers; /* (n_knots + 1) x MSTMM_INPUT_NUMBERS */
    int64_t held;        /* >= 0: its place in memory, where it stands still within a step */
} mstmm_input;

/* Places in the numbers p of compiled code, MSTMM_INPUT_NUMBERS an input, -1 where none is read. */
typedef struct {
    int n; /* inputs; 0 where none changes with time, and p is right as it is */
    const mstmm_input *inputs;
    const int *places;
} mstmm_live_inputs;
/* cdef end */

/* The piece that holds at t. */
static inline const real *mstmm_input_at(const mstmm_input *input, real t)
{
    int64_t low = 0, high = input->n_knots; /* knots before `low` are not behind t */
    while (low < high) {
        const int64_t middle = low + (high - low) / 2;
        if (input->knots[middle] <= t)
            low = middle + 1;
        else
            high = middle;
    }
    return input->numbers + MSTMM_INPUT_NUMBERS * low;
}

/* The numbers of an input at t; `held` has room for those of one that is held. */
static inline const real *mstmm_input_now(const mstmm_input *input, real t, const real *memory,
                                          real *held)
{
    if (input->held < 0) return mstmm_input_at(input, t);
    memset(held, 0, MSTMM_INPUT_NUMBERS * sizeof(real));
    held[1] = memory[input->held];
    return held;
}

/* The numbers of all inputs at t, one behind the other. */
static inline void mstmm_inputs_at(int n, const mstmm_input *inputs, real t, const real *memory,
                                   real *numbers)
{
    real held[MSTMM_INPUT_NUMBERS];
    for (int i = 0; i < n; i++)
        memcpy(numbers + MSTMM_INPUT_NUMBERS * i, mstmm_input_now(&inputs[i], t, memory, held),
               MSTMM_INPUT_NUMBERS * sizeof(real));
}

/* Those that compiled code reads, in its numbers p. */
static inline void mstmm_renew_inputs(const mstmm_live_inputs *live, real t, const real *memory,
                                      real *p)
{
    real held[MSTMM_INPUT_NUMBERS];
    for (int i = 0; i < live->n; i++) {
        const real *numbers = mstmm_input_now(&live->inputs[i], t, memory, held);
        const int *places = live->places + MSTMM_INPUT_NUMBERS * i;
        for (int k = 0; k < MSTMM_INPUT_NUMBERS; k++)
            if (places[k] >= 0) p[places[k]] = numbers[k];
    }
}

#endif
