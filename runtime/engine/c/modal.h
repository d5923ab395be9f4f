/* Flexible bodies in the sweep: sections passed, modes condensed and recovered. */
#ifndef MSTMM_MODAL_H
#define MSTMM_MODAL_H

#include "sweep.h"

/* Is there anything to do for this body in this sweep? */
static inline int mstmm_idle(const mstmm_state *state, const mstmm_body *body)
{
    return body->idle && !state->observed;
}

/* Relative motion across a section: R, d, v, w, c of the block, and its subspace. */
int mstmm_section_motion(mstmm_state *state, int body);
/* S, e and the modal rows of a flexible body at its bias motion. */
int mstmm_modal_forward(mstmm_state *state, int body, real *qdot);
/* Modes eliminated from S and e of the body, before its hinge is passed. */
int mstmm_modal_condense(mstmm_state *state, int body);
/* S and e of an end, seen by the modes of the body that it belongs to. */
void mstmm_section_absorb(mstmm_state *state, int body);
/* Modal accelerations behind a recovered body, and the modes' part of its deviation. */
void mstmm_modal_recover(mstmm_state *state, int body, real *udot);
/* The modes' part of the deviation of an end. */
void mstmm_section_follow(mstmm_state *state, int body);
/* Efforts that an end, and the body itself, ask of the modes (inverse dynamics). */
void mstmm_section_effort(mstmm_state *state, int body);
void mstmm_modal_effort(mstmm_state *state, int body, real *efforts);
/* Drag, behind a pose pass. */
void mstmm_modal_drag(mstmm_state *state, mstmm_balance *balance);
/* Strain energy and damping of all flexible bodies. */
void mstmm_modal_balance(const mstmm_state *state, mstmm_balance *balance);
/* Mass matrix of the frame (21), momentum about its origin (6) and kinetic energy of a body. */
void mstmm_modal_momentum(const mstmm_state *state, int body, real *inertia, real *momentum,
                          real *energy);

#endif
