/* Interpreter of IR tapes (mstmm.ir.tape). */
#include "tape.h"

#include <math.h>

#define CASE(code, value)                                                                          \
    case code: result = value; break;

/* Runs the tape in `workspace` (n_slots numbers), then writes the outputs.  Returns 0, the code of
 * the guard that failed (nothing is written then) or MSTMM_TAPE_UNKNOWN. */
int mstmm_tape_run(const mstmm_tape *tape, const real *const *inputs, real *workspace,
                   real *const *outputs)
{
    real *const w = workspace;
    int slot = 0;
    for (int i = 0; i < tape->n_inputs; ++i)
        for (int j = 0; j < tape->input_lengths[i]; ++j) w[slot++] = inputs[i][j];
    for (int i = 0; i < tape->n_constants; ++i) w[slot++] = tape->constants[i];

    const int *step = tape->instructions;
    for (int i = 0; i < tape->n_instructions; ++i, step += MSTMM_TAPE_WIDTH) {
        const real a = w[step[2]], b = w[step[3]], c = w[step[4]];
        real result;
        switch (step[0]) {
            MSTMM_TAPE_OPERATIONS(CASE)
        case MSTMM_TAPE_GUARD:
            if (!(fabs(a) > 0)) return step[1];
            continue;
        default: return MSTMM_TAPE_UNKNOWN;
        }
        w[step[1]] = result;
    }

    const int *place = tape->outputs;
    for (int i = 0; i < tape->n_outputs; ++i, place += MSTMM_TAPE_OUTPUT_WIDTH) {
        real *const target = &outputs[place[0]][place[1]];
        *target = place[3] ? *target + w[place[2]] : w[place[2]];
    }
    return 0;
}
