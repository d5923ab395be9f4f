/* Bounds of conditions between two evaluation times: first of the quantities that they read, from
 * values and rates at both, then of the conditions, by the tape over intervals. */
#include "event_bounds.h"

#include <math.h>

#include "inputs.h"
#include "sweep.h"
#include "tape_bounds.h"

/* A number with slopes r at the ends of h deviates from its chord by max |r - chord| h / 4 if it is
 * a cubic, and its slope from those three by half their spread; the rest is room for higher
 * orders. */
static const double MARGIN = 1.5;

/* Relative change of coordinates and speeds for a difference quotient */
static const double INCREMENT = 1e-7;

/* Numbers of an evaluation: t, value and rate of each component read, probes, inputs.  Of a probe:
 * position, velocity, and, where velocities are read, acceleration */
enum { PROBE = 9 };
static int first_probe(const mstmm_scene_run *run) { return 1 + 2 * run->n_read; }
static int first_input(const mstmm_scene_run *run)
{
    return first_probe(run) + PROBE * run->n_probes;
}
static int n_inputs(const mstmm_scene_run *run) { return run->event_tape->input_lengths[4]; }

/* Accelerations of the probes, by the difference of velocities a moment later */
static void record_accelerations(mstmm_scene_run *run, double t, const double *y,
                                 const double *rates, double *seen)
{
    const int n = run->model->nq + run->model->nu;
    double soon = INFINITY;
    for (int i = 0; i < n; i++)
        if (rates[i] != 0.0) soon = fmin(soon, INCREMENT * (1.0 + fabs(y[i])) / fabs(rates[i]));
    if (!isfinite(soon)) soon = INCREMENT;
    for (int i = 0; i < n; i++) run->later[i] = y[i] + soon * rates[i];
    const int failed = mstmm_probes_seen(run, t + soon, run->later, run->later + run->model->nq);
    for (int k = 0; k < run->n_probes; k++)
        for (int j = 0; j < 3; j++) {
            const double change = run->probe_values[6 * k + 3 + j] - seen[PROBE * k + 3 + j];
            seen[PROBE * k + 6 + j] = failed ? NAN : change / soon;
        }
}

static void record_quantities(void *context, double t, const double *y, const double *rates,
                              double *seen)
{
    mstmm_scene_run *run = context;
    mstmm_state state = {.model = run->model,
                         .workspace = run->workspace,
                         .t = t,
                         .memory = run->memory,
                         .failure = &run->failure};
    double *probes = seen + first_probe(run);
    if (run->closes) y = run->probe_values + 6 * run->n_probes + MSTMM_PROBE_NUMBERS;
    seen[0] = t;
    for (int k = 0; k < run->n_read; k++) {
        seen[1 + 2 * k] = y[run->read[k]];
        seen[2 + 2 * k] = rates[run->read[k]];
    }
    for (int k = 0; k < run->n_probes; k++)
        memcpy(probes + PROBE * k, run->probe_values + 6 * k, 6 * sizeof(real));
    if (n_inputs(run))
        memcpy(seen + first_input(run), mstmm_input_numbers(&state),
               (size_t)n_inputs(run) * sizeof(real));
    if (run->later) record_accelerations(run, t, y, rates, probes);
}

static mstmm_bounds quantity_bounds(double h, double a, double b, double rate_a, double rate_b)
{
    const double chord = (b - a) / h;
    const double lowest = fmin(chord, fmin(rate_a, rate_b));
    const double highest = fmax(chord, fmax(rate_a, rate_b));
    const double away = 0.25 * MARGIN * h * fmax(fabs(rate_a - chord), fabs(rate_b - chord));
    const double spread = 0.5 * MARGIN * (highest - lowest);
    return (mstmm_bounds){fmin(a, b) - away, fmax(a, b) + away, lowest - spread, highest + spread};
}

static void bound_events(void *context, double h, const double *left, const double *right,
                         mstmm_bounds *bounds)
{
    mstmm_scene_run *run = context;
    const mstmm_model *model = run->model;
    mstmm_bounds *slots = run->bounds, *points = slots + 1 + model->nq + model->nu;
    mstmm_bounds *inputs = points + 6 * run->n_probes;
    slots[0] = (mstmm_bounds){left[0], right[0], 1.0, 1.0};
    for (int k = 0; k < run->n_read; k++) {
        const double *a = left + 1 + 2 * k, *b = right + 1 + 2 * k;
        slots[1 + run->read[k]] = quantity_bounds(h, a[0], b[0], a[1], b[1]);
    }
    for (int k = 0; k < run->n_probes; k++) {
        const double *a = left + first_probe(run) + PROBE * k, *b = right + (a - left);
        for (int j = 0; j < (run->later ? 6 : 3); j++)
            points[6 * k + j] = quantity_bounds(h, a[j], b[j], a[j + 3], b[j + 3]);
    }
    for (int k = 0; k < n_inputs(run); k++) {
        const double number = left[first_input(run) + k];
        inputs[k] = (mstmm_bounds){number, number, 0.0, 0.0};
    }
    mstmm_tape_bounds(run->event_tape, slots, bounds);
}

void mstmm_enclose_events(mstmm_scene_run *run, mstmm_system *system)
{
    if (!run->bounds) return;
    system->n_seen = first_input(run) + n_inputs(run);
    system->see = record_quantities;
    system->enclose = bound_events;
}
