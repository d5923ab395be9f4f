/* Time integration: one loop for explicit Runge-Kutta methods, Rosenbrock methods, diagonally
 * implicit ones and Newmark's family, selected by a tableau.  It is independent of mechanics: a
 * system is a right-hand side, a few call-backs (for implicit methods those of
 * implicit.h) and an array of discrete memory.  The loop owns no memory, keeps no global and never
 * recurses.
 *
 * cffi reads the declarations between the two marks below. */
#ifndef MSTMM_INTEGRATE_H
#define MSTMM_INTEGRATE_H

#include <stdint.h>

#include "bounds.h"
#include "implicit.h"

/* cdef begin */
typedef struct mstmm_system {
    void *context;
    int n_state;
    int n_error; /* only the first n_error components enter the error norm: quadratures come last */
    /* dy = f(t, y); nonzero = failure code */
    int (*rhs)(void *context, double t, const double *y, double *dy);
    /* After every accepted step, may change y and memory.  0 = the saved first stage still holds,
   * -1 = it does not, > 0 = failure code.  NULL: nothing to do. */
    int (*accept)(void *context, double t, double *y);
    int n_events;
    /* Event i is true when g[i] >= 0; nonzero = failure code */
    int (*events)(void *context, double t, const double *y, double *g);
    /* Behind the events: n_switches margins, each zero where the right-hand side has a kink or jumps.
   * Steps end where one changes its sign in either direction; no event is fired. */
    int n_switches;
    /* Called with the accepted state at the located time.  MSTMM_FIRE_*; < 0 = failure code */
    int (*fire)(void *context, int event, double t, double *y);
    /* Whether (t, y) moves further into event i, true before the step and with value g there,
   * although the event bounces.  NULL: no event bounces. */
    int (*lets_through)(void *context, int event, double t, const double *y, double g);
    /* What is watched between two times of a step, n_seen > 0 if it is known.  `see`, called right
   * after `events` at the same (t, y), keeps n_seen numbers of what the conditions read, given the
   * rates of y; `enclose` gives bounds of all that is watched from those at two times h apart.
   * They hold for what is as smooth in between as the dense output. */
    int n_seen;
    void (*see)(void *context, double t, const double *y, const double *rates, double *seen);
    void (*enclose)(void *context, double h, const double *left, const double *right,
                    mstmm_bounds *bounds);
    int n_memory;
    double *memory; /* constant within a step; changed by accept and fire alone */
    /* The right-hand side at `lanes` states side by side (2, 4 or 8; 0: there is none):
   * t[lane], y[i * lanes + lane], dy alike; codes[lane] as rhs returns; nonzero if any failed */
    int lanes;
    int (*rhs_lanes)(void *context, const double *t, const double *y, double *dy, int *codes);
    const mstmm_implicit *implicit; /* interface of implicit methods; NULL: explicit methods only */
    const double
        *attainable; /* relative error below which the right-hand side is noise here; NULL: 0 */
} mstmm_system;

enum {
    MSTMM_FIRE_IGNORE = 0, /* nothing changed; never watch this event again */
    MSTMM_FIRE_RESTART = 1, /* state or memory changed: the step ends here */
    MSTMM_FIRE_STOP = 2, /* the run ends here */
    MSTMM_FIRE_CONTINUE = 3 /* nothing changed; fire again the next time it becomes true */
};

enum {
    MSTMM_EXPLICIT = 0,
    MSTMM_ROSENBROCK = 1,
    MSTMM_DIRK = 2,
    MSTMM_ALPHA = 3,
    MSTMM_EXPONENTIAL = 4
};

/* s = n_stages stages k_0 .. k_(s-1), then k_s = f(t + h, y_new), which is also the first stage of
 * the next step, then n_extra stages for dense output alone.
 *
 * Weights stand in sparse rows: row r holds the terms starts[r] .. starts[r + 1] - 1, each a weight
 * and the stage it belongs to.  Rows: stages 1 .. s - 1, the step, the error, the second error,
 * the extra stages, and the n_dense polynomials of dense output,
 * y(theta) = y + h sum_i k_i sum_j dense[i][j] phi_j(theta) with phi = theta, theta(1-theta),
 * theta^2(1-theta), theta^2(1-theta)^2, ... */
typedef struct mstmm_tableau {
    int n_stages, n_extra, n_dense;
    int n_errors; /* 0: fixed steps only; 2: combined as in the 8(5,3) pair of Hairer and Wanner */
    int error_order; /* order of the error estimate; the step goes with norm^(-1/(order+1)) */
    const int *starts, *columns;
    const double *weights;
    const double *c; /* s */
    const double *c_extra; /* n_extra */
    double stability_limit; /* h |lambda| at the end of the stable real axis */
    double beta; /* exponent of the previous error in the step controller (0: plain) */
    /* An iterated method: after k_0 its stages are n_iterations blocks of n_nodes (at most 8), and
   * those of a block depend on the block before alone, so that they are evaluated side by side.
   * n_nodes = 0 for other methods. */
    int n_nodes, n_iterations;
    const double *mix; /* n_nodes x 8: mix[8 j + i] = weight of node j in node i, zeros behind */
    const int
        *is_read; /* n_iterations: 1 where the step, the error or dense output need the block */
    /* An implicit method.  k_0 is the slope at the step's start for all of them, k_s that at its end.
   * Rosenbrock: k_i = U_i / h, i = 1 .. s - 1, with the weights of the form without products by the
   * tangent; s - 1 rows more, behind those of dense output, hold C.
   * DIRK: k_i the slopes at the stages, the last one at the step's end; rows of stages without the
   * diagonal; s - 1 rows more: weights of the k_j from which the iteration for k_i starts.
   * Alpha and exponential: k_1 = (y_new - y) / h, k_2 the error / h. */
    int kind;
    double gamma; /* Rosenbrock and DIRK: the diagonal */
    const double *d; /* Rosenbrock: s weights of h dR/dt */
    double alpha_m, alpha_f, beta_n, gamma_n, collocation; /* Alpha; the last 1 but for Wilson */
    double error_constant; /* Alpha: of h^2 times the change of acceleration */
    int backward; /* Alpha: Houbolt's differences, after two steps by the constants above */
    int one_iteration; /* Alpha: one linearised equation a step, at the predictor */
    /* Quadratures, but for DIRK whose stages carry them: slopes at the ends and n_inner nodes
   * between, of which row l holds the weights in the polynomials of dense output. */
    int n_inner;
    const double *inner; /* n_inner */
    const double *quadrature; /* (n_inner + 2) x n_dense, nodes in their order */
    /* n_inner + 2: the rates' highest divided difference, sizes adding to 1 */
    const double *roughness;
} mstmm_tableau;

enum {
    MSTMM_RUNNING = 0, /* the wall time has passed; call again */
    MSTMM_FINISHED = 1,
    MSTMM_STOPPED = 2, /* by event number `event` */
    MSTMM_BUFFER_FULL = 3, /* empty the sample buffer (n_samples = 0) and call again */
    MSTMM_STEP_TOO_SMALL = -1, /* `component` had the largest scaled error */
    MSTMM_NOT_FINITE = -2, /* `component` is the first non-finite one, at `fail_time` */
    MSTMM_RHS_FAILED = -3, /* with `code`, at `fail_time` */
    MSTMM_ACCEPT_FAILED = -4,
    MSTMM_EVENT_FAILED = -5, /* `code`, or 0 with `event` when that value was not a number */
    MSTMM_FIRE_FAILED = -6,
    MSTMM_TOO_MANY_STEPS = -7, /* max_steps; with `code` 1 there is none, but no end in sight */
    MSTMM_EVENT_CHATTER = -8, /* `event` fires without end at one time */
    MSTMM_BAD_ARGUMENT = -9, /* `code` says which, see mstmm_run_start */
    MSTMM_TANGENT_FAILED = -10, /* with `code`, at `fail_time` */
    MSTMM_NOT_CONVERGED = -11, /* Newton's iteration, at `fail_time`, least of all in `component` */
    MSTMM_LET_THROUGH = -12, /* motion into an event that bounces, see lets_through */
    MSTMM_POLE = -13 /* the right-hand side has a pole there, see mstmm_run.pole */
};

/* Which tangent implicit methods take: each what suits it, the exact one, or that of laws alone. */
enum { MSTMM_ANY_TANGENT = 0, MSTMM_EXACT_TANGENT = 1, MSTMM_LAWS_TANGENT = 2 };

/* The changing part of a run, only doubles and only 64-bit integers, so that it can be saved. */
typedef struct mstmm_run_real {
    double t; /* time of the current good state */
    double h_next; /* proposed next step */
    double h, t_new; /* the trial step: from t, and its end */
    double t_stop; /* where in the trial step to stop: at an event or at its end */
    double t_scan; /* events are known up to here */
    double error_previous;
    double fail_time;
    double smallest_step, largest_step; /* of steps not cut short by a break, an event or the end */
    double sum_local_error; /* sum over the steps of the RMS local error estimate, in units of y */
    double sum_scaled_error; /* the same in units of the tolerance */
    double stiffness; /* last estimate of h |lambda| */
    double largest_stiffness;
    double t_switch; /* the first switch in the trial step, INFINITY: none */
    double h_cut; /* > 0: the step is to be no longer, so that it ends before a switch */
    double pace_time; /* t so many steps ago: how fast the run gets on */
    double chatter_time; /* since then switch `chatter` is not watched */
    double unseen_time; /* of the first time that `unseen` is about */
    /* implicit methods: the last accepted step (0: none since a restart), and where the tangent of
   * Newton's iteration was taken, besides the state kept in the workspace */
    double h_previous;
    double tangent_t, tangent_s, tangent_sq;
    double contraction; /* of Newton's iteration with that tangent; < 0: not known */
} mstmm_run_real;

typedef struct mstmm_run_count {
    /* compared on restoring */
    int64_t n_state, n_events, n_memory, n_stages, n_extra, n_dense, lanes;
    int64_t n_switches;
    int64_t phase, status;
    int64_t fail_status, code, component, event;
    int64_t break_index, output_index, grid_index, bound_index;
    int64_t at_break; /* t is a break: the first stage uses its right side */
    int64_t lands_on_break, lands_on_grid, cut_short; /* of the trial step */
    int64_t first_stage_valid, restarted, sampled, rejected_last;
    int64_t fires_here; /* events fired without time passing */
    int64_t crossings, crossings_here; /* of switches; those of one without time passing */
    int64_t next_switch; /* the one at t_switch, counted behind the events */
    int64_t chatter; /* the last switch that crossed without end, -1: none */
    int64_t unseen; /* the first of what is watched that may have passed unseen, -1: none */
    int64_t steps, rejected, evaluations, events_fired;
    /* how many steps were about as long as stability allows, and whether that is a good part */
    int64_t stability_limited_steps, stability_limited;
    /* implicit methods */
    int64_t residuals, tangents, solves, iterations;
    int64_t laws_tangents; /* how many of the tangents were those of laws alone */
    /* Newton: the last one is; stages still to be solved by exact ones, and how many in a row last */
    int64_t by_laws, exact_left, exact_row;
    int64_t by_positions; /* Newton: the last tangent is that of rows of positions */
    int64_t tangent_valid; /* the workspace holds where it was taken */
    int64_t tangent_held; /* and the system has it factored */
    /* Rosenbrock: steps still to be made by evaluated accelerations, and how many in a row last
   * time */
    int64_t evaluated_left, evaluated_row;
    int64_t history; /* steps of the length of the last one, at most 2 */
    int64_t sign, sign_against; /* steps that spoke for another kind of method; others since */
    int64_t asked; /* the last mstmm_advance came back for them or for look_steps */
    int64_t no_step; /* the run failed because its method finds no step from here */
} mstmm_run_count;

typedef struct mstmm_run {
    /* the problem: filled by the caller, only read by the loop */
    const mstmm_system *system;
    const mstmm_tableau *tableau;
    double t_start, t_end;
    double fixed_step; /* > 0: fixed steps t_start + i fixed_step; 0: adaptive */
    int tangents; /* implicit methods: which tangent, see above */
    double rtol;
    const double *atol; /* n_error; may be NULL with fixed steps */
    double first_step, min_step, max_step; /* 0: chosen */
    int64_t max_steps; /* 0: no limit, unless the end is out of reach */
    int64_t pause_steps; /* mstmm_advance returns when so many steps have been made; 0: never */
    /* It returns too, with count.asked, between steps: when so many of the last ones spoke for
   * another kind of method (of explicit methods those as long as stability allows, of implicit ones
   * those shorter than short_step), and when look_steps have been made; 0: never. */
    int64_t sign_steps, look_steps;
    double short_step;
    int64_t n_breaks;
    const double *breaks; /* strictly increasing */
    int64_t n_bounds; /* adaptive steps: none from bound_starts[i] on is longer than bounds[i] */
    const double *bound_starts; /* strictly increasing, the first at or before t_start */
    const double *bounds;
    const double *pole; /* the break at which a pole begins: the run ends there; NULL: none */
    int64_t n_outputs; /* < 0: a sample at every accepted step */
    const double *outputs; /* strictly increasing, within [t_start, t_end] */
    double *workspace; /* mstmm_workspace_size doubles */
    /* The sample buffer: the caller's; empty it by n_samples = 0.  Samples inside a step are the
   * dense output, not passed through accept, with the memory of the step's start. */
    int64_t sample_capacity; /* at least 2 */
    int64_t n_samples;
    double *sample_t;
    double *sample_y; /* sample_capacity x n_state */
    double *sample_memory; /* sample_capacity x n_memory */
    /* 0 for a step's end or an output time; i + 1 just after event i changed the state, -(i + 1) just
   * before it unless that state stands in the samples already */
    int64_t *sample_event;
    /* the state: read freely, write never */
    mstmm_run_real real;
    mstmm_run_count count;
} mstmm_run;

/* Doubles of workspace; 0 for sizes that make no sense. */
int64_t mstmm_workspace_size(const mstmm_system *system, const mstmm_tableau *tableau);
/* Puts the run at t_start with the state y0 (n_state).  Returns MSTMM_RUNNING, or
 * MSTMM_BAD_ARGUMENT with count.code = 1 sizes, 2 times, 3 tolerances or steps, 4 breaks,
 * 5 output times, 6 sample buffer. */
int mstmm_run_start(mstmm_run *run, const double *y0);
/* Advances until finished, failed, stopped, buffer full, or wall_seconds have passed; at least one
 * step is made, and the clock is read about every 0.1 ms or every step. */
int mstmm_advance(mstmm_run *run, double wall_seconds);
/* Continues with another method between two steps: counts, the proposed step and the state of
 * events are kept.  `workspace` has mstmm_workspace_size doubles for that method and replaces the
 * run's. Returns 0, or MSTMM_BAD_ARGUMENT with the run unchanged: within a step, with fixed steps,
 * for a method that the system does not support.  A failed run continues if no step was possible
 * (count.no_step). */
int mstmm_run_change(mstmm_run *run, const mstmm_tableau *tableau, double *workspace);
/* Sets another end, not before the current good state: a finished run continues as if that end had
 * been given from the start, and a failed run tries again from its last good state.
 * `changed` says that the caller has changed memory, as an event may.  Returns 0, or
 * MSTMM_BAD_ARGUMENT with the run unchanged: within a step, and for a run that an event stopped. */
int mstmm_run_go_on(mstmm_run *run, double t_end, int changed);
/* Replaces the breaks, bounds and pole with which the run was started. */
void mstmm_run_map(mstmm_run *run, int64_t n_breaks, const double *breaks, int64_t n_bounds,
                   const double *bound_starts, const double *bounds, const double *pole);
/* The current good state, n_state doubles inside the workspace. */
const double *mstmm_run_y(const mstmm_run *run);
/* State of a run as plain numbers: sizes, writing, and reading back into a run whose problem part
 * has been filled in the same way.  Restoring returns 0, or MSTMM_BAD_ARGUMENT with the run
 * unchanged. */
int64_t mstmm_run_pack_reals(const mstmm_run *run);
int64_t mstmm_run_pack_integers(const mstmm_run *run);
void mstmm_run_pack(const mstmm_run *run, double *reals, int64_t *integers);
int mstmm_run_restore(mstmm_run *run, int64_t n_reals, const double *reals, int64_t n_integers,
                      const int64_t *integers);
/* cdef end */

#endif
