/* Looped engine: calls of element kernels for all bodies of a scene, tips to root and back.  It
 * orders calls and passes arrays on; every equation is in the generated kernels that it calls. */
#ifndef MSTMM_SWEEP_H
#define MSTMM_SWEEP_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "failures.h"
#include "inputs.h"
#include "layout.h"
#include "mstmm.h"
#include "tape.h"

/* cdef begin */
/* Moments of the fields of a flexible body under one density, by their names in
 * derive/flexible/modal_residual.py. */
typedef struct {
    const real *p, *C, *P, *B, *Z_xx, *Z_xy, *Z_xz, *Z_yy, *Z_yz, *Z_zz;
    const real *Y_x, *Y_y, *Y_z, *G_x, *G_y, *G_z, *M;
} mstmm_moments;

/* A flexible body: internal coordinates of the body that is its floating frame. */
typedef struct {
    int n, q, u; /* modes, their places in the state */
    mstmm_moments moments;
    const mstmm_moments *drag; /* NULL: none */
    const real *stiffness, *damping;
    int64_t place; /* of its numbers in the workspace, see mstmm_modal_numbers */
    int64_t tangent; /* of its numbers in those of the tangent */
} mstmm_modal;

/* A section of a flexible body, and the direction in which it is passed.  A segment of an exact
 * beam, which leads from one station to the next, has `b` and `Bm` in place of fields. */
typedef struct mstmm_section {
    mstmm_modal *modal;
    int inward; /* 1: from the inboard section to the floating frame; 0: outboard, to an end */
    const real *r, *phi, *theta, *end;
    const real *g_x, *g_y, *g_z, *h_x, *h_y, *h_z; /* of second order */
    const real *b, *Bm; /* see derive/flexible/segment.py; NULL: no segment */
    const struct mstmm_section *previous; /* of the previous station; NULL: first segment */
    int64_t place; /* of its numbers in the workspace, see mstmm_section_numbers */
    int64_t tangent; /* of its numbers in those of the tangent */
} mstmm_section;

/* Kernels of a body and its inboard hinge, shared by all of one kind.  A sweep of many bodies is
 * limited by memory access: data of single bodies are kept small. */
typedef struct {
    void (*hinge)(void), (*forward)(void), (*condense)(void), (*recover)(void);
    void (*inertia)(void), (*bias_load)(void), (*energy)(void);
    void (*rates_by_coordinates)(void), (*rates_by_speeds)(void);
    void (*body_motion)(void), (*directions)(void); /* NULL: step by step */
    void (*hinge_slope)(void), (*bias_load_slope)(void), (*load_by_motion)(void);
    /* NULL: no such connection */
    void (*link_turn)(void), (*link_forward)(void), (*link_condense)(void), (*link_recover)(void);
    int link_numbers, link_angles; /* so many of the connection; it rotates about z only */
    const mstmm_tape *tape;       /* hinge kernel without a compiler, else NULL */
    const mstmm_tape *slope_tape; /* and its derivative */
    int rigid;                    /* the body is the built-in rigid one */
} mstmm_kernels;

/* One body with its inboard hinge, in depth-first order. */
typedef struct {
    int parent;       /* index of the parent body, -1 for the ground */
    int q, u, nq, nu; /* place and number of coordinates and speeds in the state */
    int block;        /* first number of its block in the workspace */
    int release;      /* index in memory that is non-zero once they are free; -1: never */
    int carried;      /* of S in the numbers of a tangent that stores none: others reuse it */
    signed char n_imposed; /* speeds driven or held until release */
    signed char generic;   /* swept by the hinge kernel and the generic steps */
    signed char straight;  /* the rates of the coordinates are the speeds */
    signed char steady;    /* H is the same in every position */
    signed char turning;   /* and has rotations only */
    signed char placed; /* loads on it or outboard of it change only with its position */
    signed char idle; /* an end without children and loads: for observation only */
    int64_t tangent;  /* of its numbers in those of the tangent */
    int64_t place;    /* and of those by place, where it is placed */
    const mstmm_kernels *kernels;
    const real *connection; /* Rt (9), ro (3), the frame's origin from the hinge's own P (3) */
    const real *hinge_p, *body_p;
    const real *rotor;       /* reflected inertia per speed */
    const int *imposed_mask; /* per speed: 1 if prescribed */
    mstmm_modal *modal;      /* the body is the floating frame of a flexible one; else NULL */
    mstmm_section *section;  /* its connection is a section of a flexible body; else NULL */
    /* b (11), p, link of the kernels sweep link_*; NULL: no such connection */
    const real *link;
} mstmm_body;

/* Successive bodies, each a child of the previous one.  With `numbers` they are swept by the
 * kernels of one type of link, and all except the last have one child, so that S and e are passed
 * on directly. */
typedef struct {
    int first, count, parent; /* parent of the first, -1: the ground */
    int open;                 /* the last has other children; S and e pass through its block */
    int q, u, nq, nu;         /* of the first; the others follow without gaps */
    int64_t place, parent_place; /* of its links in the workspace; of the parent's link, or -1 */
    const real *const *numbers; /* `link` of every body */
    void (*turn)(void), (*forward)(void), (*condense)(void), (*recover)(void);
    int angles; /* they rotate about z */
    int joined; /* the first is the only child of the last link of the run before */
} mstmm_branch;

/* Law on coordinates of one hinge: `evaluate` is a kernel of sweep_laws. */
typedef struct {
    int body;
    int kind;              /* 0: one coordinate, 1: quaternion with B and twist memory */
    int coordinate, speed; /* first ones within the hinge */
    int n;                 /* speeds it acts on */
    int twist;             /* place in memory, or -1 */
    const real *p, *axes;
    const int *effort; /* per speed: place among the expression values, -1 for none */
    void (*evaluate)(void), (*evaluate_slope)(void);
} mstmm_law;

/* Force and moment at a point of a body. */
typedef struct {
    int body;
    int axes;         /* body whose axes hold the components, -1 for inertial axes */
    real axes_own[9]; /* those axes in the body's internal ones */
    real offset[3];
    int force[3], moment[3]; /* places among the expression values, -1 for zero */
    int own;          /* it changes only with the position of its body */
} mstmm_load;

/* Massless element between an end F and an end T; body -1 is the ground. */
typedef struct {
    int body_f, body_t;
    int own; /* one end is on the ground, and no expression of the state acts */
    real axes_f[9], axes_t[9], offset_f[3], offset_t[3];
    /* t, q, u, [length, its rate], inputs -> effort by expression; NULL: none */
    const mstmm_tape *effort;
    const mstmm_tape *effort_slope; /* the same and derivatives of all but inputs -> its own */
    const real *p;
    void (*wrench)(void), (*wrench_slope)(void);
} mstmm_force;

/* A coordinate that a drive prescribes: values number 3k, 3k+1, 3k+2 of the drive tape. */
typedef struct {
    int body, coordinate, speed; /* within the hinge */
} mstmm_drive;

/* A row whose column passes the inboard hinge of a body; indices after `loops`. */
typedef struct {
    int row;
    int column, onward, y; /* of its column here and on the parent, of -H^T K - C */
    int tau;               /* of -C; -1: no coupling of the speeds of this hinge */
    int modes;             /* of its column on the modes of the body that this is an end of */
    const int *pairs;      /* of the entries of L with those up to this one */
} mstmm_pending;

/* A row that is still open when another is closed. */
typedef struct {
    int row;
    int column, pair; /* of its column on the body, of its entry of L with the other */
    const int *pairs; /* of those with the ones that stay, up to this one */
} mstmm_other;

/* Rows of one closure of which only some are independent; the others are redundant.  In the order
 * in which they are closed; pairs: their entries of L after `loops`, of row i with row j < i at i
 * (i - 1) / 2 + j. */
typedef struct {
    int n, count;
    int rows[6];
    int pairs[15];
} mstmm_choice;

/* A row of a closed loop, in the order in which they are closed. */
typedef struct {
    int body; /* body at which its ends meet; -1: the ground */
    int n_others;
    const mstmm_other *others;
    real floor;    /* largest pivot that is rounding */
    real mobility; /* of its ends, if they were free: scale of its pivot */
    real softness; /* 1 / inertia of a rotor on an own speed; 0: the row is met */
    int of_speeds; /* no constraint of positions */
    int release;   /* index in memory that is non-zero once the row is released; -1: never */
    int rest;      /* index in memory that is non-zero while others replace it; -1: never */
    const mstmm_choice *choice; /* it is the first of these rows; NULL: of none */
} mstmm_loop_row;

/* Axes of the directions of a closure's rows. */
#define MSTMM_HINGE 0
#define MSTMM_DISTANCE 1
#define MSTMM_PLANE 2
#define MSTMM_ROLLING 3

/* Closure of a loop: the frame C of a hinge, a body without mass, coincides with an end of B, or a
 * constraint requires a part of that. */
typedef struct {
    int frame, outboard; /* C, B */
    int kind;
    int numbers; /* of its own */
    int rows[6]; /* of its directions, -1: none, it is redundant; -2: inactive */
    int inner[6], outer[6]; /* their columns on A and on B */
    real end[3], turn[9];   /* origin of C in B, and its axes */
    real p[5];              /* of a constraint */
} mstmm_closure;

/* A coupling of the speeds of a closing hinge: its row, and indices of its columns on both sides
 * and of -C. */
typedef struct {
    int row;
    int64_t inner, outer, tau;
} mstmm_own;

/* A row between coordinates (-1: others satisfy it), or of speeds without a constraint of
 * positions; its MSTMM_COUPLING numbers begin at `numbers`, after `loops`. */
typedef struct {
    int row, of_speeds;
    real kept; /* constant value */
    int64_t numbers;
} mstmm_coupling;

/* Data of a body for closed loops. */
typedef struct {
    int first_row, n_rows; /* that close on it */
    int n_pending;
    const mstmm_pending *pending;
    int n_own;
    const mstmm_own *own;
    int n_bent; /* that ends of the flexible body bring: y is S_ff^-1 times the modes' column */
    const mstmm_pending *bent;
    const mstmm_closure *closure; /* the body is the frame C of what closes a loop */
} mstmm_looped;

/* Data of a body of a planar scene, and for its closed loops: there only hinges close them, free
 * pins, all of them parallel.  See mstmm_looped; `given` begins with MSTMM_GIVEN_TURN. */
typedef struct {
    int parent, q, u;
    int first_row, n_rows;
    int n_pending;
    const mstmm_pending *pending;
    const real *given;
    int omitted, idle; /* no sweep to the root, or no pass at all, is needed */
} mstmm_flat_body;

/* Corrections of closed loops, instead of accelerations. */
#define MSTMM_GAP 1
#define MSTMM_SLIP 2

/* Kinds of hinge for the plain product of classical matrices, one kind for a whole chain. */
#define MSTMM_PRODUCT_PIN 0
#define MSTMM_PRODUCT_BALL 1
#define MSTMM_PRODUCT_ACCELERATION 2

/* Numbers per body: two transfer matrices, scales, its motion and its load. */
#define MSTMM_PRODUCT_PER_BODY 386

typedef struct {
    int kind;
    real accuracy; /* largest relative deviation from the Riccati sweep that is accepted */
    int64_t place; /* of its numbers in the workspace: those of bodies, nu, (rows + 1)^2 of loops */
} mstmm_product;

typedef struct {
    int n_bodies, nq, nu, n_memory;
    int n_flexible; /* bodies with modes */
    int n_imposed; /* bodies with driven or held speeds */
    const mstmm_product *product; /* accelerations by the plain product; NULL: by a sweep */
    int qr; /* the sweep is that of least squares */
    mstmm_body *bodies;
    int n_runs;
    const mstmm_branch *runs; /* all bodies in order, see mstmm_fill_runs */
    real gravity[3];
    int n_drives;
    const mstmm_drive *drives;
    const mstmm_tape *drive_tape; /* t, inputs -> value, rate, acceleration of each drive */
    int n_values;
    const mstmm_tape *value_tape; /* t, q, u, inputs -> efforts and load components */
    const mstmm_tape *drive_slopes; /* t, inputs, d_t -> derivatives of the drives' values */
    const mstmm_tape *value_slopes; /* t, q, u, inputs, d_t, d_q, d_u -> those of the values */
    int n_inputs;
    const mstmm_input *inputs; /* inputs and signals, which expressions read */
    int n_laws;
    const mstmm_law *laws;
    int n_loads;
    const mstmm_load *loads;
    int n_forces;
    mstmm_force *forces;
    const mstmm_looped *looped; /* for every body; NULL: no loop is closed */
    int n_closures;
    const mstmm_closure *closures;
    const mstmm_flat_body *flat; /* NULL: the scene is in no plane */
    int64_t flat_numbers; /* first of those of the ground, and of all bodies, in the workspace */
    real flat_gravity[2]; /* in the plane's axes, which replace inertial ones */
    int n_rows, first_ground_row; /* rows from the latter on close at the ground */
    const mstmm_loop_row *rows;
    int64_t loops; /* first number of closed loops in the workspace */
    int64_t loops_summed; /* number of sums among them */
    int64_t answer; /* and of nu numbers: a solution that is refined */
    int refines; /* number of refinements of accelerations, for heavy outboard bodies */
    int n_choices; /* closures whose rows are chosen during the run */
    int n_couplings;
    const mstmm_coupling *couplings;
    const mstmm_tape *coupling_tape; /* t, q, u -> their numbers */
    const mstmm_tape *coupling_slopes; /* the same and derivatives of all -> those of the numbers */
    int64_t coupling_numbers; /* the first behind `loops` */
    real loops_apart; /* gap (m, rad) above which a row is no longer redundant */
    real loops_strain; /* strain from which on a pose is near a singular one; 0: never */
    int loops_singular; /* a run starts in a singular pose */
    int strained; /* index in memory that is 1 while the last step ended there; -1: none */
    int needs_pose; /* loads or forces that need poses and velocities */
    int64_t workspace; /* numbers of workspace */
    int64_t scratch; /* first number behind the blocks: state copy, values, tape slots */
    int tape_slots; /* largest workspace of a tape */
} mstmm_model;

/* Reason and element of a failure.  `element` is the index of a body, or of a force for
 * MSTMM_FAILED_FORCE. */
typedef struct {
    int reason, element, code;
} mstmm_failure;

/* Sums over the scene. */
typedef struct {
    real power; /* of dampers, friction, efforts, loads and drives: everything not stored */
    real potential; /* of springs and laws */
} mstmm_balance;

/* Coordinate rates and accelerations.  `efforts` (nu) is added to the laws' efforts and may be
 * NULL; `balance` may be NULL.  Returns 0, or the reason, with `failure` filled. */
int mstmm_accelerations(const mstmm_model *model, real *workspace, real t, const real *q,
                        const real *u, const real *memory, const real *efforts, real *qdot,
                        real *udot, mstmm_balance *balance, mstmm_failure *failure);
/* Accelerations, with all numbers of the bodies kept in the workspace for observations. */
int mstmm_accelerations_kept(const mstmm_model *model, real *workspace, real t, const real *q,
                             const real *u, const real *memory, real *qdot, real *udot,
                             mstmm_balance *balance, mstmm_failure *failure);
/* Efforts that the accelerations `udot` need in addition to laws (driven coordinates included). */
int mstmm_inverse_dynamics(const mstmm_model *model, real *workspace, real t, const real *q,
                           const real *u, const real *memory, const real *udot, real *efforts,
                           mstmm_failure *failure);
/* The mass matrix (nu x nu) of a tree without flexible bodies, driven coordinates as if free.
 * `work` has 2 nu numbers. */
int mstmm_mass_matrix(const mstmm_model *model, real *workspace, const real *q, const real *memory,
                      real *matrix, real *work, mstmm_failure *failure);
/* M^-1 times `n` successive columns of efforts (nu each) on the free speeds; else zero. */
int mstmm_solve(const mstmm_model *model, real *workspace, int64_t n, const real *q,
                const real *memory, const real *columns, real *answers, mstmm_failure *failure);
/* Smallest change of speeds, weighted by inertia, that removes the velocity errors of closed loops
 * (MSTMM_SLIP), or of coordinates along the speeds (`change`, nu) that closes their gaps
 * (MSTMM_GAP).  With `give` rows have a compliance of that fraction of their mobility.  `missing`
 * (n_rows, NULL: not needed) receives the errors of the rows. */
int mstmm_correction(const mstmm_model *model, real *workspace, int level, real give, real t,
                     const real *q, const real *u, const real *memory, real *change, real *missing,
                     mstmm_failure *failure);
/* Multipliers (n_rows) of rows with errors `asked` and a compliance of `give` times their
 * mobility, at rest: with a small compliance only those of self-stress states remain.  Their loads
 * stay in the workspace. */
int mstmm_self_stress(const mstmm_model *model, real *workspace, real give, const real *asked,
                      const real *q, const real *memory, real *multipliers, mstmm_failure *failure);
/* Sets driven coordinates and speeds in place. */
int mstmm_fill_driven(const mstmm_model *model, real *workspace, real t, real *q, real *u,
                      const real *memory, mstmm_failure *failure);
/* Moves q by a change along the speeds, in place. */
int mstmm_move_positions(const mstmm_model *model, real *workspace, real t, real *q,
                         const real *change, const real *memory, int n_quaternions,
                         const int *quaternions, mstmm_failure *failure);
/* Chooses the satisfied ones of interchangeable redundant rows and writes that to `memory`: an
 * existing choice is kept while it is not much worse than the best.  *changed: whether the choice
 * is new. */
int mstmm_choose_rows(const mstmm_model *model, real *workspace, real t, const real *q,
                      real *memory, int *changed, mstmm_failure *failure);
/* Closes gaps and, unless `gaps_alone`, removes velocity errors, in place; sets driven
 * coordinates. */
int mstmm_close_loops(const mstmm_model *model, real *workspace, real t, real *q, real *u,
                      const real *memory, int n_quaternions, const int *quaternions, int gaps_alone,
                      mstmm_failure *failure);
/* Numbers that a flexible body of n modes, and one of its sections, have in the workspace. */
int64_t mstmm_modal_numbers(int n);
int64_t mstmm_section_numbers(int n);
/* cdef end */

/* Private declarations of the engine follow. */

/* Numbers of a body or (-1) of the ground, of any type. */
#define mstmm_block(model, workspace, body)                                                        \
    ((workspace) + ((body) < 0 ? 0 : (model)->bodies[body].block))

static inline int mstmm_imposed_count(const mstmm_body *body, const real *memory)
{
    if (body->n_imposed == 0) return 0;
    return body->release < 0 || !(fabs(memory[body->release]) > 0) ? body->n_imposed : 0;
}

#define mstmm_of_speeds(block, nu, which) ((block) + MSTMM_BLOCK_FIXED + (which) * (nu))

/* Data of the tangent of a step. */
typedef struct mstmm_tangents {
    real *numbers; /* see mstmm_tangent_lay */
    int kept; /* S of every body stays */
    /* Along unknowns x: du = rate x, da = s x, dq = (sq - kappa g_q)^-1 N x */
    real rate, s, sq, kappa;
    int approximate; /* kappa is ignored: see mstmm_laws_factor */
    int shifted; /* some increments of a right-hand side are known */
    int *negative; /* whether the determinant is negative so far; NULL: that is a failure */
    const real *rho; /* nq: errors of the rates */
    real *change; /* nq: change of the coordinates */
    const int64_t *unit; /* loads that are 1 in a right-hand side; NULL: none */
    int n_unit;
} mstmm_tangents;

/* State of a sweep. */
typedef struct mstmm_state {
    const mstmm_model *model;
    real *workspace;
    real t;
    const real *q, *u, *memory; /* q and u with driven coordinates filled in */
    const real *given; /* prescribed accelerations (inverse dynamics), or NULL */
    const real *efforts, *column; /* owned by the caller; NULL: none */
    real *qdot, *udot, *required, *answer;
    mstmm_balance *balance; /* NULL: not requested */
    mstmm_failure *failure;
    int linked; /* runs with numbers are swept as links */
    int observed; /* ends without loads are swept too */
    int hinges_known; /* the motion of hinges is known */
    int level; /* MSTMM_GAP, MSTMM_SLIP; 0: accelerations */
    real give; /* see mstmm_correction */
    const struct mstmm_strike *strike; /* see impact.h; NULL: none */
    const real *asked; /* errors of the rows that replace gap or slip; NULL: none */
    int refined; /* `given` is a solution with its multipliers: solve for its residual */
    real closing; /* above 0: accelerations close gaps by this factor */
    int residual; /* drives prescribe accelerations although others are given */
    real *chosen; /* memory for a new choice of rows; NULL: the choice is kept */
    int changed; /* the choice is new */
    struct mstmm_state *slope; /* derivatives along a direction; NULL: none */
    mstmm_tangents *tangents;
} mstmm_state;

/* After the blocks: q and u with driven coordinates, values of expressions and drives, slots of
 * tapes, spare rates and accelerations, numbers of inputs. */
static inline real *mstmm_filled_q(const mstmm_state *state)
{
    return state->workspace + state->model->scratch;
}
static inline real *mstmm_filled_u(const mstmm_state *state)
{
    return mstmm_filled_q(state) + state->model->nq;
}
static inline real *mstmm_values(const mstmm_state *state)
{
    return mstmm_filled_u(state) + state->model->nu;
}
static inline real *mstmm_drive_values(const mstmm_state *state)
{
    return mstmm_values(state) + state->model->n_values;
}
static inline real *mstmm_slots(const mstmm_state *state)
{
    return mstmm_drive_values(state) + 3 * state->model->n_drives;
}
static inline real *mstmm_spare_qdot(const mstmm_state *state)
{
    return mstmm_slots(state) + state->model->tape_slots;
}
static inline real *mstmm_spare_udot(const mstmm_state *state)
{
    return mstmm_spare_qdot(state) + state->model->nq;
}

/* Numbers of inputs at the time of the state. */
static inline const real *mstmm_input_numbers(const mstmm_state *state)
{
    real *numbers = mstmm_spare_udot(state) + state->model->nu;
    mstmm_inputs_at(state->model->n_inputs, state->model->inputs, state->t, state->memory, numbers);
    return numbers;
}

/* Initialises the ground, at rest under gravity.  Its block has no numbers of a hinge. */
static inline void mstmm_ground(const mstmm_state *state)
{
    real *ground = state->workspace;
    /* Separate assignments become plain stores: one memset of this size costs small scenes 3 %. */
    for (int i = MSTMM_BLOCK_A; i < MSTMM_BLOCK_FLOOR; i += 7)
        memset(ground + i, 0, 7 * sizeof(real));
    memset(ground + MSTMM_BLOCK_MOTION, 0, 9 * sizeof(real));
    for (int i = 0; i < 3; i++) {
        ground[MSTMM_BLOCK_MOTION + 6 + i] = -state->model->gravity[i];
        ground[MSTMM_BLOCK_A + 4 * i] = 1;
    }
}

/* Numbers of a body or (-1) of the ground of a scene in a plane. */
static inline real *mstmm_flat_block(const mstmm_state *state, int body)
{
    return state->workspace + state->model->flat_numbers + (int64_t)MSTMM_FLAT * (body + 1);
}

/* Initialises the ground of a planar scene. */
static inline void mstmm_flat_ground(const mstmm_state *state)
{
    real *ground = mstmm_flat_block(state, -1);
    memset(ground, 0, MSTMM_FLAT * sizeof(real));
    ground[MSTMM_FLAT_A] = 1;
    for (int i = 0; i < 2; i++) ground[MSTMM_FLAT_MOTION + 2 + i] = -state->model->flat_gravity[i];
}

int mstmm_fail(mstmm_state *state, int reason, int element, int code);

/* True if this body has no work in this sweep. */
static inline int mstmm_idle(int observed, const mstmm_body *body)
{
    return body->idle && !observed;
}

/* True if the sweep from tips to root skips this body. */
static inline int mstmm_is_skipped(const mstmm_model *model, int observed, int index)
{
    return (model->looped && model->looped[index].closure) ||
           mstmm_idle(observed, &model->bodies[index]);
}

/* Modes of the flexible body of a body or section; NULL: none. */
static inline const mstmm_modal *mstmm_modal_of(const mstmm_body *body)
{
    return body->modal ? body->modal : body->section ? body->section->modal : NULL;
}

static inline int mstmm_modes_of(const mstmm_modal *modal) { return modal ? modal->n : 0; }

/* Number of the free speeds of a hinge, and their indices. */
static inline int mstmm_free_speeds(const real *memory, const mstmm_body *body, int *columns)
{
    const int imposed = mstmm_imposed_count(body, memory);
    int n = 0;
    for (int j = 0; j < body->nu; j++)
        if (!imposed || !body->imposed_mask[j]) columns[n++] = j;
    return n;
}

static inline real mstmm_value_at(const mstmm_state *state, int place)
{
    return place < 0 ? 0 : mstmm_values(state)[place];
}

/* Largest pivot of a row that is rounding.  At the first of rows that are chosen the choice is made
 * if there is none yet. */
const real *mstmm_row_floor(mstmm_state *state, const mstmm_loop_row *row);
/* True if a row is replaced by others of its choice. */
int mstmm_is_row_inactive(const mstmm_state *state, const mstmm_loop_row *row);

/* Effort by expression of a force element, from its length and rate. */
int mstmm_given_effort(mstmm_state *state, const mstmm_tape *effort, const real *length,
                       real *value);
/* Its derivative along the present direction. */
int mstmm_given_effort_slope(mstmm_state *state, const mstmm_tape *slope, const real *length,
                             const real *d_length, real *d_value);

/* Compilers convert loops that set or copy numbers to calls, which cost more than the few numbers
 * of a hinge; an empty assembler statement keeps the loops. */
#ifdef __GNUC__
#define MSTMM_ONE_BY_ONE __asm__ volatile("")
#else
#define MSTMM_ONE_BY_ONE (void)0
#endif

static inline void mstmm_set_zero(real *to, int n)
{
    for (int j = 0; j < n; j++) {
        to[j] = 0;
        MSTMM_ONE_BY_ONE;
    }
}

static inline void mstmm_set(real *to, const real *from, int n)
{
    for (int j = 0; j < n; j++) {
        to[j] = from[j];
        MSTMM_ONE_BY_ONE;
    }
}

static const real mstmm_zeros[42] = {0};
static const real mstmm_identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

#endif
