/* Sections on both sides of a hinge: their axes, and their rotation by modes. */
#include <string.h>

#include "hinges.h"

const real classical_nothing[36] = {0};

static void inertial_slopes(const motion *at, const real *per_mode, real *out)
{
    real turn[3], tangent[9], rates[6];
    classical_multiply(3, 2, 1, per_mode, at->position + 6, turn);
    classical_tangent(turn, tangent);
    classical_multiply(3, 3, 2, tangent, per_mode, rates);
    classical_multiply(3, 3, 2, at->axes, rates, out);
}

slopes classical_slopes(const step_record *step, int index)
{
    const body_record *body = &step->run->bodies[index];
    const motion *motions = step->run->motions;
    slopes found = {{0}, {0}, classical_nothing, classical_nothing};
    if (modes_of(step, body->parent)) {
        inertial_slopes(&motions[body->parent], body->slopes, found.inboard);
        found.eta_inboard = motions[body->parent].position + 6;
    }
    if (body->modes) {
        inertial_slopes(&motions[index], body->held, found.outboard);
        found.eta_outboard = motions[index].position + 6;
    }
    return found;
}

/* Axes of the outboard section, in space. */
void classical_outboard_axes(const step_record *step, int index, real *axes)
{
    const motion *at = &step->run->motions[index];
    const body_record *body = &step->run->bodies[index];
    real turn[3], rotation[9], bent[9];
    memcpy(bent, at->axes, sizeof bent);
    if (body->modes) {
        classical_multiply(3, 2, 1, body->held, at->position + 6, turn);
        classical_exponential(turn, rotation);
        classical_multiply(3, 3, 3, at->axes, rotation, bent);
    }
    classical_multiply(3, 3, 3, bent, body->end, axes);
}

/* Angular velocity of the outboard section, inertial axes, in space. */
void classical_outboard_spin(const step_record *step, int index, real *spin)
{
    const motion *at = &step->run->motions[index];
    const body_record *body = &step->run->bodies[index];
    real own[3] = {0}, rate[3], turn[3], tangent[9];
    if (body->modes) {
        classical_multiply(3, 2, 1, body->held, at->speed + 6, rate);
        classical_multiply(3, 2, 1, body->held, at->position + 6, turn);
        classical_tangent(turn, tangent);
        classical_multiply(3, 3, 1, tangent, rate, own);
    }
    for (int i = 0; i < 3; i++) own[i] += at->speed[3 + i];
    classical_multiply(3, 3, 1, at->axes, own, spin);
}

void classical_axis(const real *axes, real *axis)
{
    for (int i = 0; i < 3; i++) axis[i] = axes[3 * i + 2];
}

/* Axis of a pin: of its inboard section, or outboard of springs, which tilt it, of its outboard
 * section. */
void classical_pin_axis(const step_record *step, int index, real *axis)
{
    const section held = classical_section(step, index);
    real axes[9];
    if (step->run->bodies[index].hinge != MSTMM_CLASSICAL_ELASTIC_PIN) {
        classical_axis(held.axes, axis);
        return;
    }
    classical_outboard_axes(step, index, axes);
    classical_axis(axes, axis);
}
