/* Steps of the classical discrete-time method: predictor, linear solutions, correction.
 *
 * Integration schemes: Newmark, HHT and generalised-alpha by auxiliary accelerations a (Chung,
 * Hulbert, J. Appl. Mech. 60 (1993); Arnold, Bruls, Multibody Syst. Dyn. 18 (2007)), and Wilson's
 * method, which makes Newmark's step of linear acceleration theta times as long and goes back.  In
 * space the map acts on the rotation vector of the step, the angular velocity and its rate in the
 * frame's axes; the tangent operator joins it with the small turns of the matrices.  The predictor
 * keeps the accelerations, which errs by the third power of the step. */
#include <math.h>
#include <string.h>

#include "parts.h"

#define ANGLE 3
#define FAR 1 /* size of the scene, or rad: a larger correction is invalid */

static const real NONE[3] = {0};

size_t mstmm_classical_work_size(int n_bodies) { return (size_t)n_bodies * sizeof(element); }

static int coordinates_of(const step_record *step, int index)
{
    return step->rigid + modes_of(step, index);
}

static void set_rotation(const step_record *step, int index)
{
    element *one = &step->elements[index];
    motion *at = &step->run->motions[index];
    real rotation[9];
    if (step->run->planar) return;
    classical_exponential(at->position + ANGLE, rotation);
    classical_multiply(3, 3, 3, one->start.axes, rotation, at->axes);
    classical_inverse_tangent(step->run->turning ? at->position + ANGLE : NONE, one->turning);
}

/* Motion at the end of a step of `h` with the accelerations of its start. */
static void predict(const step_record *step, int index, double h)
{
    const mstmm_classical_scheme *scheme = &step->run->scheme;
    const motion *start = &step->elements[index].start;
    motion *at = &step->run->motions[index];
    for (int i = 0; i < coordinates_of(step, index); i++) {
        const real a = start->auxiliary[i], rate = start->rate[i];
        const real next = (rate - scheme->alpha_m * a) / (1 - scheme->alpha_m);
        at->auxiliary[i] = next;
        at->speed[i] = start->speed[i] + h * ((1 - scheme->gamma) * a + scheme->gamma * next);
        at->position[i] = start->position[i] + h * start->speed[i] +
                          h * h * ((0.5 - scheme->beta) * a + scheme->beta * next);
    }
    set_rotation(step, index);
}

/* Adopts the solution's positions; returns its largest change, relative to size, or in rad. */
static real correct(const step_record *step, int index)
{
    const run_record *run = step->run;
    const element *one = &step->elements[index];
    motion *at = &run->motions[index];
    const int count = coordinates_of(step, index), modes = modes_of(step, index);
    real change[MSTMM_CLASSICAL_COORDINATES], largest = 0;
    for (int i = 0; i < step->shifts; i++) change[i] = one->state[i] - at->position[i];
    for (int k = 0; k < modes; k++)
        change[step->rigid + k] = one->state[2 * step->rigid + k] - at->position[step->rigid + k];
    if (run->planar) {
        change[2] = one->state[2] - at->position[2];
    } else {
        real turn[3];
        for (int i = 0; i < 3; i++) {
            turn[i] = 0;
            for (int k = 0; k < 3; k++) turn[i] += at->axes[3 * k + i] * one->state[ANGLE + k];
        }
        classical_multiply(3, 3, 1, one->turning, turn, change + ANGLE);
    }
    for (int i = 0; i < count; i++) {
        const int turns = i >= step->shifts && i < step->rigid;
        at->position[i] += change[i];
        at->speed[i] += step->map.c * change[i];
        at->rate[i] += step->map.a * change[i];
        at->auxiliary[i] += step->map.e * change[i];
        largest = fmax(largest, fabs(change[i]) / (turns ? 1 : run->size));
        if (!isfinite(at->rate[i])) largest = INFINITY;
    }
    set_rotation(step, index);
    return largest;
}

/* Wilson's method: from the end of the longer step back to that of the step. */
static void return_from_theta(const step_record *step, int index, double h)
{
    const motion *start = &step->elements[index].start;
    motion *at = &step->run->motions[index];
    for (int i = 0; i < coordinates_of(step, index); i++) {
        const real before = start->rate[i];
        const real after = before + (at->rate[i] - before) / step->run->scheme.theta;
        at->rate[i] = at->auxiliary[i] = after;
        at->speed[i] = start->speed[i] + h / 2 * (before + after);
        at->position[i] =
            start->position[i] + h * start->speed[i] + h * h / 6 * (2 * before + after);
    }
    set_rotation(step, index);
}

/* Position gap of the hinge of a body, relative to size. */
static real hinge_gap(const step_record *step, int index)
{
    const int hinge = step->run->bodies[index].hinge;
    const motion *at = &step->run->motions[index];
    if (hinge != MSTMM_CLASSICAL_FIXED && hinge != MSTMM_CLASSICAL_PIN &&
        hinge != MSTMM_CLASSICAL_BALL)
        return 0;
    const section held = classical_section(step, index);
    real gap = 0;
    for (int i = 0; i < step->shifts; i++) gap = hypot(gap, at->position[i] - held.position[i]);
    return gap / step->run->size;
}

static int solve_step(const step_record *step)
{
    step->run->solutions++;
    if (step->run->product ? classical_product(step) : classical_riccati(step)) return 1;
    return classical_outward(step);
}

static int iterate_step(const step_record *step)
{
    run_record *run = step->run;
    const int most = run->step > 0 ? run->iterations : run->iterations + 2;
    int farthest = 0;
    real largest = 0;
    for (int k = 0; k < most; k++) {
        largest = 0;
        if (solve_step(step)) return 1;
        for (int i = 0; i < run->n_bodies; i++) {
            const real change = correct(step, i);
            if (!isfinite(change)) return fail(run, MSTMM_CLASSICAL_NOT_FINITE, i);
            if (change > largest) farthest = i;
            largest = fmax(largest, change);
        }
        if (largest <= run->tolerance) return 0;
    }
    if (run->iterations > 1) return fail(run, MSTMM_CLASSICAL_UNSETTLED, 0);
    return largest > FAR ? fail(run, MSTMM_CLASSICAL_FAR, farthest) : 0;
}

static int one_step(run_record *run, double h)
{
    const mstmm_classical_scheme *scheme = &run->scheme;
    const double length = scheme->theta * h, weight = scheme->beta * length * length;
    const step_record step = {run,
                              (element *)run->work,
                              {(1 - scheme->alpha_m) / ((1 - scheme->alpha_f) * weight),
                               scheme->gamma / (scheme->beta * length), 1 / weight},
                              run->planar ? 2 : 3,
                              run->planar ? 1 : 3,
                              run->planar ? 3 : 6};
    for (int i = 0; i < run->n_bodies; i++) {
        motion *start = &step.elements[i].start;
        *start = run->motions[i];
        for (int k = 0; k < MSTMM_CLASSICAL_COORDINATES && run->step > 0; k++)
            start->auxiliary[k] =
                start->rate[k] + (start->auxiliary[k] - start->rate[k]) * h / run->step;
        if (!run->planar) memset(start->position + ANGLE, 0, 3 * sizeof(real));
        predict(&step, i, length);
    }
    if (iterate_step(&step)) return 1;
    for (int i = 0; i < run->n_bodies; i++) {
        if (scheme->theta > 1) return_from_theta(&step, i, h);
        if (!(hinge_gap(&step, i) <= run->gap)) return fail(run, MSTMM_CLASSICAL_OPEN, i);
    }
    run->step = h;
    return 0;
}

int64_t mstmm_classical_advance(mstmm_classical_run *run, int64_t count, double h,
                                mstmm_classical_motion *samples)
{
    for (int64_t k = 0; k < count; k++) {
        if (one_step(run, h)) return k;
        memcpy(samples + k * run->n_bodies, run->motions,
               (size_t)run->n_bodies * sizeof *run->motions);
    }
    return count;
}
