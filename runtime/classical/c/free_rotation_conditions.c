/* Conditions of free rotations: the moments along them vanish. */
#include <string.h>

#include "hinges.h"

int classical_free_turns(const step_record *step, int index)
{
    switch (step->run->bodies[index].hinge) {
    case MSTMM_CLASSICAL_PIN:
    case MSTMM_CLASSICAL_ELASTIC_PIN: return 1;
    case MSTMM_CLASSICAL_BALL:
    case MSTMM_CLASSICAL_ELASTIC_BALL: return step->turns;
    default: return 0;
    }
}

/* a . m + (a x m_p) . turn = 0 for an axis that rotates with its section. */
static void pin_condition(const real *axis, const real *moment, int modes, const real *per_mode,
                          const real *eta, int length, real *row)
{
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        row[3 + i] = axis[j] * moment[k] - axis[k] * moment[j];
        row[6 + i] = axis[i];
    }
    for (int k = 0; k < modes; k++)
        for (int i = 0; i < 3; i++) {
            row[12 + k] += row[3 + i] * per_mode[modes * i + k];
            row[length - 1] -= row[3 + i] * per_mode[modes * i + k] * eta[k];
        }
}

/* Rows that vanish on the state just before or behind the free turn of a hinge: its own moments.
 * `middle`: between the springs and the turn of a hinge that has both, where there are no modes. */
void classical_own_condition(const step_record *step, int index, int outboard, int middle,
                             real *rows)
{
    const body_record *body = &step->run->bodies[index];
    const int side = outboard ? index : body->parent;
    const int modes = middle ? 0 : modes_of(step, side);
    const int length = 2 * step->rigid + modes + 1, count = classical_free_turns(step, index);
    memset(rows, 0, (size_t)count * length * sizeof(real));
    if (count == step->turns) {
        for (int i = 0; i < count; i++) rows[length * i + step->rigid + i] = 1;
        return;
    }
    const slopes at = classical_slopes(step, index);
    real axis[3];
    classical_pin_axis(step, index, axis);
    pin_condition(axis, step->run->motions[index].outboard, modes,
                  outboard ? at.outboard : at.inboard, outboard ? at.eta_outboard : at.eta_inboard,
                  length, rows);
}
