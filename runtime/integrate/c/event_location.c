/* Location of the first event or switch inside a step, on the dense output. */
#include <math.h>
#include <string.h>

#include "step.h"

/* Times in a step at which events are evaluated.  A step that starts with a fired event is
 * evaluated soon after its start too, since the event may become true again quickly (a small
 * bounce). */
static const double places[] = {0x1p-20, 0x1p-14, 0x1p-9, 0x1p-5, 0.125, 0.25, 0.5, 0.75, 1.0};
/* A condition is narrow where its bounds above values nearby are so far, as part of those of the
 * whole step. */
static const double NARROW = 1e-6, FINEST = 0x1p-40; /* part of a step, at least */
enum { N_PLACES = sizeof places / sizeof *places, FIRST_REGULAR = 5 };

int mstmm_event_values(const mstmm_work *work, double t, const double *y, double *g)
{
    const mstmm_system *system = work->system;
    const int code = system->events(system->context, t, y, g);
    if (code) return mstmm_note(work->run, MSTMM_EVENT_FAILED, code, -1, t);
    for (int i = 0; i < system->n_events; i++)
        if (isnan(g[i])) {
            work->run->count.event = i;
            return mstmm_note(work->run, MSTMM_EVENT_FAILED, 0, -1, t);
        }
    for (int i = system->n_events; i < mstmm_n_watched(system); i++)
        g[i] = isnan(g[i]) ? -1.0 : g[i] * work->side[i];
    return 0;
}

/* Side of a switch at the start of a step.  A switch that is zero is watched once it has left
 * zero. */
static void set_sides(const mstmm_work *work, double *g)
{
    for (int i = work->system->n_events; i < mstmm_n_watched(work->system); i++) {
        if (g[i] > 0.0) {
            work->side[i] = -work->side[i];
            g[i] = -g[i];
        }
        if (work->truth[i] != UNWATCHED) work->truth[i] = g[i] < 0.0 ? UNTRUE : HOLDS;
    }
}

/* The events at a time inside the trial step */
static int evaluate_events(const mstmm_work *work, double t, double *g)
{
    mstmm_dense(work, t, work->y_stage);
    return mstmm_event_values(work, t, work->y_stage, g);
}

/* The same, and the quantities that the conditions read there, to row `place` of the records. */
enum { LEFT, RIGHT, MIDDLE };
static double *seen_row(const mstmm_work *work, int place)
{
    return work->seen + place * work->seen_row;
}
static int look_at(const mstmm_work *work, double t, double *g, int place)
{
    const int status = evaluate_events(work, t, g);
    if (status || !work->system->n_seen) return status;
    mstmm_dense_rates(work, t, work->rates);
    work->system->see(work->system->context, t, work->y_stage, work->rates, seen_row(work, place));
    return 0;
}
static void move_seen(const mstmm_work *work, int from, int to)
{
    memcpy(seen_row(work, to), seen_row(work, from), (size_t)work->seen_row * sizeof(double));
}

/* Distance of neighbouring numbers around the step: what "located to rounding" means */
static double resolution(const mstmm_run *run)
{
    const double largest = fmax(fabs(run->real.t), fabs(run->real.t_new));
    return nextafter(largest, INFINITY) - largest;
}

/* An event is true where g >= 0; a switch is on its other side where g > 0, so that the branch that
 * begins with a strict inequality has begun. */
static int is_reached(const mstmm_work *work, int i, double g)
{
    return g > 0.0 || (g == 0.0 && i < work->system->n_events);
}

/* Event i is false at `left` and true at `right`: closes the bracket to rounding by the
 * Illinois rule, with a bisection whenever two steps did not halve it.  *root is on the true
 * side. */
static int locate(const mstmm_work *work, int i, double left, double g_left, double right,
                  double g_right, double *root)
{
    double width_before = INFINITY;
    int side = 0, slow = 0;
    const double fine = resolution(work->run);
    while (right - left > fine) {
        const double width = right - left, inset = fmin(4.0 * fine, 0.5 * width);
        double t = left + width * (g_left / (g_left - g_right));
        slow = width > 0.5 * width_before ? slow + 1 : 0;
        width_before = width;
        if (slow >= 2 || !(t > left - width && t < right + width)) {
            t = left + 0.5 * width;
            slow = 0;
        }
        t = fmin(fmax(t, left + inset), right - inset);
        if (!(t > left && t < right)) break;
        const int status = evaluate_events(work, t, work->g_trial);
        if (status) return status;
        const double g = work->g_trial[i];
        if (is_reached(work, i, g)) {
            right = t;
            g_right = g;
            if (side == 1) g_left *= 0.5;
            side = 1;
        } else {
            left = t;
            g_left = g;
            if (side == -1) g_right *= 0.5;
            side = -1;
        }
    }
    *root = right;
    return 0;
}

/* A maximum between samples that are all false: does the parabola through three of them rise far
 * enough?  Then evaluates a few times, and locates the event if there is one. */
static int search_maximum(const mstmm_work *work, int i, const double *at, const double *g,
                          double *root)
{
    double t[3] = {at[0], at[1], at[2]}, v[3] = {g[0], g[1], g[2]};
    for (int trial = 0; trial < 4; trial++) {
        const double d0 = t[0] - t[1], d2 = t[2] - t[1];
        const double s0 = (v[0] - v[1]) / d0, s2 = (v[2] - v[1]) / d2;
        const double curvature = (s2 - s0) / (d2 - d0), slope = s0 - curvature * d0;
        const double d = -0.5 * slope / curvature, rise = 0.5 * slope * d;
        const double x = t[1] + d, peak = v[1] + rise, low = fmin(v[1], fmin(v[0], v[2]));
        if (!(curvature < 0.0) || !(x > t[0] && x < t[2]) || x == t[1] ||
            !(peak + 0.5 * (peak - low) >= 0.0))
            return 0;
        const int status = evaluate_events(work, x, work->g_trial);
        if (status) return status;
        const double value = work->g_trial[i];
        if (is_reached(work, i, value))
            return locate(work, i, x < t[1] ? t[0] : t[1], x < t[1] ? v[0] : v[1], x, value, root);
        const int upper = value > v[1] ? x > t[1] : x < t[1]; /* which neighbour to replace */
        const int middle = value > v[1];
        if (upper) {
            t[0] = middle ? t[1] : x;
            v[0] = middle ? v[1] : value;
        } else {
            t[2] = middle ? t[1] : x;
            v[2] = middle ? v[1] : value;
        }
        if (middle) {
            t[1] = x;
            v[1] = value;
        }
    }
    return 0;
}

/* ---- between two evaluations ---- */

/* An end of a part of a step: its time, and the value of event or switch i there */
typedef struct border {
    double t, g;
} border;

enum { NOTHING_THERE, ONE_CROSSING, OPEN };

/* Whether the part between two ends with the bounds `bounded`, the left one false, is clear */
static int is_part_clear(const mstmm_work *work, int i, const mstmm_bounds *bounded,
                         const border *left, const border *right, double *highest)
{
    const double h = right->t - left->t;
    const int turned = i >= work->system->n_events && work->side[i] < 0.0;
    const double s0 = turned ? -bounded->slope_hi : bounded->slope_lo;
    const double s1 = turned ? -bounded->slope_lo : bounded->slope_hi;
    *highest = turned ? -bounded->lo : bounded->hi;
    if (isfinite(s0) && isfinite(s1) && s1 > s0) { /* lines from both ends with these slopes meet */
        const double at = (right->g - left->g - s0 * h) / (s1 - s0);
        *highest = fmin(*highest, left->g + s1 * fmin(fmax(at, 0.0), h));
    }
    if (is_reached(work, i, right->g)) return s0 >= 0.0 ? ONE_CROSSING : OPEN;
    return *highest < 0.0 || s0 >= 0.0 || s1 <= 0.0 ? NOTHING_THERE : OPEN;
}

/* Maximum number of evaluations within a part of a step, before and after a possible miss */
enum { MOST_LOOKS = 4000, FEW_LOOKS = 64 };

/* An event may be missed in parts that are not examined further. */
static void note_unseen(mstmm_run *run, int i, double t)
{
    if (run->count.unseen >= 0) return;
    run->count.unseen = i;
    run->real.unseen_time = t;
}

/* Halves undecided parts between left and right, and locates the first time at which event or
 * switch i is true; *root is unchanged if there is none.  Rows LEFT and RIGHT of the records are
 * those of the two ends. */
static int search_root(const mstmm_work *work, int i, border left, border right, double *root)
{
    const mstmm_system *system = work->system;
    const double fine = fmax(4.0 * resolution(work->run), FINEST * (right.t - left.t));
    border ends[MSTMM_DEPTH + 1] = {right};
    mstmm_bounds kept;
    double highest, first_width = INFINITY;
    int at = MIDDLE, top = 0; /* the row of the left end; ends[k] is seen in row MIDDLE + 1 + k */
    move_seen(work, LEFT, MIDDLE);
    move_seen(work, RIGHT, MIDDLE + 1);
    const int most = work->run->count.unseen < 0 ? MOST_LOOKS : FEW_LOOKS;
    for (int taken = 0; top >= 0;) {
        const border *to = &ends[top];
        const double width = to->t - left.t;
        system->enclose(system->context, width, seen_row(work, at),
                        seen_row(work, MIDDLE + 1 + top), work->bounds);
        kept = work->bounds[i];
        if (first_width == INFINITY) first_width = kept.hi - kept.lo;
        const int found = is_part_clear(work, i, &kept, &left, to, &highest);
        const int closed = width <= fine || top == MSTMM_DEPTH - 1;
        const int enough = found == OPEN && !closed && taken >= most;
        const int crosses = is_reached(work, i, to->g);
        if (crosses && (found == ONE_CROSSING || closed || enough)) {
            if (enough) note_unseen(work->run, i, left.t);
            return locate(work, i, left.t, left.g, to->t, to->g, root);
        }
        if (found == NOTHING_THERE || closed || enough) {
            const double above = fmax(left.g, to->g);
            if (found == OPEN && (enough || highest - above > NARROW * first_width))
                note_unseen(work->run, i, left.t);
            left = *to;
            move_seen(work, MIDDLE + 1 + top, at);
            top--;
            continue;
        }
        const double middle = left.t + 0.5 * width;
        const int status = look_at(work, middle, work->g_trial, MIDDLE + 2 + top);
        if (status) return status;
        taken++;
        ends[++top] = (border){middle, work->g_trial[i]};
    }
    return 0;
}

/* Numbers `first` to `last` of what is watched, between `left` (values g_left, and g_before at
 * `before`) and `right` (values g_right): sets the earliest. */
static int find_first_event(const mstmm_work *work, int first, int last, const double *at)
{
    mstmm_run *run = work->run;
    mstmm_bounds *bounds = work->first_bounds;
    if (work->system->n_seen && last > first)
        work->system->enclose(work->system->context, at[2] - at[1], seen_row(work, LEFT),
                              seen_row(work, RIGHT), bounds);
    for (int i = first; i < last; i++) {
        const double g[3] = {work->g_before[i], work->g_left[i], work->g_right[i]};
        double root = INFINITY;
        int status = 0;
        if (work->truth[i] != UNTRUE) continue;
        if (work->system->n_seen) {
            double highest;
            const border left = {at[1], g[1]}, right = {at[2], g[2]};
            const int found = is_part_clear(work, i, &bounds[i], &left, &right, &highest);
            if (found == ONE_CROSSING)
                status = locate(work, i, at[1], g[1], at[2], g[2], &root);
            else if (found == OPEN)
                status = search_root(work, i, left, right, &root);
        } else if (is_reached(work, i, g[2]))
            status = locate(work, i, at[1], g[1], at[2], g[2], &root);
        else if (at[0] < at[1] && g[0] < 0.0 && g[1] < 0.0)
            status = search_maximum(work, i, at, g, &root);
        if (status) return status;
        if (root < run->real.t_stop || (root == run->real.t_stop && run->count.event < 0)) {
            run->real.t_stop = root;
            run->count.event = i;
        }
    }
    return 0;
}

/* At t_scan itself: an event that another one, fired here without effect, had hidden. */
static int find_pending(const mstmm_work *work)
{
    mstmm_run *run = work->run;
    const int status = look_at(work, run->real.t_scan, work->g_left, LEFT);
    for (int i = 0; i < work->system->n_events && !status; i++)
        if (work->truth[i] == UNTRUE && work->g_left[i] >= 0.0) {
            run->real.t_stop = run->real.t_scan;
            run->count.event = i;
            break;
        }
    return status;
}

static void learn_events(const mstmm_work *work, const double *g)
{
    for (int i = 0; i < work->system->n_events; i++)
        if (work->truth[i] != UNWATCHED) work->truth[i] = g[i] >= 0.0 ? HOLDS : UNTRUE;
}

/* A switch that started at zero has left it, to either side. */
static void learn_switches(const mstmm_work *work, const double *g)
{
    for (int i = work->system->n_events; i < mstmm_n_watched(work->system); i++)
        if (work->truth[i] == HOLDS && g[i] != 0.0) {
            if (g[i] > 0.0) work->side[i] = -work->side[i];
            work->truth[i] = UNTRUE;
        }
}

/* Evaluates at the times after `left` up to `end` until one of the events is found. */
static int scan_times(const mstmm_work *work, int first, int last, double left, double end,
                      void (*learn)(const mstmm_work *, const double *))
{
    mstmm_run *run = work->run;
    const size_t bytes = (size_t)mstmm_n_watched(work->system) * sizeof(double);
    double before = left;
    int status = 0;
    memcpy(work->g_before, work->g_left, bytes);
    for (int j = run->count.restarted ? 0 : FIRST_REGULAR; j < N_PLACES && !status; j++) {
        const double place =
            places[j] == 1.0 ? run->real.t_new : run->real.t + places[j] * run->real.h;
        const double right = fmin(place, end), at[3] = {before, left, right};
        if (right <= left) continue;
        status = look_at(work, right, work->g_right, RIGHT);
        if (!status) status = find_first_event(work, first, last, at);
        if (status || run->count.event >= 0) break;
        learn(work, work->g_right);
        memcpy(work->g_before, work->g_left, bytes);
        memcpy(work->g_left, work->g_right, bytes);
        if (work->system->n_seen) move_seen(work, RIGHT, LEFT);
        before = left;
        left = right;
        if (first == 0) run->real.t_scan = right;
    }
    return status;
}

/* The first switch in the step, to t_switch. */
static int find_switch(const mstmm_work *work)
{
    mstmm_run *run = work->run;
    const int n = work->system->n_events;
    int status = look_at(work, run->real.t, work->g_left, LEFT);
    if (!status) {
        set_sides(work, work->g_left);
        status = scan_times(work, n, mstmm_n_watched(work->system), run->real.t, run->real.t_new,
                            learn_switches);
    }
    if (status) return status; /* of the event that failed */
    if (run->count.event >= 0) {
        run->real.t_switch = run->real.t_stop;
        run->count.next_switch = run->count.event;
    }
    run->real.t_stop = run->real.t_new;
    run->count.event = -1;
    return 0;
}

int mstmm_find_switch(const mstmm_work *work)
{
    mstmm_run *run = work->run;
    run->real.t_stop = run->real.t_new;
    run->real.t_switch = INFINITY;
    run->count.event = -1;
    return work->system->n_switches ? find_switch(work) : 0;
}

/* A bounce needs an approach: a motion that was at the event when the step began has none. */
static int check_let_through(const mstmm_work *work)
{
    mstmm_run *run = work->run;
    const mstmm_system *system = work->system;
    const double t = run->real.t_stop;
    for (int i = 0; system->lets_through && i < system->n_events; i++) {
        if (work->truth[i] != HOLDS || !(work->g_left[i] > 0.0)) continue;
        mstmm_dense(work, t, work->y_stage);
        if (!system->lets_through(system->context, i, t, work->y_stage, work->g_left[i])) continue;
        run->count.event = i;
        return mstmm_note(run, MSTMM_LET_THROUGH, 0, -1, t);
    }
    return 0;
}

int mstmm_scan(const mstmm_work *work)
{
    mstmm_run *run = work->run;
    int status = 0;
    run->real.t_stop = fmin(run->real.t_new, run->real.t_switch);
    run->count.event = -1;
    if (work->system->n_events) {
        status = find_pending(work);
        if (!status && run->count.event < 0)
            status = scan_times(work, 0, work->system->n_events, run->real.t_scan, run->real.t_stop,
                                learn_events);
        if (!status && run->count.event < 0) status = check_let_through(work);
    }
    if (!status && run->count.event < 0 && run->real.t_switch <= run->real.t_new)
        run->count.event = run->count.next_switch;
    return status;
}
