/* Loads at the input end of a body by its motion, f = S a + e, from those at its output ends.
 *
 * With one output end it follows from the body's matrix: f_O = U_fa a + U_ff f_I + U_f1 and a_O of
 * a alone. With several, each contributes as if it were the only one on the body. */
#include <string.h>

#include "parts.h"

/* Place in a state of column j of a relation: positions, modes, 1. */
static int place_of(const step_record *step, int column)
{
    return column < step->rigid ? column : column + step->rigid;
}

/* x = U_ff^-1 (known - U_f), known LOADS x columns (NULL: zero). */
static int input_relation(const step_record *step, int body, const real *matrix, const real *known,
                          real *x)
{
    const int rigid = step->rigid, length = length_of(step, body), columns = columns_of(step, body);
    real carried[LOADS * LOADS];
    for (int i = 0; i < rigid; i++) {
        const real *row = matrix + length * (rigid + i);
        for (int j = 0; j < rigid; j++) carried[rigid * i + j] = row[rigid + j];
        for (int j = 0; j < columns; j++)
            x[columns * i + j] = (known ? known[columns * i + j] : 0) - row[place_of(step, j)];
    }
    return classical_solve(rigid, columns, carried, x);
}

/* Loads at the hinge of a child by the motion of the parent's input end: its relation with the
 * outlet's positions put in. */
static void outlet_loads(const step_record *step, int body, int child, real *known)
{
    const element *to = &step->elements[child];
    const int rigid = step->rigid, length = length_of(step, body), columns = columns_of(step, body);
    for (int i = 0; i < rigid; i++)
        for (int j = 0; j < columns; j++) {
            const real *row = to->relation + columns * i;
            real sum = j < rigid ? 0 : row[j];
            for (int k = 0; k < rigid; k++)
                sum += row[k] * to->outlet[length * k + place_of(step, j)];
            known[columns * i + j] = sum;
        }
}

/* Contribution of one child to the loads at the body's input end. */
int classical_carried(const step_record *step, int body, int child, real *relation)
{
    real known[LOADS * WIDEST];
    outlet_loads(step, body, child, known);
    return input_relation(step, body, step->elements[child].outlet, known, relation);
}

/* Matrices of a body to all hinges that it carries; its modal rows for the first of them. */
int classical_outlets(const step_record *step, int body)
{
    const body_record *bodies = step->run->bodies;
    real modal[MSTMM_CLASSICAL_MODES * WIDEST];
    for (int child = bodies[body].child; child >= 0; child = bodies[child].next)
        if (classical_body(step, body, child, step->elements[child].outlet,
                           child == bodies[body].child ? step->elements[body].modal : modal))
            return 1;
    return 0;
}

/* The body with nothing at its ends: `matrix` to a free end at the input, and the relation. */
int classical_alone(const step_record *step, int body, real *matrix, real *relation)
{
    return classical_body(step, body, -1, matrix, step->elements[body].modal) ||
           input_relation(step, body, matrix, NULL, relation);
}

/* f = S a + e at the input end: rigid x (rigid + modes + 1). */
int classical_absorbed(const step_record *step, int body, real *relation)
{
    const body_record *bodies = step->run->bodies;
    const int first = bodies[body].child, count = step->rigid * columns_of(step, body);
    real matrix[WIDEST * WIDEST], alone[LOADS * WIDEST], more[LOADS * WIDEST];
    if (first < 0) return classical_alone(step, body, matrix, relation);
    if (classical_carried(step, body, first, relation)) return 1;
    for (int child = bodies[first].next; child >= 0; child = bodies[child].next) {
        if (classical_alone(step, body, matrix, alone)) return 1;
        if (classical_carried(step, body, child, more)) return 1;
        for (int k = 0; k < count; k++) relation[k] += more[k] - alone[k];
    }
    return 0;
}

/* The hinge of a free body: outboard of it is the motion x, independent of the input. */
void classical_let_go(const step_record *step, int body, const real *x)
{
    element *one = &step->elements[body];
    const int inner = 2 * step->rigid + 1, length = length_of(step, body);
    memset(one->hinge, 0, (size_t)length * inner * sizeof(real));
    memset(one->relation, 0, sizeof one->relation);
    for (int i = 0; i + 1 < columns_of(step, body); i++)
        one->hinge[inner * place_of(step, i) + inner - 1] = x[i];
    one->hinge[inner * length - 1] = 1;
}

/* States (length x columns) of a relation: positions and modes themselves, loads by it. */
void classical_states(const step_record *step, int body, const real *relation, real *states)
{
    const int rigid = step->rigid, length = length_of(step, body), columns = columns_of(step, body);
    memset(states, 0, (size_t)length * columns * sizeof(real));
    memcpy(states + columns * rigid, relation, (size_t)rigid * columns * sizeof(real));
    for (int j = 0; j < columns; j++) states[columns * place_of(step, j) + j] = 1;
}

/* Rows on relations' columns as rows on states. */
void classical_widened(const step_record *step, int body, int count, const real *narrow, real *rows)
{
    const int length = length_of(step, body), columns = columns_of(step, body);
    memset(rows, 0, (size_t)count * length * sizeof(real));
    for (int i = 0; i < count; i++)
        for (int j = 0; j < columns; j++)
            rows[length * i + place_of(step, j)] = narrow[columns * i + j];
}
