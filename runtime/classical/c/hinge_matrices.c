/* Hinges at the predictor: their matrices, and the conditions of free rotations.
 *
 * A matrix with free turns is made for conditions on the state behind the hinge: of what follows
 * (product) or of its own (Riccati).  The generated kernels take them as rows of "the outboard
 * body's matrix", which here holds nothing but these rows. */
#include "hinges.h"

/* Springs first, then the free rotation: two successive matrices. */
static int springs_then_rotation(const step_record *step, int index, const real *rows,
                                 const real *modal, real *matrix)
{
    const int inner = length_of(step, step->run->bodies[index].parent);
    const int middle = 2 * step->rigid + 1, outer = length_of(step, index);
    real first[WIDEST * WIDEST], second[WIDEST * WIDEST];
    if (classical_springs(step, index, 0, NULL, first)) return 1;
    if (classical_turning(step, index, 0, rows, modal, second)) return 1;
    classical_multiply(outer, middle, inner, second, first, matrix);
    return 0;
}

static int has_springs_and_rotation(int hinge)
{
    return hinge == MSTMM_CLASSICAL_ELASTIC_PIN || hinge == MSTMM_CLASSICAL_ELASTIC_BALL;
}

/* Rows on the state behind the hinge (`outboard`) or before it that vanish: moments of its free
 * turns. */
int classical_condition(const step_record *step, int index, int outboard, real *rows)
{
    const body_record *body = &step->run->bodies[index];
    const int count = classical_free_turns(step, index);
    if (outboard || !has_springs_and_rotation(body->hinge)) {
        classical_own_condition(step, index, outboard, 0, rows);
        return 0;
    }
    real own[TURNS * WIDEST], first[WIDEST * WIDEST];
    classical_own_condition(step, index, 0, 1, own);
    if (classical_springs(step, index, 0, NULL, first)) return 1;
    classical_multiply(count, 2 * step->rigid + 1, length_of(step, body->parent), own, first, rows);
    return 0;
}

/* Matrix across the hinge.  `rows` are as many conditions on the state behind it as it has free
 * turns, `modal` the modal rows of its outboard body. */
int classical_hinge(const step_record *step, int index, const real *rows, const real *modal,
                    real *matrix)
{
    const body_record *body = &step->run->bodies[index];
    if (body->hinge == MSTMM_CLASSICAL_FIXED) return classical_fixed(step, index, modal, matrix);
    if (body->hinge == MSTMM_CLASSICAL_ELASTIC)
        return classical_springs(step, index, body->modes, modal, matrix);
    if (has_springs_and_rotation(body->hinge))
        return springs_then_rotation(step, index, rows, modal, matrix);
    return classical_turning(step, index, modes_of(step, body->parent), rows, modal, matrix);
}
