/* Matrices of fixed and smooth hinges. */
#include <string.h>

#include "hinges.h"

/* Small rotation from one set of axes to another. */
static void small_turn(const real *from, const real *to, real *turn)
{
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        turn[i] = 0;
        for (int l = 0; l < 3; l++)
            turn[i] += (to[3 * k + l] * from[3 * j + l] - to[3 * j + l] * from[3 * k + l]) / 2;
    }
}

static int fixed_planar(const body_record *body, int inner, const real *modal, real *matrix)
{
#define CALL(pairing, ...)                                                                         \
    mstmm_discrete_fixed_planar_##pairing##_transfer(.gamma = body->turn, .U_h = matrix __VA_ARGS__)
    switch (which_pairing(inner, body->modes)) {
    case 0: return CALL(rigid_rigid, );
    case 1: return CALL(rigid_beam, , .W = modal, .Theta_O = body->held);
    case 2: return CALL(beam_rigid, , .Theta_I = body->slopes);
    default: return CALL(beam_beam, , .W = modal, .Theta_O = body->held, .Theta_I = body->slopes);
    }
#undef CALL
}

int classical_fixed(const step_record *step, int index, const real *modal, real *matrix)
{
    const body_record *body = &step->run->bodies[index];
    const int inner = modes_of(step, body->parent);
    if (step->run->planar) return fixed_planar(body, inner, modal, matrix);
    const slopes at = classical_slopes(step, index);
    const section held = classical_section(step, index);
    real axes[9], beta[3];
    classical_outboard_axes(step, index, axes);
    small_turn(axes, held.axes, beta);
#define CALL(pairing, ...)                                                                         \
    mstmm_discrete_fixed_spatial_##pairing##_transfer(.beta = beta, .U_h = matrix __VA_ARGS__)
    switch (which_pairing(inner, body->modes)) {
    case 0: return CALL(rigid_rigid, );
    case 1: return CALL(rigid_beam, , OUTBOARD);
    case 2: return CALL(beam_rigid, , INBOARD);
    default: return CALL(beam_beam, , INBOARD, OUTBOARD);
    }
#undef CALL
}

/* Planar pin, or ball: no relation of the section's turns. */
static int smooth(const step_record *step, int inner, int outer, const real *rows,
                  const real *modal, real *matrix)
{
    const real *none = classical_nothing;
#define BY_SPACE(pairing, ...)                                                                     \
    (step->run->planar                                                                             \
         ? mstmm_discrete_smooth_planar_##pairing##_transfer(.U = rows, .tau_n = none,             \
                                                             .U_h = matrix __VA_ARGS__)            \
         : mstmm_discrete_ball_spatial_##pairing##_transfer(.U = rows, .tau_n = none,              \
                                                            .U_h = matrix __VA_ARGS__))
    switch (which_pairing(inner, outer)) {
    case 0: return BY_SPACE(rigid_rigid, );
    case 1: return BY_SPACE(rigid_beam, , .W = modal);
    case 2: return BY_SPACE(beam_rigid, );
    default: return BY_SPACE(beam_beam, , .W = modal);
    }
#undef BY_SPACE
}

static int pin(const step_record *step, int index, int inner, const real *rows, const real *modal,
               real *matrix)
{
    static const real first[3] = {1, 0, 0}; /* the condition is in the row of m_x */
    const real *none = classical_nothing;
    const body_record *body = &step->run->bodies[index];
    const slopes at = classical_slopes(step, index);
    real axes[9], axis[3], own[3], beta[3];
    classical_outboard_axes(step, index, axes);
    classical_pin_axis(step, index, axis);
    classical_axis(axes, own);
    for (int i = 0; i < 3; i++) { /* rotation of the outboard axis to the inboard one */
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        beta[i] = own[j] * axis[k] - own[k] * axis[j];
    }
#define CALL(pairing, ...)                                                                         \
    mstmm_discrete_pin_spatial_##pairing##_transfer(.U = rows, .a = axis, .beta = beta,            \
                                                    .a_n = first, .m_n = none, .tau_n = none,      \
                                                    .U_h = matrix __VA_ARGS__)
    switch (which_pairing(inner, body->modes)) {
    case 0: return CALL(rigid_rigid, );
    case 1: return CALL(rigid_beam, , OUTBOARD, .S_N = none);
    case 2: return CALL(beam_rigid, , INBOARD);
    default: return CALL(beam_beam, , INBOARD, OUTBOARD, .S_N = none);
    }
#undef CALL
}

int classical_turning(const step_record *step, int index, int inner, const real *rows,
                      const real *modal, real *matrix)
{
    const int length = length_of(step, index), count = classical_free_turns(step, index);
    real carried[WIDEST * WIDEST] = {0};
    memcpy(carried + length * step->rigid, rows, (size_t)count * length * sizeof(real));
    if (count < step->turns) return pin(step, index, inner, carried, modal, matrix);
    return smooth(step, inner, step->run->bodies[index].modes, carried, modal, matrix);
}
