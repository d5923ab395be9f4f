/* Forward pass, root to tips: states from the motion of the ground and the relations, or through
 * the product's matrices. */
#include <math.h>
#include <string.h>

#include "parts.h"

/* State at the input of a hinge: positions and modes of the parent's end, loads by its relation;
 * along a chain of the product all from the state before. */
static void inboard_state(const step_record *step, int index, real *z)
{
    const body_record *bodies = step->run->bodies;
    const element *one = &step->elements[index];
    const int parent = bodies[index].parent, rigid = step->rigid;
    const int length = length_of(step, parent), columns = columns_of(step, parent);
    if (parent < 0) {
        memset(z, 0, (size_t)length * sizeof(real));
        memcpy(z, bodies[index].place, step->shifts * sizeof(real));
        z[length - 1] = 1;
    } else {
        classical_multiply(length, length, 1, one->outlet, step->elements[parent].state, z);
        if (step->run->product && bodies[parent].child == index) return;
    }
    for (int i = 0; i < rigid; i++) {
        const real *row = one->relation + columns * i;
        real sum = row[columns - 1];
        for (int k = 0; k < columns - 1; k++) sum += row[k] * z[k < rigid ? k : k + rigid];
        z[rigid + i] = sum;
    }
}

/* Loads that the product leaves at free tips, relative to the largest load. */
static int check_lost_digits(const step_record *step)
{
    const run_record *run = step->run;
    real size = 0, matrix[WIDEST * WIDEST], z[WIDEST], modal[MSTMM_CLASSICAL_MODES * WIDEST];
    for (int i = 0; i < run->n_bodies; i++)
        for (int k = 0; k < step->rigid; k++) size = fmax(size, fabs(run->motions[i].inboard[k]));
    for (int i = 0; i < run->n_bodies; i++) {
        const int length = length_of(step, i);
        if (run->bodies[i].child >= 0) continue;
        if (classical_body(step, i, -1, matrix, modal))
            return fail(step->run, MSTMM_CLASSICAL_LOST, i);
        classical_multiply(length, length, 1, matrix, step->elements[i].state, z);
        for (int k = 0; k < step->rigid; k++)
            if (!(fabs(z[step->rigid + k]) <= run->accuracy * size))
                return fail(step->run, MSTMM_CLASSICAL_LOST, i);
    }
    return 0;
}

/* States of all bodies, and the loads of their hinges.  The product's own boundary conditions are
 * checked. */
int classical_outward(const step_record *step)
{
    const run_record *run = step->run;
    for (int i = 0; i < run->n_bodies; i++) {
        element *one = &step->elements[i];
        motion *at = &run->motions[i];
        const int inner = length_of(step, run->bodies[i].parent);
        real before[WIDEST];
        inboard_state(step, i, before);
        classical_multiply(length_of(step, i), inner, 1, one->hinge, before, one->state);
        memcpy(at->inboard, before + step->rigid, step->rigid * sizeof(real));
        memcpy(at->outboard, one->state + step->rigid, step->rigid * sizeof(real));
    }
    return run->product ? check_lost_digits(step) : 0;
}
