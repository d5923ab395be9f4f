/* Discrete-time transfer matrix method in absolute coordinates: successive linearised
 * steps.  Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, Wiley 2019, ch. 7 and 8.
 *
 * Element matrices are generated; these files multiply them along chains and branches, or eliminate
 * them by the Riccati method, and move the bodies.  Positions and loads are in inertial
 * axes, angular velocities in those of the body's frame, whose origin is its input end.  In the
 * plane vectors have two numbers and rotations one.
 *
 * cffi reads the declarations between the two marks below. */
#ifndef MSTMM_CLASSICAL_H
#define MSTMM_CLASSICAL_H

#include <stdint.h>

/* cdef begin */
#define MSTMM_CLASSICAL_MODES 3       /* most modes of a beam: 3 in the plane, 2 in space */
#define MSTMM_CLASSICAL_COORDINATES 8 /* most coordinates of a body */

enum {
    MSTMM_CLASSICAL_FREE, /* at the ground only: the body is free */
    MSTMM_CLASSICAL_FIXED,
    MSTMM_CLASSICAL_PIN,
    MSTMM_CLASSICAL_BALL,
    MSTMM_CLASSICAL_ELASTIC,      /* springs and dampers in all directions */
    MSTMM_CLASSICAL_ELASTIC_PIN,  /* the same, but free to turn about z */
    MSTMM_CLASSICAL_ELASTIC_BALL, /* the same, but free to turn */
};

enum {
    MSTMM_CLASSICAL_SINGULAR = 1, /* element: its motion is undetermined */
    MSTMM_CLASSICAL_LOST,         /* element: tip at which the product's state is not free */
    MSTMM_CLASSICAL_OPEN,         /* element: its hinge has a position gap */
    MSTMM_CLASSICAL_UNSETTLED,    /* the iterations do not converge */
    MSTMM_CLASSICAL_FAR,          /* element: body moved by more than the size of the scene */
    MSTMM_CLASSICAL_NOT_FINITE,   /* element: body whose motion or load is not finite */
};

typedef struct {
    int parent;      /* -1: the ground; a parent precedes its children */
    int child, next; /* first child, next child of the same parent; -1: none */
    int hinge;       /* inboard hinge */
    int modes;       /* 0: rigid */
    double mass, first[3], inertia[6]; /* about the frame's origin: xx xy xz yy yz zz, or one */
    /* Of the hinge on the parent at rest, in its frame; in the plane `turn` holds the angles of
     * this body's frame and of the hinge's axes */
    double place[3], turn[9];
    double end[9]; /* axes of the hinge on this body at rest, in its frame */
    double law[16], law_axes[9]; /* of an elastic hinge, as the kernel of its law has them */
    /* Of a flexible parent at the hinge, and of this body at its own input end: */
    double shapes[9], slopes[9], held[9];
    /* Modal numbers: int rho phi, int rho x phi, symmetric matrices row by row */
    double shift[3], moment[3], modal_mass[6], stiffness[6], damping[6];
} mstmm_classical_body;

typedef struct {
    double position[MSTMM_CLASSICAL_COORDINATES]; /* input end, angle, modes; no angle in space */
    double speed[MSTMM_CLASSICAL_COORDINATES];
    double rate[MSTMM_CLASSICAL_COORDINATES]; /* accelerations */
    double auxiliary[MSTMM_CLASSICAL_COORDINATES]; /* auxiliary accelerations of the scheme */
    double axes[9]; /* frame to inertial, in space */
    double inboard[6], outboard[6]; /* moment and force of the hinge on its two sides */
    double twist; /* of the law's memory */
} mstmm_classical_motion;

/* (1 - alpha_m) a' + alpha_m a = (1 - alpha_f) ydd' + alpha_f ydd over the step theta h, Newmark's
 * beta and gamma for a; theta above 1 is Wilson's method */
typedef struct {
    double alpha_m, alpha_f, beta, gamma, theta;
} mstmm_classical_scheme;

typedef struct {
    int n_bodies;
    const mstmm_classical_body *bodies;
    int planar, product; /* product of matrices; else Riccati on them */
    int iterations; /* most linear solutions a step */
    int turning; /* 0 omits the tangent operator of rotations, to show its effect */
    double gravity[3];
    mstmm_classical_scheme scheme;
    double size; /* length that corrections and gaps are compared with, m */
    double tolerance; /* iterations end if no correction exceeds this fraction of size, or rad */
    double gap; /* largest permitted gap of a hinge, relative to size, or rad */
    double accuracy; /* part of the largest load that the product may leave at a free tip */
    double step; /* the last one, 0 before the first */
    mstmm_classical_motion *motions; /* now */
    char *work; /* mstmm_classical_work_size bytes */
    int64_t solutions; /* linear solutions so far */
    int failure, element;
} mstmm_classical_run;

size_t mstmm_classical_work_size(int n_bodies);
/* `count` steps of `step` s.  samples: count times n_bodies motions.  Returns how many were made;
 * fewer where one failed: failure and element say how. */
int64_t mstmm_classical_advance(mstmm_classical_run *run, int64_t count, double step,
                                mstmm_classical_motion *samples);
/* cdef end */

#endif
