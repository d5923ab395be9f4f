/* Backward pass, tips to root, by relations f = S a + e (Riccati) with the matrices of the
 * elements: loads are never differences of large numbers.  Rui, Bestle et al., Multibody Syst.
 * Dyn. 49 (2020) 337-354. */
#include "parts.h"

/* Conditions and modal rows with the loads put in, as rows on the state behind the hinge. */
static int outboard_rows(const step_record *step, int index, const real *relation, real *conditions,
                         real *modal)
{
    const int length = length_of(step, index), columns = columns_of(step, index);
    const int modes = modes_of(step, index), free = classical_free_turns(step, index);
    real states[WIDEST * WIDEST], rows[TURNS * WIDEST], narrow[TURNS * WIDEST];
    classical_states(step, index, relation, states);
    if (free) {
        if (classical_condition(step, index, 1, rows)) return 1;
        classical_multiply(free, length, columns, rows, states, narrow);
        classical_widened(step, index, free, narrow, conditions);
    }
    if (modes) {
        classical_multiply(modes, length, columns, step->elements[index].modal, states, narrow);
        classical_widened(step, index, modes, narrow, modal);
    }
    return 0;
}

/* Relation before the hinge from the one behind it: (U_ff - S U_af) f = (S U_aa - U_fa) a + ... */
static int pass_relation(const step_record *step, int index, const real *behind)
{
    element *one = &step->elements[index];
    const int parent = step->run->bodies[index].parent, rigid = step->rigid;
    const int inner = length_of(step, parent), columns = columns_of(step, parent);
    const int modes = modes_of(step, index), width = columns_of(step, index);
    real system[LOADS * LOADS];
    for (int i = 0; i < rigid; i++)
        for (int j = 0; j < inner; j++) {
            const real *s = behind + width * i;
            real sum = -one->hinge[inner * (rigid + i) + j] + s[width - 1] * (j == inner - 1);
            for (int k = 0; k < rigid; k++) sum += s[k] * one->hinge[inner * k + j];
            for (int k = 0; k < modes; k++)
                sum += s[rigid + k] * one->hinge[inner * (2 * rigid + k) + j];
            if (j >= rigid && j < 2 * rigid)
                system[rigid * i + j - rigid] = -sum;
            else
                one->relation[columns * i + (j < rigid ? j : j - rigid)] = sum;
        }
    return classical_solve(rigid, columns, system, one->relation);
}

/* A free body: S a + e = 0 and its modal rows give the motion. */
static int solve_free_body(const step_record *step, int index, const real *behind,
                           const real *modal)
{
    const int rigid = step->rigid, modes = modes_of(step, index), size = rigid + modes;
    const int width = size + 1, length = length_of(step, index);
    real system[(LOADS + 3) * (LOADS + 3)], x[LOADS + 3];
    for (int i = 0; i < size; i++) {
        for (int j = 0; j < size; j++) {
            const int column = j < rigid ? j : j + rigid;
            system[size * i + j] =
                i < rigid ? behind[width * i + j] : modal[length * (i - rigid) + column];
        }
        x[i] = i < rigid ? -behind[width * i + size] : -modal[length * (i - rigid) + length - 1];
    }
    if (classical_solve(size, 1, system, x)) return 1;
    classical_let_go(step, index, x);
    return 0;
}

int classical_riccati(const step_record *step)
{
    real behind[LOADS * WIDEST], conditions[TURNS * WIDEST];
    real modal[MSTMM_CLASSICAL_MODES * WIDEST];
    for (int i = step->run->n_bodies - 1; i >= 0; i--) {
        if (classical_outlets(step, i) || classical_absorbed(step, i, behind) ||
            outboard_rows(step, i, behind, conditions, modal))
            return fail(step->run, MSTMM_CLASSICAL_SINGULAR, i);
        const int free = step->run->bodies[i].hinge == MSTMM_CLASSICAL_FREE;
        real *hinge = step->elements[i].hinge;
        if (free ? solve_free_body(step, i, behind, modal)
                 : classical_hinge(step, i, conditions, modal, hinge) ||
                       pass_relation(step, i, behind))
            return fail(step->run, MSTMM_CLASSICAL_SINGULAR, i);
    }
    return 0;
}
