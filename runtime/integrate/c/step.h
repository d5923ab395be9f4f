/* Private declarations of the time integration. */
#ifndef MSTMM_STEP_H
#define MSTMM_STEP_H

#include "workspace.h"

/* Phase of the loop between two calls */
enum {
    PHASE_START,   /* sample the start */
    PHASE_HERE,    /* fire what has become true at the current state */
    PHASE_SAMPLE,  /* sample the current state, finish, or go on */
    PHASE_STEP,    /* make the trial step until its error is small enough */
    PHASE_SWITCH,  /* make it again if a switch is in it, to end just before */
    PHASE_SCAN,    /* look for the next event in it */
    PHASE_OUTPUT,  /* samples inside the step */
    PHASE_FIRE,    /* accept up to the event and fire it */
    PHASE_CROSS,   /* accept up to where a switch crosses */
    PHASE_ACCEPT,  /* accept the whole step */
    PHASE_END      /* count.status is final */
};

/* What is known of an event or switch, kept as a double among the others.  Doubtful: it has just
 * fired, and reads false at the same time; only rounding perhaps, so that becoming true again
 * counts for nothing until time has passed or another event has fired. */
#define UNWATCHED (-1.0)
#define UNTRUE 0.0
#define DOUBTFUL 0.5
#define HOLDS 1.0

void mstmm_work_cut(mstmm_run *run, mstmm_work *work);
/* Breaks up to t lie behind the run; is t one of them? */
void mstmm_pass_breaks(mstmm_run *run);

int mstmm_first_stage(const mstmm_work *work);
int mstmm_stages(const mstmm_work *work);
int mstmm_build_dense(const mstmm_work *work);
void mstmm_dense(const mstmm_work *work, double t, double *y);
/* Slopes of the dense output. */
void mstmm_dense_rates(const mstmm_work *work, double t, double *rates);
/* Scaled RMS error of the trial step; *absolute receives it unscaled. */
double mstmm_error_norm(const mstmm_work *work, double *absolute);
int64_t mstmm_worst_component(const mstmm_work *work);
double mstmm_stiffness(const mstmm_work *work);
double mstmm_initial_step(const mstmm_work *work, double interval);

/* Parts of step control, which read only the run.
 * Aim: where the trial step ends (t_new, h); 0, or a failure.  Interval: to the next stop.
 * Reject: a shorter step after an error above 1 or a failure already noted; 0, or the status with
 * which the run ends.  Propose: the next step, after a step with this error.  */
int mstmm_aim(mstmm_run *run);
/* Between two breaks that are one but for rounding no error is asked for. */
int mstmm_in_gap(const mstmm_run *run);
/* Failure if the run ends here (at a pole, after too many steps, or with its end out of reach),
 * else 0. */
int mstmm_no_further(mstmm_run *run);
double mstmm_interval(const mstmm_run *run);
int mstmm_output_inside(const mstmm_run *run);
int mstmm_reject(mstmm_run *run, int failed, double error);
void mstmm_propose(mstmm_run *run, double error);
void mstmm_count_step(mstmm_run *run, double error, double absolute);
/* Records signs for or against the method: for explicit ones whether stability limited the step. */
void mstmm_watch_sign(mstmm_run *run, int limited);
/* True if a call-back condition of the caller is met. */
int mstmm_is_asked(mstmm_run *run);
/* First step: a guess from y and k, and the step from the slope f1 at y + guess k.  Components lie
 * `stride` doubles apart, tolerances side by side. */
typedef struct mstmm_slopes {
    int64_t n, stride;
    const double *y, *k, *atol;
    double rtol, interval;
} mstmm_slopes;
double mstmm_guess_step(const mstmm_slopes *at);
double mstmm_step_from(const mstmm_slopes *at, double guess, const double *f1, int error_order);
/* RMS of one error vector, or the combination of two, from sums of squares of n components. */
double mstmm_combined_error(double h, double high, double low, int64_t n, int both);

/* Time of a clock that only goes on. */
double mstmm_seconds(void);

/* Makes the next step, shorter and shorter until its error is small enough. */
int mstmm_try_step(const mstmm_work *work);

MSTMM_INLINE int mstmm_n_watched(const mstmm_system *system)
{
    return system->n_events + system->n_switches;
}
/* The event functions at (t, y), a value that is not a number being a failure; and the margins of
 * switches, negative on the side where the step began. */
int mstmm_event_values(const mstmm_work *work, double t, const double *y, double *g);
/* Looks for the first switch in (t, t_new]; sets t_switch (INFINITY: none) and next_switch. */
int mstmm_find_switch(const mstmm_work *work);
/* Looks for the first event in (t_scan, t_new] up to t_switch; sets t_stop and count.event (-1:
 * none, n_events and up: the switch). */
int mstmm_scan(const mstmm_work *work);

#endif
