/* Matrices of elastic hinges: springs and dampers between two sections. */
#include <math.h>

#include "hinges.h"

#define RIGID_STIFFNESS 1e30 /* of a spring that must not rotate; its compliance vanishes */
/* The same relative to springs that rotate: rounding of a larger one would be as large as they
 * are. */
#define RIGID_BESIDE 1e8

/* axes diag axes^T */
static void turned_diagonal(int n, const real *axes, const real *diagonal, real *out)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            out[n * i + j] = 0;
            for (int k = 0; k < n; k++)
                out[n * i + j] += axes[n * i + k] * diagonal[k] * axes[n * j + k];
        }
}

/* Springs of a planar hinge: x, y along the inboard section's axes, and the angle. */
static int planar_springs(const step_record *step, int index, int outer, const real *modal,
                          real *matrix)
{
    const body_record *body = &step->run->bodies[index];
    const motion *at = &step->run->motions[index];
    const section held = classical_section(step, index);
    const int locked = body->hinge != MSTMM_CLASSICAL_ELASTIC;
    const real angle = held.angle + body->turn[1];
    const real axes[4] = {cos(angle), -sin(angle), sin(angle), cos(angle)};
    real turn = at->position[2], rate = at->speed[2], k_t[4], c_t[4];
    real d[2], moved[2], force[2] = {0};
    for (int k = 0; k < body->modes; k++) {
        turn += body->held[k] * at->position[3 + k];
        rate += body->held[k] * at->speed[3 + k];
    }
    for (int i = 0; i < 2; i++) d[i] = at->position[i] - held.position[i];
    moved[0] = at->speed[0] - held.speed[0] + held.spin[0] * d[1];
    moved[1] = at->speed[1] - held.speed[1] - held.spin[0] * d[0];
    for (int k = 0; k < 2; k++) {
        const real stretch = axes[k] * d[0] + axes[2 + k] * d[1] - body->law[3 + k];
        const real speed = axes[k] * moved[0] + axes[2 + k] * moved[1];
        const real push = -body->law[k] * stretch - body->law[6 + k] * speed;
        for (int i = 0; i < 2; i++) force[i] += axes[2 * i + k] * push;
    }
    turned_diagonal(2, axes, body->law, k_t);
    turned_diagonal(2, axes, body->law + 6, c_t);
    const real phi = locked ? 0 : turn - held.angle;
    const real c_phi = (locked ? 0 : rate - held.spin[0]) - step->map.c * phi;
    const real k_r = locked ? RIGID_STIFFNESS : body->law[11], c_r = locked ? 0 : body->law[15];
    const real rest = locked ? 0 : body->turn[0] + body->law[12];
    const real *zero = classical_nothing;
#define CALL(pairing, ...)                                                                         \
    mstmm_discrete_spring_planar_##pairing##_transfer(.k_t = k_t, .c_t = c_t, .k_1 = &k_r,         \
                                                      .k_3 = zero, .c_r = &c_r, .C = &step->map.c, \
                                                      .D_phi = &c_phi, .phi_0 = &rest,             \
                                                      .phi_s = &phi, .theta_s = &held.angle,       \
                                                      .d_s = d, .q_s = force,                      \
                                                      .U_h = matrix __VA_ARGS__)
    switch (which_pairing(modes_of(step, body->parent), outer)) {
    case 0: return CALL(rigid_rigid, );
    case 1: return CALL(rigid_beam, , .W = modal, .Theta_O = body->held);
    case 2: return CALL(beam_rigid, , .Theta_I = body->slopes);
    default: return CALL(beam_beam, , .W = modal, .Theta_O = body->held, .Theta_I = body->slopes);
    }
#undef CALL
}

/* out = axes^T b, 3 x columns */
static void project_on_axes(const real *axes, int columns, const real *b, real *out)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < columns; j++) {
            real sum = 0;
            for (int k = 0; k < 3; k++) sum += axes[3 * k + i] * b[columns * k + j];
            out[columns * i + j] = sum;
        }
}

/* Coordinates and speeds of the hinge as its law has them: position in inboard axes, quaternion;
 * velocity and spin in outboard axes.  Also the elongation in inertial axes. */
static void relative_motion(const step_record *step, int index, const section *held,
                            const real *axes, real *elongation, real *q, real *u)
{
    const motion *at = &step->run->motions[index];
    real moved[3], spin[3], rotation[9];
    classical_outboard_spin(step, index, spin);
    for (int i = 0; i < 3; i++) {
        elongation[i] = at->position[i] - held->position[i];
        spin[i] -= held->spin[i];
    }
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        moved[i] = at->speed[i] - held->speed[i] -
                   (held->spin[j] * elongation[k] - held->spin[k] * elongation[j]);
    }
    project_on_axes(held->axes, 1, elongation, q);
    project_on_axes(held->axes, 3, axes, rotation);
    classical_quaternion(rotation, q + 3);
    project_on_axes(axes, 1, moved, u);
    project_on_axes(axes, 1, spin, u + 3);
}

/* Force and moment of springs and dampers on the outboard section, inertial axes, by the very law
 * of the scene's hinge; the elongation. */
static void spring_load(const step_record *step, int index, const section *held, const real *axes,
                        real *load, real *elongation)
{
    const body_record *body = &step->run->bodies[index];
    motion *at = &step->run->motions[index];
    real q[7], u[6], tau[6], energy, power, twist;
    relative_motion(step, index, held, axes, elongation, q, u);
    mstmm_sweep_laws_six(body->law, q, u, body->law_axes, classical_nothing, &at->twist, tau,
                         &energy, &power, &twist);
    at->twist = twist;
    classical_multiply(3, 3, 1, axes, tau, load);
    classical_multiply(3, 3, 1, axes, tau + 3, load + 3);
}

/* Stiffness and damping about x, y and z up to the free turn, which has a matrix of its own: what
 * turns freely is rigid here.  Returns whether any of them turns. */
static int turning_springs(const body_record *body, real rate, real *stiffness, real *damping)
{
    const int pin = body->hinge == MSTMM_CLASSICAL_ELASTIC_PIN;
    const int ball = body->hinge == MSTMM_CLASSICAL_ELASTIC_BALL;
    for (int k = 0; k < 3; k++) {
        stiffness[k] = ball ? RIGID_STIFFNESS : body->law[9 + k];
        damping[k] = ball ? 0 : body->law[13 + k];
    }
    if (pin)
        stiffness[2] =
            RIGID_BESIDE * fmax(stiffness[0] + rate * damping[0], stiffness[1] + rate * damping[1]);
    return !ball;
}

static int spatial_springs(const step_record *step, int index, int outer, const real *modal,
                           real *matrix)
{
    const body_record *body = &step->run->bodies[index];
    const slopes at = classical_slopes(step, index);
    const section held = classical_section(step, index);
    real axes[9], load[6], d[3], k_t[9], c_t[9], k_r[9], c_r[9], stiffness[3], damping[3];
    classical_outboard_axes(step, index, axes);
    spring_load(step, index, &held, axes, load, d);
    turned_diagonal(3, held.axes, body->law, k_t);
    turned_diagonal(3, held.axes, body->law + 6, c_t);
    const int turns = turning_springs(body, step->map.c, stiffness, damping);
    turned_diagonal(3, held.axes, stiffness, k_r);
    turned_diagonal(3, axes, damping, c_r);
    const real *moment = turns ? load + 3 : classical_nothing;
#define CALL(pairing, ...)                                                                         \
    mstmm_discrete_elastic_spatial_##pairing##_transfer(.k_t = k_t, .c_t = c_t, .k_r = k_r,        \
                                                        .c_r = c_r, .C = &step->map.c, .d_s = d,   \
                                                        .q_s = load, .m_s = moment,                \
                                                        .U_h = matrix __VA_ARGS__)
    switch (which_pairing(modes_of(step, body->parent), outer)) {
    case 0: return CALL(rigid_rigid, );
    case 1: return CALL(rigid_beam, , OUTBOARD);
    case 2: return CALL(beam_rigid, , INBOARD);
    default: return CALL(beam_beam, , INBOARD, OUTBOARD);
    }
#undef CALL
}

int classical_springs(const step_record *step, int index, int outer, const real *modal,
                      real *matrix)
{
    return step->run->planar ? planar_springs(step, index, outer, modal, matrix)
                             : spatial_springs(step, index, outer, modal, matrix);
}
