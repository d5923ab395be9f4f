/* Bodies at the predictor: sections at their hinges, matrices from their input end. */
#include <math.h>
#include <string.h>

#include "parts.h"

#define ANGLE 3 /* first number of a turn in space, and of the modes in the plane */
#define MODES 6

static void turn_vector(const real *axes, const real *vector, real *out)
{
    classical_multiply(3, 3, 1, axes, vector, out);
}

static void add_cross(const real *a, const real *b, real *out)
{
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        out[i] += a[j] * b[k] - a[k] * b[j];
    }
}

/* Sum of rows of shapes times modal numbers. */
static void add_modes(int rows, int modes, const real *shapes, const real *numbers, real *out)
{
    for (int i = 0; i < rows; i++)
        for (int k = 0; k < modes; k++) out[i] += shapes[modes * i + k] * numbers[k];
}

static section planar_section(const body_record *body, int modes, const motion *at)
{
    section found = {.angle = at->position[2]};
    const real cosine = cos(found.angle), sine = sin(found.angle), rate = at->speed[2];
    real lever[2] = {body->place[0], body->place[1]}, moved[2] = {0}, spin = rate;
    add_modes(2, modes, body->shapes, at->position + ANGLE, lever);
    add_modes(2, modes, body->shapes, at->speed + ANGLE, moved);
    add_modes(1, modes, body->slopes, at->position + ANGLE, &found.angle);
    add_modes(1, modes, body->slopes, at->speed + ANGLE, &spin);
    moved[0] -= rate * lever[1];
    moved[1] += rate * lever[0];
    const real axes[4] = {cosine, -sine, sine, cosine};
    for (int i = 0; i < 2; i++) {
        found.position[i] = at->position[i] + axes[2 * i] * lever[0] + axes[2 * i + 1] * lever[1];
        found.speed[i] = at->speed[i] + axes[2 * i] * moved[0] + axes[2 * i + 1] * moved[1];
    }
    found.spin[0] = spin;
    return found;
}

static section spatial_section(const body_record *body, int modes, const motion *at)
{
    section found = {0};
    const real *spin = at->speed + ANGLE;
    real lever[3], moved[3] = {0}, turn[3] = {0}, rate[3] = {0}, own[9], both[9], relative[3];
    memcpy(lever, body->place, sizeof lever);
    add_modes(3, modes, body->shapes, at->position + MODES, lever);
    add_modes(3, modes, body->shapes, at->speed + MODES, moved);
    add_modes(3, modes, body->slopes, at->position + MODES, turn);
    add_modes(3, modes, body->slopes, at->speed + MODES, rate);
    classical_tangent(turn, own);
    turn_vector(own, rate, relative);
    for (int i = 0; i < 3; i++) relative[i] += spin[i];
    add_cross(spin, lever, moved);
    classical_exponential(turn, own);
    classical_multiply(3, 3, 3, own, body->turn, both);
    classical_multiply(3, 3, 3, at->axes, both, found.axes);
    turn_vector(at->axes, lever, found.position);
    turn_vector(at->axes, moved, found.speed);
    turn_vector(at->axes, relative, found.spin);
    for (int i = 0; i < 3; i++) {
        found.position[i] += at->position[i];
        found.speed[i] += at->speed[i];
    }
    return found;
}

section classical_section(const step_record *step, int index)
{
    const body_record *body = &step->run->bodies[index];
    const int planar = step->run->planar, parent = body->parent;
    if (parent >= 0) {
        const motion *at = &step->run->motions[parent];
        return planar ? planar_section(body, modes_of(step, parent), at)
                      : spatial_section(body, modes_of(step, parent), at);
    }
    section ground = {0};
    memcpy(ground.position, body->place, sizeof ground.position);
    memcpy(ground.axes, body->turn, sizeof ground.axes);
    return ground;
}

/* Integration formula of one coordinate: accelerations a y + b and speeds c y + d. */
static void map_coordinates(const time_map *map, int count, const real *position, const real *speed,
                            const real *rate, real *b, real *d)
{
    for (int i = 0; i < count; i++) {
        b[i] = rate[i] - map->a * position[i];
        d[i] = speed[i] - map->c * position[i];
    }
}

static const real NOTHING[9] = {0};

static int planar_body(const step_record *step, int index, int outlet, real *matrix, real *modal)
{
    const body_record *body = &step->run->bodies[index];
    const motion *at = &step->run->motions[index];
    const body_record *end = outlet < 0 ? NULL : &step->run->bodies[outlet];
    const real *force = end ? step->run->motions[outlet].inboard + 1 : NOTHING;
    const real *place = end ? end->place : NOTHING;
    real b[MSTMM_CLASSICAL_COORDINATES], d[MSTMM_CLASSICAL_COORDINATES];
    map_coordinates(&step->map, ANGLE + body->modes, at->position, at->speed, at->rate, b, d);
    if (!body->modes)
        return mstmm_discrete_body_planar_transfer(.m = &body->mass, .S_0 = body->first,
                                                   .I_0 = body->inertia, .r_e = place,
                                                   .A = &step->map.a, .C = &step->map.c, .B_r = b,
                                                   .B_theta = b + 2, .D_theta = d + 2,
                                                   .r_p = at->position, .theta_p = at->position + 2,
                                                   .q_p = force, .g = step->run->gravity,
                                                   .f_r = NOTHING, .f_m = NOTHING, .U = matrix);
    return mstmm_discrete_beam_planar_transfer(
            .m = &body->mass, .S_0 = body->first, .I_0 = body->inertia, .s = body->shift,
            .S_c = body->moment, .M_f = body->modal_mass, .K_f = body->stiffness,
            .D_f = body->damping, .L = place, .phi_O = end ? end->shapes + body->modes : NOTHING,
            .Theta_O = end ? end->slopes : NOTHING, .Theta_I = body->held, .A = &step->map.a,
            .C = &step->map.c, .B_r = b, .B_theta = b + 2, .D_theta = d + 2, .B_eta = b + ANGLE,
            .D_eta = d + ANGLE, .r_p = at->position, .theta_p = at->position + 2,
            .eta_p = at->position + ANGLE, .q_p = force, .g = step->run->gravity, .f_r = NOTHING,
            .f_m = NOTHING, .f_eta = NOTHING, .U = matrix, .W = modal);
}

/* Rate of a section's rotation per mode, frame axes: T(Psi) Theta with Psi = Theta eta. */
static void rates_of(const real *slopes, int modes, const real *eta, real *rates)
{
    real turn[3] = {0}, tangent[9];
    add_modes(3, modes, slopes, eta, turn);
    classical_tangent(turn, tangent);
    classical_multiply(3, 3, modes, tangent, slopes, rates);
}

static int spatial_beam(const step_record *step, int index, int outlet, const real *turning,
                        real *matrix, real *modal)
{
    const body_record *body = &step->run->bodies[index];
    const motion *at = &step->run->motions[index];
    const body_record *end = outlet < 0 ? NULL : &step->run->bodies[outlet];
    const real *load = end ? step->run->motions[outlet].inboard : NOTHING;
    real b[2], d[2], b_r[3], d_r[3], at_end[6], at_start[6];
    map_coordinates(&step->map, 3, at->position, at->speed, at->rate, b_r, d_r);
    map_coordinates(&step->map, 2, at->position + MODES, at->speed + MODES, at->rate + MODES, b, d);
    rates_of(end ? end->slopes : NOTHING, 2, at->position + MODES, at_end);
    rates_of(body->held, 2, at->position + MODES, at_start);
    return mstmm_discrete_beam_spatial_transfer(
            .m = &body->mass, .S_0 = body->first, .J_0 = body->inertia, .s = body->shift,
            .e = body->moment, .M_phi = body->modal_mass, .K_f = body->stiffness,
            .D_f = body->damping, .r_e = end ? end->place : NOTHING,
            .Phi_O = end ? end->shapes : NOTHING, .Theta_O = at_end, .Theta_I = at_start,
            .A = &step->map.a, .C = &step->map.c, .B_r = b_r, .B_w = at->rate + ANGLE,
            .D_w = at->speed + ANGLE, .T = turning, .B_eta = b, .D_eta = d, .r_p = at->position,
            .R_p = at->axes, .eta_p = at->position + MODES, .q_p = load + 3, .m_p = load,
            .m_pI = at->outboard, .K_g = NOTHING, .g = step->run->gravity, .f_r = NOTHING,
            .f_m = NOTHING, .f_eta = NOTHING, .U = matrix, .W = modal);
}

static int spatial_body(const step_record *step, int index, int outlet, const real *turning,
                        real *matrix)
{
    const body_record *body = &step->run->bodies[index];
    const motion *at = &step->run->motions[index];
    const body_record *end = outlet < 0 ? NULL : &step->run->bodies[outlet];
    real b[3], d[3];
    map_coordinates(&step->map, 3, at->position, at->speed, at->rate, b, d);
    return mstmm_discrete_body_spatial_transfer(.m = &body->mass, .S_0 = body->first,
                                                .J_0 = body->inertia,
                                                .r_e = end ? end->place : NOTHING,
                                                .A = &step->map.a, .C = &step->map.c, .B_r = b,
                                                .B_w = at->rate + ANGLE, .D_w = at->speed + ANGLE,
                                                .T = turning, .r_p = at->position, .R_p = at->axes,
                                                .q_p = end ? step->run->motions[outlet].inboard + 3
                                                           : NOTHING,
                                                .g = step->run->gravity, .f_r = NOTHING,
                                                .f_m = NOTHING, .U = matrix);
}

/* Matrix of a body from its input end to the hinge of the body `outlet` (-1: a free end at the
 * input), as if that were its only load, and its modal rows. */
int classical_body(const step_record *step, int index, int outlet, real *matrix, real *modal)
{
    const real *turning = step->elements[index].turning;
    if (step->run->planar) return planar_body(step, index, outlet, matrix, modal);
    if (step->run->bodies[index].modes)
        return spatial_beam(step, index, outlet, turning, matrix, modal);
    return spatial_body(step, index, outlet, turning, matrix);
}
