/* The overall transfer matrix of every chain as the plain product of its elements' matrices, from
 * its inboard hinge to its free tip; branches act on the chain that carries them as loads that
 * depend on its motion.  Rui, Wang, Zhang, ch. 7 and 8.
 *
 * A free rotation is eliminated by the condition of the next free rotation outboard, or of the
 * free tip, as in the book; the condition of the first one along a chain is its boundary
 * condition. */
#include <math.h>
#include <string.h>

#include "least_squares.h"
#include "parts.h"

#define ROWS MSTMM_LEAST_SQUARES_ROWS /* 2 WIDEST */

/* The body's matrix to its main child, with the loads of the other branches in it. */
static int add_branches(const step_record *step, int index)
{
    const body_record *bodies = step->run->bodies;
    const int main = bodies[index].child, rigid = step->rigid, length = length_of(step, index);
    const int columns = columns_of(step, index);
    real matrix[WIDEST * WIDEST], alone[LOADS * WIDEST], more[LOADS * WIDEST];
    for (int child = bodies[main].next; child >= 0; child = bodies[child].next) {
        real *outlet = step->elements[main].outlet, carried[LOADS * WIDEST], through[LOADS * LOADS];
        if (classical_alone(step, index, matrix, alone)) return 1;
        if (classical_carried(step, index, child, more)) return 1;
        for (int i = 0; i < rigid; i++)
            for (int j = 0; j < rigid; j++)
                through[rigid * i + j] = outlet[length * (rigid + i) + rigid + j];
        for (int k = 0; k < rigid * columns; k++) more[k] -= alone[k];
        classical_multiply(rigid, rigid, columns, through, more, carried);
        for (int i = 0; i < rigid; i++)
            for (int j = 0; j < columns; j++)
                outlet[length * (rigid + i) + (j < rigid ? j : j + rigid)] -=
                    carried[columns * i + j];
    }
    return 0;
}

/* Of a free tip: the moments that vanish there, as many as the hinge before turns freely. */
static void tip_rows(const step_record *step, int index, int count, int length, const real *to_tip,
                     real *rows)
{
    const section held = classical_section(step, index);
    for (int i = 0; i < count; i++)
        for (int j = 0; j < length; j++) {
            const real *moments = to_tip + length * step->rigid + j;
            rows[length * i + j] = count == step->turns ? moments[length * i] : 0;
            for (int k = 0; k < 3 && count < step->turns; k++)
                rows[length * i + j] += held.axes[3 * k + 2] * moments[length * k];
        }
}

/* From a hinge's input to the tip of its chain: product, and condition that still waits. */
static int one_hinge(const step_record *step, int index)
{
    element *one = &step->elements[index];
    const body_record *body = &step->run->bodies[index];
    const int main = body->child, length = length_of(step, index);
    const int free = classical_free_turns(step, index);
    const int inner = length_of(step, body->parent);
    real matrix[WIDEST * WIDEST], alone[LOADS * WIDEST], rows[TURNS * WIDEST];
    real to_tip[WIDEST * WIDEST];
    one->tip = main < 0 ? index : step->elements[main].tip;
    const int last = length_of(step, one->tip);
    int waiting = 0;
    if (main < 0) {
        if (classical_alone(step, index, to_tip, alone)) return 1;
    } else {
        const element *next = &step->elements[main];
        if (classical_outlets(step, index) || add_branches(step, index)) return 1;
        classical_multiply(last, length, length, next->chain, next->outlet, to_tip);
        waiting = next->conditions;
        classical_multiply(waiting, length, length, next->condition, next->outlet, rows);
    }
    if (body->hinge == MSTMM_CLASSICAL_FREE) {
        memcpy(one->chain, to_tip, sizeof to_tip);
        memcpy(one->condition, rows, sizeof rows);
        one->conditions = waiting;
        return 0;
    }
    if (free && !waiting) tip_rows(step, index, free, length, to_tip, rows);
    if (classical_hinge(step, index, rows, one->modal, one->hinge)) return 1;
    classical_multiply(last, length, inner, to_tip, one->hinge, one->chain);
    one->conditions = free ? free : waiting;
    if (free) return classical_condition(step, index, 0, one->condition);
    memcpy(matrix, rows, sizeof rows);
    classical_multiply(waiting, length, inner, matrix, one->hinge, one->condition);
    return 0;
}

static void scale_row(int width, real *row)
{
    real size = 0;
    for (int j = 0; j < width; j++) size = fmax(size, fabs(row[j]));
    for (int j = 0; j < width && size > 0; j++) row[j] /= size;
}

/* Rows on a state as [unknown | -known]; `unknown` are its places. */
static void boundary_row(int count, const int *unknown, int known, const int *places,
                         const real *row, real *out)
{
    for (int j = 0; j < count; j++) out[j] = row[unknown[j]];
    for (int j = 0; j < known; j++) out[count + j] = -row[places[j]];
}

/* The last body of the chain up to its tip whose hinge turns freely, or -1. */
static int last_turning(const step_record *step, int index)
{
    for (int body = step->elements[index].tip;; body = step->run->bodies[body].parent) {
        if (classical_free_turns(step, body)) return body;
        if (body == index) return -1;
    }
}

/* Two directions across an axis. */
static void normal_directions(const real *axis, real *directions)
{
    int least = 0;
    real size = 0;
    for (int i = 1; i < 3; i++)
        if (fabs(axis[i]) < fabs(axis[least])) least = i;
    const int j = (least + 1) % 3, k = (least + 2) % 3;
    directions[least] = 0;
    directions[j] = -axis[k];
    directions[k] = axis[j];
    size = hypot(axis[j], axis[k]);
    for (int i = 0; i < 3; i++) directions[i] /= size;
    for (int i = 0; i < 3; i++)
        directions[3 + i] = axis[(i + 1) % 3] * directions[(i + 2) % 3] -
                            axis[(i + 2) % 3] * directions[(i + 1) % 3];
}

/* Rows of the chain's free tip that no free turn has used up: force, and moments across the last
 * one's directions.  Returns how many there are. */
static int free_tip(const step_record *step, int index, int length, real *rows)
{
    const real *chain = step->elements[index].chain;
    const int rigid = step->rigid, turns = step->turns, last = last_turning(step, index);
    const int used = last < 0 ? 0 : classical_free_turns(step, last);
    int count = rigid - used;
    if (used == 0 || used == turns) {
        memcpy(rows, chain + length * (rigid + used), (size_t)count * length * sizeof(real));
        return count;
    }
    real directions[6];
    const section held = classical_section(step, last);
    const real axis[3] = {held.axes[2], held.axes[5], held.axes[8]};
    normal_directions(axis, directions);
    classical_multiply(2, 3, length, directions, chain + length * rigid, rows);
    memcpy(rows + 2 * length, chain + length * (rigid + turns), 3 * length * sizeof(real));
    return count;
}

/* Boundary conditions of the chain from the hinge `index` to its tip: rows of [A | b]. */
static int boundary(const step_record *step, int index, int held, real *system)
{
    const element *one = &step->elements[index];
    const int side = held ? step->run->bodies[index].parent : index;
    const int rigid = step->rigid, length = length_of(step, side), modes = modes_of(step, side);
    int loads[LOADS], motions[WIDEST], rows = 0;
    real tip[LOADS * WIDEST];
    for (int k = 0; k < rigid; k++) loads[k] = rigid + k;
    for (int k = 0; k < rigid + modes; k++) motions[k] = k < rigid ? k : k + rigid;
    motions[rigid + modes] = length - 1;
    const int *unknown = held ? loads : motions, *known = held ? motions : motions + rigid + modes;
    const int count = held ? rigid : rigid + modes, others = held ? rigid + modes + 1 : 1;
    const int width = count + others;
    for (const int free = free_tip(step, index, length, tip); rows < free; rows++)
        boundary_row(count, unknown, others, known, tip + length * rows, system + width * rows);
    for (int k = 0; k < one->conditions; k++, rows++)
        boundary_row(count, unknown, others, known, one->condition + length * k,
                     system + width * rows);
    for (int k = 0; !held && k < modes; k++, rows++)
        boundary_row(count, unknown, others, known, one->modal + length * k, system + width * rows);
    for (int k = 0; k < rows; k++) scale_row(width, system + width * k);
    return rows;
}

/* Loads of a chain from the motion of its parent; a free body gets its motion. */
static int close_chain(const step_record *step, int index)
{
    element *one = &step->elements[index];
    const int held = step->run->bodies[index].hinge != MSTMM_CLASSICAL_FREE;
    const int rigid = step->rigid, modes = modes_of(step, index);
    const int columns = columns_of(step, step->run->bodies[index].parent);
    real system[ROWS * 2 * WIDEST], x[WIDEST];
    const int rows = boundary(step, index, held, system);
    if (held) return mstmm_least_squares(rows, rigid, columns, system, one->relation);
    if (mstmm_least_squares(rows, rigid + modes, 1, system, x)) return 1;
    classical_let_go(step, index, x);
    return 0;
}

int classical_product(const step_record *step)
{
    const body_record *bodies = step->run->bodies;
    for (int i = step->run->n_bodies - 1; i >= 0; i--) {
        const int parent = bodies[i].parent, head = parent < 0 || bodies[parent].child != i;
        if (one_hinge(step, i) || (head && close_chain(step, i)))
            return fail(step->run, MSTMM_CLASSICAL_SINGULAR, i);
    }
    return 0;
}
