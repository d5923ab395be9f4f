/* Declarations shared by the files of the hinges. */
#ifndef MSTMM_CLASSICAL_HINGES_H
#define MSTMM_CLASSICAL_HINGES_H

#include "parts.h"

/* Section rotations per mode beside a hinge in space, inertial axes, and the modal numbers. */
typedef struct {
    real inboard[6], outboard[6];
    const real *eta_inboard, *eta_outboard;
} slopes;

/* Ports of the kernels that the modes beside a hinge in space bring, for `slopes at`. */
#define INBOARD .S_I = at.inboard, .eta_pI = at.eta_inboard
#define OUTBOARD .W = modal, .S_O = at.outboard, .eta_pO = at.eta_outboard

extern const real classical_nothing[36];

static inline int which_pairing(int inner, int outer) { return 2 * (inner > 0) + (outer > 0); }

/* hinge_sections.c */
slopes classical_slopes(const step_record *step, int body);
void classical_outboard_axes(const step_record *step, int body, real *axes);
void classical_outboard_spin(const step_record *step, int body, real *spin);
void classical_axis(const real *axes, real *axis);
void classical_pin_axis(const step_record *step, int index, real *axis);
/* free_rotation_conditions.c */
void classical_own_condition(const step_record *step, int body, int outboard, int middle,
                             real *rows);
/* rigid_hinges.c */
int classical_fixed(const step_record *step, int body, const real *modal, real *matrix);
int classical_turning(const step_record *step, int body, int inner, const real *rows,
                      const real *modal, real *matrix);
/* spring.c */
int classical_springs(const step_record *step, int body, int outer, const real *modal,
                      real *matrix);

#endif
