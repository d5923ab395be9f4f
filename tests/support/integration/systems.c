/* Small systems with known solutions, for the tests of the time integration alone. */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "systems.h"

static int harmonic(void *context, double t, const double *y, double *dy)
{
    const double *p = ((parameters *)context)->p; /* omega, zeta */
    (void)t;
    dy[0] = y[1];
    dy[1] = -p[0] * p[0] * y[0] - 2.0 * p[1] * p[0] * y[1];
    return 0;
}

/* y' = y cos t and y' = -2 t y^2: not autonomous, so that the nodes c are tested too */
static int mixed(void *context, double t, const double *y, double *dy)
{
    (void)context;
    dy[0] = y[0] * cos(t);
    dy[1] = -2.0 * t * y[1] * y[1];
    return 0;
}

static int arenstorf(void *context, double t, const double *y, double *dy)
{
    const double mu = 0.012277471, nu = 1.0 - mu;
    const double r1 = pow((y[0] + mu) * (y[0] + mu) + y[1] * y[1], 1.5);
    const double r2 = pow((y[0] - nu) * (y[0] - nu) + y[1] * y[1], 1.5);
    (void)context;
    (void)t;
    dy[0] = y[2];
    dy[1] = y[3];
    dy[2] = y[0] + 2.0 * y[3] - nu * (y[0] + mu) / r1 - mu * (y[0] - nu) / r2;
    dy[3] = y[1] - 2.0 * y[2] - nu * y[1] / r1 - mu * y[1] / r2;
    return 0;
}

static int van_der_pol(void *context, double t, const double *y, double *dy)
{
    const double mu = ((parameters *)context)->p[0];
    (void)t;
    dy[0] = y[1];
    dy[1] = mu * (1.0 - y[0] * y[0]) * y[1] - y[0];
    return 0;
}

/* y' = cos t before p[0], y' = y after it: counts on never being asked at p[0] itself */
static int piecewise(void *context, double t, const double *y, double *dy)
{
    parameters *at = context;
    dy[0] = t < at->p[0] ? cos(t) : y[0];
    if (t == at->p[0]) at->calls++;
    return 0;
}

/* A quaternion turning at p[0], p[1], p[2] in its own axes, used normalised */
static int turning(void *context, double t, const double *y, double *dy)
{
    const double *w = ((parameters *)context)->p;
    const double r = 0.5 / sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2] + y[3] * y[3]);
    (void)t;
    dy[0] = r * (-y[1] * w[0] - y[2] * w[1] - y[3] * w[2]);
    dy[1] = r * (y[0] * w[0] + y[2] * w[2] - y[3] * w[1]);
    dy[2] = r * (y[0] * w[1] - y[1] * w[2] + y[3] * w[0]);
    dy[3] = r * (y[0] * w[2] + y[1] * w[1] - y[2] * w[0]);
    return 0;
}

static int normalise(void *context, double t, double *y)
{
    const double r = 1.0 / sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2] + y[3] * y[3]);
    (void)context;
    (void)t;
    for (int i = 0; i < 4; i++) y[i] *= r;
    return 0;
}

static int growth(void *context, double t, const double *y, double *dy)
{
    (void)t;
    dy[0] = ((parameters *)context)->p[0] * y[0];
    dy[1] = 0.0;
    return 0;
}

static int blow_up(void *context, double t, const double *y, double *dy)
{
    (void)context;
    (void)t;
    dy[0] = 0.0;
    dy[1] = y[1] * y[1];
    return 0;
}

/* y' = 1; fails with code 7 beyond t = p[0], or gives NaN there if p[1] is set */
static int failing(void *context, double t, const double *y, double *dy)
{
    const double *p = ((parameters *)context)->p;
    (void)y;
    dy[0] = 1.0;
    dy[1] = t > p[0] && p[1] != 0.0 ? NAN : 0.0;
    return t > p[0] && p[1] == 0.0 ? 7 : 0;
}

static int falling(void *context, double t, const double *y, double *dy)
{
    (void)context;
    (void)t;
    dy[0] = y[1];
    dy[1] = -9.81;
    (void)y;
    return 0;
}

static int below_ground(void *context, double t, const double *y, double *g)
{
    (void)context;
    (void)t;
    g[0] = -y[0];
    return 0;
}

/* memory[0] counts the bounces; p[0] = restitution, p[1] = answer of fire, 0 for the usual one */
static int bounce(void *context, int event, double t, double *y)
{
    parameters *at = context;
    (void)event;
    (void)t;
    at->memory[0] += 1.0;
    if (at->p[1] != 0.0) return (int)at->p[1];
    y[1] = -at->p[0] * y[1];
    return MSTMM_FIRE_RESTART;
}

/* Three thresholds: y1 >= p[3], t >= p[4], y0 >= p[5] */
static int three_events(void *context, double t, const double *y, double *g)
{
    const double *p = ((parameters *)context)->p;
    g[0] = y[1] - p[3];
    g[1] = t - p[4];
    g[2] = y[0] - p[5];
    return 0;
}

/* Appends the event's number, counted from 1, to `calls` as a digit; answers p[6] */
static int log_fire(void *context, int event, double t, double *y)
{
    parameters *at = context;
    (void)t;
    (void)y;
    at->calls = 10 * at->calls + event + 1;
    return (int)at->p[6];
}

static int count_accepts(void *context, double t, double *y)
{
    parameters *at = context;
    (void)t;
    (void)y;
    at->memory[1] += 1.0;
    return at->p[7] != 0.0 ? (int)at->p[7] : 0;
}

/* p[0] = omega, zeta = p[1], tied to a slow oscillator of frequency 1 */
static int stiff_spring(void *context, double t, const double *y, double *dy)
{
    const double *p = ((parameters *)context)->p;
    (void)t;
    dy[0] = y[1];
    dy[1] = -y[0];
    dy[2] = y[3];
    dy[3] = -p[0] * p[0] * (y[2] - y[0]) - 2.0 * p[1] * p[0] * y[3];
    return 0;
}

/* y = (x, work of a force cos t): the quadrature y' = x cos t does not steer the step */
static int quadrature(void *context, double t, const double *y, double *dy)
{
    (void)context;
    dy[0] = -y[0];
    dy[1] = 1e6 * y[0] * cos(50.0 * t);
    return 0;
}

static int linear_many(void *context, double t, const double *y, double *dy)
{
    const int n = (int)((parameters *)context)->p[0];
    (void)t;
    for (int i = 0; i < n; i++) dy[i] = -y[i] * (1.0 + (double)i / n);
    return 0;
}

/* y' = y without arithmetic: what is left is the cost of the loop */
static int nothing(void *context, double t, const double *y, double *dy)
{
    const int n = (int)((parameters *)context)->p[0];
    (void)t;
    memcpy(dy, y, (size_t)n * sizeof *dy);
    return 0;
}

typedef int (*rhs_function)(void *, double, const double *, double *);
typedef struct named {
    const char *name;
    rhs_function rhs;
} named;

parameters *test_parameters(void);
int test_fill(mstmm_system *system, parameters *at, const char *rhs, int n, int n_error);
void test_use_bounce(mstmm_system *system, parameters *at);
void test_use_three(mstmm_system *system, parameters *at);
void test_use_normalise(mstmm_system *system);
void test_use_accept(mstmm_system *system, parameters *at);
void test_use_lanes(mstmm_system *system, parameters *at, int lanes);

parameters *test_parameters(void) { return calloc(1, sizeof(parameters)); }

int test_fill(mstmm_system *system, parameters *at, const char *rhs, int n, int n_error)
{
    static const named all[] = {
        {"harmonic", harmonic},       {"mixed", mixed},         {"arenstorf", arenstorf},
        {"van_der_pol", van_der_pol}, {"piecewise", piecewise}, {"growth", growth},
        {"blow_up", blow_up},         {"failing", failing},     {"falling", falling},
        {"linear_many", linear_many}, {"nothing", nothing},     {"stiff_spring", stiff_spring},
        {"quadrature", quadrature},   {"turning", turning},
    };
    memset(system, 0, sizeof *system);
    system->context = at;
    system->n_state = n;
    system->n_error = n_error;
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        if (!strcmp(all[i].name, rhs)) system->rhs = all[i].rhs;
    return system->rhs ? 0 : -1;
}

void test_use_bounce(mstmm_system *system, parameters *at)
{
    system->n_events = 1;
    system->events = below_ground;
    system->fire = bounce;
    system->n_memory = 2;
    system->memory = at->memory;
}

void test_use_three(mstmm_system *system, parameters *at)
{
    system->n_events = 3;
    system->events = three_events;
    system->fire = log_fire;
    system->n_memory = 2;
    system->memory = at->memory;
}

void test_use_normalise(mstmm_system *system) { system->accept = normalise; }

void test_use_accept(mstmm_system *system, parameters *at)
{
    system->accept = count_accepts;
    system->n_memory = 2;
    system->memory = at->memory;
}

/* One lane after the other, by the right-hand side of single states */
static int in_lanes(void *context, const double *t, const double *y, double *dy, int *codes)
{
    const mstmm_system *system = ((parameters *)context)->system;
    const int n = system->n_state, lanes = system->lanes;
    double one[64], slope[64];
    int failed = 0;
    for (int lane = 0; lane < lanes; lane++) {
        for (int i = 0; i < n; i++) one[i] = y[i * lanes + lane];
        codes[lane] = system->rhs(context, t[lane], one, slope);
        for (int i = 0; i < n; i++) dy[i * lanes + lane] = slope[i];
        failed |= codes[lane] != 0;
    }
    return failed;
}

void test_use_lanes(mstmm_system *system, parameters *at, int lanes)
{
    at->system = system;
    system->lanes = lanes;
    system->rhs_lanes = lanes ? in_lanes : NULL;
}
