/* Interface of a scene to the integrator, and observation of given states. */
#ifndef MSTMM_SCENE_H
#define MSTMM_SCENE_H

#include "fused.h"
#include "integrate.h"
#include "sweep.h"
#include "tangent.h"

/* cdef begin */
/* A point of a body with axes whose motion is observed. */
typedef struct {
    int body; /* -1: ground */
    real axes[9], offset[3];
} mstmm_probe;

/* Numbers per probe: position, velocity, acceleration, angular velocity, angular acceleration
 * (inertial axes), rotation matrix (probe axes to inertial axes). */
#define MSTMM_PROBE_NUMBERS 24
/* Sums: kinetic, gravity and spring energy, power, momentum (3), angular momentum (3). */
#define MSTMM_SUM_NUMBERS 10

typedef struct {
    int n_probes;
    const mstmm_probe *probes;
    real *points;  /* n_probes x MSTMM_PROBE_NUMBERS, or NULL */
    real *loads; /* n_bodies x 6: force and moment of each inboard hinge, inertial axes, or NULL */
    real *efforts; /* nu: H^T f + J udot, what laws and drives put in, or NULL */
    real *udot; /* nu, or NULL */
    real *sums; /* MSTMM_SUM_NUMBERS, or NULL */
    real *rows; /* n_rows: multipliers of closed loops, or NULL */
} mstmm_observation;

/* All requested quantities at one state; returns 0 or a reason, with `failure` filled. */
int mstmm_observe(const mstmm_model *model, real *workspace, real t, const real *q, const real *u,
                  const real *memory, const mstmm_observation *wanted, mstmm_failure *failure);
/* The same for n states; arrays of `wanted` hold n blocks one after the other. */
int mstmm_observe_many(const mstmm_model *model, real *workspace, int64_t n, const real *t,
                       const real *q, const real *u, const real *memory,
                       const mstmm_observation *wanted, mstmm_failure *failure, int64_t *failed_at);
/* Kinetic energy (n x n_bodies) of every body, with the rotors of its inboard hinge, at one q and n
 * speeds; `still` are nu zeros, `efforts` nu numbers of room. */
int mstmm_kinetic_energies(const mstmm_model *model, real *workspace, int64_t n, const real *q,
                           const real *u, const real *memory, const real *still, real *efforts,
                           real *energies, mstmm_failure *failure);
/* Accelerations of n states one after the other. */
int mstmm_accelerations_many(const mstmm_model *model, real *workspace, int64_t n, const real *t,
                             const real *q, const real *u, const real *memory, const real *efforts,
                             real *qdot, real *udot, mstmm_failure *failure, int64_t *failed_at);

typedef struct {
    int action; /* MSTMM_FIRE_STOP, or MSTMM_FIRE_RESTART with `release` */
    int release; /* index in memory; of a bounce that of the fastest one */
    /* A bounce: slopes of the event's value by time, then by coordinates and places of probes */
    const mstmm_tape *slopes; /* t, q, u, probes, inputs -> slopes; NULL: no bounce */
    int n_slopes;
    const int *places; /* two a slope: coordinate and speed, or -1 - 3 probe - component and 0 */
    real restitution;
    real *numbers; /* 1 + n_slopes + 4 nu: scratch */
} mstmm_event_action;

/* How the value of a bounce's event changes at a state: its rate, the sum of the sizes of that's
 * terms, that of its slopes by places, 1/m, 1/rad, and that of these times the places or 1 m, 1
 * rad, in parts of which the value is known. */
typedef struct {
    real rate, size, steepness, reach;
} mstmm_meeting;

/* Workspace of that code: the base point (t, q, u, a), steps, derivatives, factors, known
 * increments. */
typedef struct {
    real *t, *q, *u, *a, *steps, *slopes, *factors, *still_q, *still_u, *known_q, *known_a, *right;
    int64_t used;
} mstmm_implicit_parts;

/* Compiled code for implicit methods, and the looped engine as fallback */
typedef struct {
    const mstmm_fused *fused; /* NULL: there is none */
    real *p;
    mstmm_implicit_parts parts; /* mstmm_implicit_code_size */
    mstmm_implicit looped;
    int looped_tangent; /* the last tangent was factored there */
} mstmm_implicit_code;

struct mstmm_controller;

/* State y = [q, u] and, with `with_power`, the work of everything not stored. */
typedef struct {
    const mstmm_model *model;
    real *workspace, *memory;
    mstmm_failure failure;
    int with_power;
    int n_quaternions;
    const int *quaternions; /* first coordinate of each */
    int n_events;
    const mstmm_event_action *events;
    int n_switches; /* their margins follow the events' values */
    const mstmm_tape *event_tape; /* t, q, u, probe positions and velocities -> values */
    int n_probes;
    const mstmm_probe *probes;
    real *probe_values; /* n_probes x 6, MSTMM_PROBE_NUMBERS of scratch, and nq + nu of a state */
    /* Of the tape's inputs: components of the state that it reads, bounds of all its slots */
    int n_read; /* 0: no bounds between two evaluations */
    const int *read;
    mstmm_bounds *bounds;
    real *later; /* nq + nu: scratch; NULL where it reads no velocities of probes */
    int closes; /* events read states inside a step, whose loops are closed first */
    int n_controllers;
    const struct mstmm_controller *controllers; /* see controllers.h */
    /* Code compiled for this scene, or NULL: see mstmm_scene_compiled */
    const mstmm_fused *fused, *fused_lanes;
    real *fused_p;
    real *fused_numbers;
    mstmm_live_inputs live; /* what of p changes with time; of implicit_code.p as well */
    /* For implicit methods: where the equations are linearised, where a stage's residual is made;
     * NULL: not prepared */
    mstmm_tangent *base, *stage;
    mstmm_implicit implicit;
    real strain; /* of the loops at the last projection of speeds: see mstmm_strain */
    double attainable; /* see mstmm_system: near a singular pose */
    int rechosen; /* rows were chosen again when they were last closed */
    real *speeds; /* nu: those of a stage near a singular pose; NULL: there are no loops */
    int on_positions; /* the present step closes gaps but no velocity errors: index 3 */
    int steady; /* nothing in the scene depends on time */
    int *coordinates; /* nu: see mstmm_implicit */
    real *known; /* nq + 3 nu: scratch */
    mstmm_implicit_code implicit_code;
} mstmm_scene_run;

/* Enables implicit methods for `run`, whose last fields have been set. */
void mstmm_scene_implicit(mstmm_scene_run *run, mstmm_system *system);

/* From now on their steps may satisfy rows of positions at their end, and none of speeds. */
void mstmm_scene_on_positions(mstmm_scene_run *run);

/* Projects driven coordinates, quaternions and memory at t, as after an accepted step. */
int mstmm_scene_settle(mstmm_scene_run *run, real t, real *y);
/* The same for n states in rows of `width` numbers, each with its own memory; the run's memory is
 * what it was, the rows take the turns they end in.  Returns the code of the first that fails, the
 * others are settled all the same. */
int mstmm_scene_settle_many(mstmm_scene_run *run, int64_t n, int64_t width, const real *t,
                            real *memory, real *y);
/* Approach of event number `event`, which bounces, at y with the speeds u (nu). */
int mstmm_meeting_of(mstmm_scene_run *run, int event, real t, const real *y, const real *u,
                     mstmm_meeting *found);
/* cdef end */

/* Numbers of a probe whose body moves with its bias motion and `delta` (6). */
void mstmm_point_shown(const mstmm_state *state, const mstmm_probe *probe, const real *delta,
                       real *out);

/* Gaps of closed loops closed and slips stopped in place, by compiled code where there is some. */
int mstmm_scene_close_loops(mstmm_scene_run *run, double t, double *y);

/* Returns *u, the speeds of a state inside a step: near a singular pose projected speeds, because
 * accelerations there have the error of the velocity errors over the distance from it. */
int mstmm_stage_state(mstmm_scene_run *run, double t, const double **y, const double **u);
int mstmm_stage_speeds(mstmm_scene_run *run, double t, const double *y, const double **u);

/* Places and velocities of the probes of a state with speeds u, to `probe_values`. */
int mstmm_probes_seen(mstmm_scene_run *run, real t, const real *y, const real *u);
/* Values of a tape of t, q, u, probes and inputs at a state; returns 0 or a reason. */
int mstmm_probes_tape(mstmm_scene_run *run, const mstmm_tape *tape, real t, const real *y,
                      real *values);
/* Kinetic energy of a state with speeds u, including rotors and modes of flexible bodies. */
int mstmm_kinetic_seen(mstmm_scene_run *run, real t, const real *y, const real *u, real *energy);
/* Interface of `run` to the integrator, evaluated by the looped engine. */
void mstmm_looped_system(mstmm_scene_run *run, mstmm_system *system);

#endif
