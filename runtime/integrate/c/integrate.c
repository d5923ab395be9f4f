/* Loop over the steps: actions between them and inside an accepted one.  It is a small
 * state machine whose phase is kept in the run, so that it can leave between any two samples
 * (buffer full) and after any step (wall time) and continue bit for bit. */
#ifndef _POSIX_C_SOURCE
#define _POSIX_C_SOURCE 199309L /* clock_gettime */
#endif
#include <math.h>
#include <string.h>
#include <time.h>

#include "step.h"

static const double AT_ONCE = 0x1p-42; /* of the time or the run: hardly any time */
static const double JUST_BEFORE = 1.0 - 0x1p-10, WELL_BEFORE = 0.9; /* of the way to a switch */
enum { MOST_FIRES_HERE = 100, MOST_CROSSINGS_HERE = 50 };

/* ---- samples ---- */

static void put_sample(mstmm_run *run, double t, const double *y, int64_t event)
{
    const mstmm_system *system = run->system;
    const int64_t i = run->n_samples, n = system->n_state, nm = system->n_memory;
    run->sample_t[i] = t;
    run->sample_event[i] = event;
    if (n) memcpy(run->sample_y + i * n, y, (size_t)n * sizeof *y);
    if (nm) memcpy(run->sample_memory + i * nm, system->memory, (size_t)nm * sizeof *y);
}

static int has_room(const mstmm_run *run, int64_t wanted)
{
    return run->sample_capacity - run->n_samples >= wanted;
}

/* ---- events at a given state ---- */

static void save_memory(const mstmm_work *work)
{
    const mstmm_system *system = work->system;
    if (system->n_memory)
        memcpy(work->memory, system->memory, (size_t)system->n_memory * sizeof(double));
}

static void restore_memory(const mstmm_work *work)
{
    const mstmm_system *system = work->system;
    if (system->n_memory)
        memcpy(system->memory, work->memory, (size_t)system->n_memory * sizeof(double));
}

/* True if the last sample is exactly this state with the present memory. */
static int sample_equals(const mstmm_run *run, const double *y)
{
    const mstmm_system *system = run->system;
    const int64_t i = run->n_samples, n = system->n_state, nm = system->n_memory;
    return (!n || !memcmp(run->sample_y + i * n, y, (size_t)n * sizeof *y)) &&
           (!nm || !memcmp(run->sample_memory + i * nm, system->memory, (size_t)nm * sizeof *y));
}

/* Fires event i at (t, y_event), with samples before and after if the state changes (none before
 * where one stands already).  Returns what fire returned, or a failure status after which the
 * memory is as it was saved.  Needs room for two samples. */
static int fire(const mstmm_work *work, int i, double t, int sampled)
{
    mstmm_run *run = work->run;
    double *y = work->y_event;
    const int64_t n = work->system->n_state;
    if (!sampled) put_sample(run, t, y, -(i + 1));
    const int answer = work->system->fire(work->system->context, i, t, y);
    int status = 0;
    run->count.event = i;
    run->count.events_fired++;
    if (answer < 0 || answer > MSTMM_FIRE_CONTINUE)
        status = mstmm_note(run, MSTMM_FIRE_FAILED, answer, -1, t);
    else if (!mstmm_all_finite(n, y))
        status = mstmm_note(run, MSTMM_NOT_FINITE, 0, mstmm_first_not_finite(n, y), t);
    if (status) {
        restore_memory(work);
        return status;
    }
    work->truth[i] = answer == MSTMM_FIRE_IGNORE ? UNWATCHED : HOLDS;
    if (answer == MSTMM_FIRE_IGNORE || answer == MSTMM_FIRE_CONTINUE) return answer;
    if (!sampled && !(answer == MSTMM_FIRE_STOP && sample_equals(run, y))) run->n_samples++;
    put_sample(run, t, y, i + 1);
    run->n_samples++;
    return answer;
}

/* Bookkeeping after event i has changed the current state; the next step starts here. */
static int note_change(const mstmm_work *work, int i)
{
    mstmm_run *run = work->run;
    const double t = run->real.t, since = t - work->last_fire[i];
    const int same_time = fabs(since) <= 8.0 * (nextafter(fabs(t), INFINITY) - fabs(t));
    run->count.fires_here = same_time ? run->count.fires_here + 1 : 0;
    work->last_fire[i] = t;
    run->count.sampled = 1;
    run->count.restarted = 1;
    run->count.first_stage_valid = 0;
    if (run->count.fires_here > MOST_FIRES_HERE)
        return mstmm_note(run, MSTMM_EVENT_CHATTER, 0, -1, t);
    /* a repeated event is watched at the intervals at which it came (a bouncing body) */
    if (since > 0.0 && run->real.h_next > since) run->real.h_next = since;
    return 0;
}

static int stop_run(mstmm_run *run)
{
    run->count.phase = PHASE_END;
    return MSTMM_STOPPED;
}

static void update_truth(const mstmm_work *work, const double *g)
{
    for (int i = 0; i < work->system->n_events; i++)
        if (work->truth[i] == HOLDS && g[i] < 0.0)
            work->truth[i] = work->last_fire[i] == work->run->real.t ? DOUBTFUL : UNTRUE;
}

static int fire_here(const mstmm_work *work, int i)
{
    mstmm_run *run = work->run;
    const size_t bytes = (size_t)work->system->n_state * sizeof(double);
    if (!has_room(run, 2)) return MSTMM_BUFFER_FULL;
    memcpy(work->y_event, work->y, bytes);
    save_memory(work);
    const int answer = fire(work, i, run->real.t, (int)run->count.sampled);
    if (answer == MSTMM_FIRE_RESTART || answer == MSTMM_FIRE_STOP) {
        memcpy(work->y, work->y_event, bytes);
        const int status = note_change(work, i);
        return answer == MSTMM_FIRE_STOP ? stop_run(run) : status;
    }
    restore_memory(work);
    return answer < 0 ? answer : 0;
}

static int phase_here(const mstmm_work *work)
{
    mstmm_run *run = work->run;
    const mstmm_system *system = work->system;
    double *g = work->g_left;
    if (system->n_events) {
        const int status = mstmm_event_values(work, run->real.t, work->y, g);
        if (status) return status;
        update_truth(work, g);
    }
    for (int i = 0; i < system->n_events; i++)
        if (g[i] >= 0.0 && (work->truth[i] == UNTRUE || work->truth[i] == DOUBTFUL))
            return fire_here(work, i);
    run->count.phase = PHASE_SAMPLE;
    return 0;
}

/* ---- the current state ---- */

/* Samples the current state if it is requested and not sampled yet. */
static int sample_current(const mstmm_work *work)
{
    mstmm_run *run = work->run;
    int64_t *i = &run->count.output_index;
    const int due = *i < run->n_outputs && run->outputs[*i] <= run->real.t;
    if ((run->n_outputs < 0 || due) && !run->count.sampled) {
        if (!has_room(run, 1)) return MSTMM_BUFFER_FULL;
        put_sample(run, run->real.t, work->y, 0);
        run->n_samples++;
        run->count.sampled = 1;
    }
    while (*i < run->n_outputs && run->outputs[*i] <= run->real.t) (*i)++;
    return 0;
}

static int phase_start(const mstmm_work *work)
{
    const int status = sample_current(work);
    if (!status) work->run->count.phase = PHASE_HERE;
    return status;
}

static int phase_sample(const mstmm_work *work)
{
    mstmm_run *run = work->run;
    const int status = sample_current(work);
    if (status) return status;
    run->count.phase = PHASE_STEP;
    if (run->real.t < run->t_end) return 0;
    run->count.phase = PHASE_END;
    return MSTMM_FINISHED;
}

/* ---- inside the accepted trial step ---- */

static int is_negligible_time(const mstmm_run *run, double t)
{
    return t <= AT_ONCE * fmax(fabs(run->real.t), run->t_end - run->t_start);
}

/* A step across a switch is invalid: stages after the switch falsify its result, and its dense
 * output even if they do not enter the result; all of them may have missed a window that begins
 * there and soon ends.  It is repeated to end just before the switch, until the rest is negligibly
 * short. */
static int phase_switch(const mstmm_work *work)
{
    mstmm_run *run = work->run;
    const int status = mstmm_find_switch(work);
    const double way = run->real.t_switch - run->real.t;
    run->count.phase = PHASE_SCAN;
    if (status || !(way > 0.0 && way < INFINITY) || is_negligible_time(run, way)) return status;
    run->real.h_cut = (run->real.h_cut > 0.0 ? WELL_BEFORE : JUST_BEFORE) * way;
    run->count.steps--;
    run->count.rejected++;
    run->count.phase = PHASE_STEP;
    return 0;
}

static int phase_scan(const mstmm_work *work)
{
    const int status = mstmm_scan(work);
    work->run->count.phase = PHASE_OUTPUT;
    return status;
}

static int phase_output(const mstmm_work *work)
{
    mstmm_run *run = work->run;
    int64_t *i = &run->count.output_index;
    const int event = run->count.event >= 0; /* then the state at t_stop is dense output too */
    while (*i < run->n_outputs && (run->outputs[*i] < run->real.t_stop ||
                                   (event && run->outputs[*i] == run->real.t_stop))) {
        if (!has_room(run, 1)) return MSTMM_BUFFER_FULL;
        mstmm_dense(work, run->outputs[*i], work->y_event);
        put_sample(run, run->outputs[*i], work->y_event, 0);
        run->n_samples++;
        (*i)++;
    }
    run->count.phase = !event                                     ? PHASE_ACCEPT
                       : run->count.event < run->system->n_events ? PHASE_FIRE
                                                                  : PHASE_CROSS;
    return 0;
}

/* Calls accept on y at time t.  Returns 1 if the saved first stage is to be forgotten, 0 if not,
 * or a failure status after which the memory is as it was. */
static int accept_state(const mstmm_work *work, double t, double *y)
{
    const mstmm_system *system = work->system;
    const int64_t n = system->n_state;
    save_memory(work);
    if (!system->accept) return 0;
    const int code = system->accept(system->context, t, y);
    int status = code ? 1 : 0;
    if (code > 0)
        status = mstmm_note(work->run, MSTMM_ACCEPT_FAILED, code, -1, t);
    else if (!mstmm_all_finite(n, y))
        status = mstmm_note(work->run, MSTMM_NOT_FINITE, 0, mstmm_first_not_finite(n, y), t);
    if (status < 0) restore_memory(work);
    return status;
}

/* The current state becomes (t, y). */
static void move_to(const mstmm_work *work, double t, const double *y)
{
    mstmm_run *run = work->run;
    memcpy(work->y, y, (size_t)work->row * sizeof *y);
    run->real.t = t;
    run->real.h_cut = 0.0;
    run->count.sampled = 0;
    run->count.restarted = 0;
    if (t == run->real.t_new && run->count.lands_on_grid) run->count.grid_index++;
    mstmm_pass_breaks(run);
}

static int phase_fire(const mstmm_work *work)
{
    mstmm_run *run = work->run;
    const int i = (int)run->count.event;
    const double t = run->real.t_stop;
    if (!has_room(run, 2)) return MSTMM_BUFFER_FULL;
    mstmm_dense(work, t, work->y_event);
    int status = accept_state(work, t, work->y_event);
    if (status < 0) return status;
    const int answer = fire(work, i, t, 0);
    if (answer < 0) return answer;
    if (answer == MSTMM_FIRE_RESTART || answer == MSTMM_FIRE_STOP) {
        move_to(work, t, work->y_event);
        run->count.phase = PHASE_HERE;
        status = note_change(work, i);
        return answer == MSTMM_FIRE_STOP ? stop_run(run) : status;
    }
    restore_memory(work);
    run->real.t_scan = t;
    run->count.phase = PHASE_SCAN;
    return 0;
}

/* A switch that chatters keeps the motion at its zero: it is no longer watched, and the run
 * continues with the steps that the error permits. */
static void note_crossing(const mstmm_work *work, int i)
{
    mstmm_run *run = work->run;
    const double t = run->real.t, since = t - work->last_fire[i];
    work->last_fire[i] = t;
    run->count.crossings++;
    run->count.crossings_here = is_negligible_time(run, since) ? run->count.crossings_here + 1 : 0;
    if (run->count.crossings_here < MOST_CROSSINGS_HERE) return;
    run->count.crossings_here = 0;
    run->count.chatter = i - run->system->n_events;
    run->real.chatter_time = t;
    work->truth[i] = UNWATCHED;
}

static int phase_cross(const mstmm_work *work)
{
    mstmm_run *run = work->run;
    const int i = (int)run->count.event;
    mstmm_dense(work, run->real.t_stop, work->y_event);
    const int status = accept_state(work, run->real.t_stop, work->y_event);
    if (status < 0) return status;
    move_to(work, run->real.t_stop, work->y_event);
    run->count.event = -1;
    run->count.restarted = 1;
    run->count.first_stage_valid = 0;
    note_crossing(work, i);
    run->count.phase = PHASE_SAMPLE;
    return 0;
}

/* Number of steps of one length, counted up to 2 */
static void note_length(mstmm_run *run)
{
    const double h = run->real.h;
    const int same = fabs(h - run->real.h_previous) <= MSTMM_SAME_STEP * h;
    run->count.history = !same ? 1 : run->count.history < 2 ? run->count.history + 1 : 2;
    run->real.h_previous = h;
}

static int phase_accept(const mstmm_work *work)
{
    mstmm_run *run = work->run;
    const int64_t row = work->row;
    const int status = accept_state(work, run->real.t_new, work->y_new);
    if (status < 0) return status;
    move_to(work, run->real.t_new, work->y_new);
    note_length(run);
    run->count.first_stage_valid = status == 0 && !run->count.at_break;
    if (run->count.first_stage_valid)
        memcpy(work->k, work->k + work->tableau->n_stages * row, (size_t)row * sizeof(double));
    run->count.phase = PHASE_SAMPLE;
    return 0;
}

/* ---- the loop ---- */

static int make_phase(const mstmm_work *work)
{
    switch (work->run->count.phase) {
    case PHASE_START: return phase_start(work);
    case PHASE_HERE: return phase_here(work);
    case PHASE_SAMPLE: return phase_sample(work);
    case PHASE_STEP: return mstmm_try_step(work);
    case PHASE_SWITCH: return phase_switch(work);
    case PHASE_SCAN: return phase_scan(work);
    case PHASE_OUTPUT: return phase_output(work);
    case PHASE_FIRE: return phase_fire(work);
    case PHASE_CROSS: return phase_cross(work);
    case PHASE_ACCEPT: return phase_accept(work);
    default: return (int)work->run->count.status;
    }
}

double mstmm_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Reads the clock after the first step, then about every 0.1 ms. */
typedef struct pace {
    double deadline, last;
    int stride, left;
} pace;

static int time_is_up(pace *at)
{
    if (!isfinite(at->deadline) || --at->left > 0) return 0;
    const double now = mstmm_seconds();
    at->stride = now - at->last > 1e-4 ? 1 : at->stride < 64 ? 2 * at->stride : 64;
    at->left = at->stride;
    at->last = now;
    return now >= at->deadline;
}

int mstmm_advance(mstmm_run *run, double wall_seconds)
{
    mstmm_work work;
    if (run->count.phase == PHASE_END) return (int)run->count.status;
    mstmm_work_cut(run, &work);
    run->count.tangent_held = 0; /* the caller may have used the system since */
    run->count.asked = 0;
    const int64_t steps = run->count.steps;
    const double now = mstmm_seconds();
    pace at = {.deadline = now + wall_seconds, .last = now, .stride = 1, .left = 1};
    for (;;) {
        const int64_t phase = run->count.phase;
        const int status = make_phase(&work);
        run->count.status = status;
        if (status < 0) {
            run->count.phase = PHASE_END;
            run->count.no_step = phase == PHASE_STEP && status != MSTMM_TOO_MANY_STEPS;
        }
        if (status) return status;
        if (phase != PHASE_SAMPLE || run->count.steps == steps) continue;
        if (mstmm_is_asked(run) || run->count.steps == run->pause_steps || time_is_up(&at))
            return MSTMM_RUNNING;
    }
}
