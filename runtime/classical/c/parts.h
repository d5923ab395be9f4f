/* Declarations shared by the files of the classical discrete-time method. */
#ifndef MSTMM_CLASSICAL_PARTS_H
#define MSTMM_CLASSICAL_PARTS_H

#include <stddef.h>

#include "classical.h"
#include "kernel_calls.h"

#define WIDEST 15 /* numbers of the longest state: in space with two modes */
#define LOADS 6
#define TURNS 3

typedef mstmm_classical_body body_record;
typedef mstmm_classical_motion motion;
typedef mstmm_classical_run run_record;

/* Body with its inboard hinge in one linear solution.  States are [r; angle; m; q; eta;
 * 1]; those at the hinge's input have the modes of the parent, those behind it the body's own. */
typedef struct {
    real hinge[WIDEST * WIDEST];    /* across the hinge */
    real outlet[WIDEST * WIDEST];   /* of the parent, from its input to this hinge */
    real chain[WIDEST * WIDEST];    /* product from the hinge's input to the tip of its chain */
    real relation[LOADS * WIDEST];  /* loads at the hinge's input by [r; angle; eta; 1] */
    real condition[TURNS * WIDEST]; /* rows on the state at the hinge's input that vanish */
    real modal[MSTMM_CLASSICAL_MODES * WIDEST]; /* modal rows of the body */
    real state[WIDEST];                         /* behind the hinge */
    real turning[9]; /* rotation vector of the step by small turns in the frame */
    int conditions;  /* rows in `condition` */
    int tip;         /* last body of its chain */
    motion start;    /* at the start of the step */
} element;

typedef struct {
    real a, c, e; /* accelerations, speeds, auxiliary accelerations by coordinates */
} time_map;

typedef struct {
    run_record *run;
    element *elements;
    time_map map;
    int shifts, turns, rigid; /* 2 1 3 in the plane, 3 3 6 in space */
} step_record;

/* Section of the parent, or ground, at the hinge of a body, at the predictor. */
typedef struct {
    real position[3], speed[3], spin[3]; /* inertial; in the plane the angle's rate is spin[0] */
    real axes[9];                        /* hinge axes, in space */
    real angle;                          /* in the plane */
} section;

static inline int modes_of(const step_record *step, int body)
{
    return body < 0 ? 0 : step->run->bodies[body].modes;
}

static inline int length_of(const step_record *step, int body)
{
    return 2 * step->rigid + modes_of(step, body) + 1;
}

/* Columns of a relation: positions, modes, 1. */
static inline int columns_of(const step_record *step, int body)
{
    return step->rigid + modes_of(step, body) + 1;
}

static inline int fail(run_record *run, int reason, int body)
{
    run->failure = reason;
    run->element = body;
    return 1;
}

/* matrix.c */
void classical_multiply(int n, int k, int m, const real *a, const real *b, real *out);
int classical_solve(int n, int m, real *a, real *b);
/* rotation.c */
void classical_exponential(const real *vector, real *rotation);
void classical_inverse_tangent(const real *vector, real *matrix);
void classical_tangent(const real *vector, real *matrix);
void classical_quaternion(const real *rotation, real *quaternion);
/* body.c */
section classical_section(const step_record *step, int body);
int classical_body(const step_record *step, int body, int outlet, real *matrix, real *modal);
/* free_rotation_conditions.c */
int classical_free_turns(const step_record *step, int body);
/* hinge_matrices.c */
int classical_condition(const step_record *step, int body, int outboard, real *rows);
int classical_hinge(const step_record *step, int body, const real *rows, const real *modal,
                    real *matrix);
/* body_relation.c */
int classical_outlets(const step_record *step, int body);
int classical_alone(const step_record *step, int body, real *matrix, real *relation);
int classical_carried(const step_record *step, int body, int child, real *relation);
int classical_absorbed(const step_record *step, int body, real *relation);
void classical_let_go(const step_record *step, int body, const real *x);
void classical_states(const step_record *step, int body, const real *relation, real *states);
void classical_widened(const step_record *step, int body, int count, const real *narrow,
                       real *rows);
/* riccati.c, product.c */
int classical_riccati(const step_record *step);
int classical_product(const step_record *step);
/* forward_pass.c */
int classical_outward(const step_record *step);

#endif
