/* Small mechanical systems for implicit methods.  Each is a residual and the rates of its coordinates
 * in complex numbers: slopes come out of steps of 1e-30 along the imaginary axis, exact to rounding,
 * and are solved as dense systems, so that nothing is shared with how scenes do it. */
#include <complex.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "systems.h"

enum { MOST = 12 }; /* coordinates and speeds together, and speeds once more */
static const double TINY = 1e-30;

typedef double complex number;

typedef struct sort {
    const char *name;
    int n_q, n_u, n_rest;
    /* r (n_u) and rates of the quadratures at (t, q, u, a) */
    void (*residual)(const double *p, number t, const number *q, const number *u, const number *a,
                     number *r, number *rest);
    void (*rates)(const number *q, const number *u, number *dq);
    /* q, u and a of the speeds before `imposed` at t; NULL: none */
    void (*impose)(const double *p, number t, number *q, number *u, number *a);
    int imposed;
} sort;

typedef struct mechanism {
    parameters at; /* first: the functions of systems.c look there */
    const sort *kind;
    mstmm_implicit implicit;
    double s, sq;
    int kappa;
    double z[MOST * MOST], k[MOST * MOST], c[MOST * MOST],
        m[MOST * MOST]; /* M, C, K, and their sum */
    double n[MOST * MOST], w[MOST * MOST], g[MOST * MOST]; /* N, W, slope of N u */
} mechanism;

/* ---- dense ---- */

/* a x = b by elimination with pivots; both are destroyed, x stands in b (n x columns) */
static int eliminate(int n, double *a, int columns, double *b)
{
    for (int j = 0; j < n; j++) {
        int pivot = j;
        for (int i = j + 1; i < n; i++)
            if (fabs(a[i * n + j]) > fabs(a[pivot * n + j])) pivot = i;
        if (!(fabs(a[pivot * n + j]) > 0.0)) return 1;
        for (int l = 0; l < n; l++) {
            const double x = a[j * n + l];
            a[j * n + l] = a[pivot * n + l];
            a[pivot * n + l] = x;
        }
        for (int l = 0; l < columns; l++) {
            const double x = b[j * columns + l];
            b[j * columns + l] = b[pivot * columns + l];
            b[pivot * columns + l] = x;
        }
        for (int i = 0; i < n; i++) {
            const double f = a[i * n + j] / a[j * n + j];
            if (i == j || f == 0.0) continue;
            for (int l = j; l < n; l++) a[i * n + l] -= f * a[j * n + l];
            for (int l = 0; l < columns; l++) b[i * columns + l] -= f * b[j * columns + l];
        }
    }
    for (int i = 0; i < n; i++)
        for (int l = 0; l < columns; l++) b[i * columns + l] /= a[i * n + i];
    return 0;
}

/* ---- a state in complex numbers ---- */

typedef struct point {
    number t, q[MOST], u[MOST], a[MOST], r[MOST], rest[MOST];
} point;

static point point_of(const mechanism *it, double t, const double *y, const double *a)
{
    const sort *kind = it->kind;
    point at = {.t = t};
    for (int i = 0; i < kind->n_q; i++) at.q[i] = y[i];
    for (int i = 0; i < kind->n_u; i++) {
        at.u[i] = y[kind->n_q + i];
        at.a[i] = a ? a[i] : 0.0;
    }
    return at;
}

/* The residual, with what is imposed filled in and its rows zero. */
static void residual_of(const mechanism *it, point *at)
{
    const sort *kind = it->kind;
    if (kind->impose) kind->impose(it->at.p, at->t, at->q, at->u, at->a);
    kind->residual(it->at.p, at->t, at->q, at->u, at->a, at->r, at->rest);
    for (int i = 0; i < kind->imposed; i++) at->r[i] = 0.0;
}

/* Slopes of the residual along each of n numbers at `x` inside a point. */
static void slopes(const mechanism *it, const point *base, size_t offset, int n, double *to)
{
    const int n_u = it->kind->n_u;
    for (int j = 0; j < n; j++) {
        point at = *base;
        *(number *)((char *)&at + offset + (size_t)j * sizeof(number)) += TINY * I;
        residual_of(it, &at);
        for (int i = 0; i < n_u; i++) to[i * n + j] = cimag(at.r[i]) / TINY;
    }
}

/* ---- what the time integration calls ---- */

static int residual(void *context, double t, const double *y, const double *a, double *r,
                    double *rest)
{
    mechanism *it = context;
    point at = point_of(it, t, y, a);
    residual_of(it, &at);
    it->at.calls++;
    for (int i = 0; i < it->kind->n_u; i++) r[i] = creal(at.r[i]);
    for (int i = 0; rest && i < it->kind->n_rest; i++) rest[i] = creal(at.rest[i]);
    return 0;
}

static int residual_rate(void *context, double t, const double *y, const double *a, double *r_t)
{
    mechanism *it = context;
    point at = point_of(it, t, y, a);
    at.t += TINY * I;
    residual_of(it, &at);
    for (int i = 0; i < it->kind->n_u; i++) r_t[i] = cimag(at.r[i]) / TINY;
    return 0;
}

static int rates(void *context, const double *q, const double *u, double *dq)
{
    const sort *kind = ((mechanism *)context)->kind;
    number x[MOST], v[MOST], dx[MOST];
    for (int i = 0; i < kind->n_q; i++) x[i] = q[i];
    for (int i = 0; i < kind->n_u; i++) v[i] = u[i];
    kind->rates(x, v, dx);
    for (int i = 0; i < kind->n_q; i++) dq[i] = i < kind->imposed ? 0.0 : creal(dx[i]);
    return 0;
}

static int impose(void *context, double t, double *y, double *a)
{
    const mechanism *it = context;
    const sort *kind = it->kind;
    point at = point_of(it, t, y, a);
    kind->impose(it->at.p, at.t, at.q, at.u, at.a);
    for (int i = 0; i < kind->imposed; i++) {
        y[i] = creal(at.q[i]);
        y[kind->n_q + i] = creal(at.u[i]);
        a[i] = creal(at.a[i]);
    }
    return 0;
}

/* N and the slope of N u */
static void kinematics(mechanism *it, const point *base)
{
    const sort *kind = it->kind;
    number dq[MOST];
    for (int j = 0; j < kind->n_u; j++) {
        number u[MOST];
        memcpy(u, base->u, sizeof u);
        u[j] += TINY * I;
        kind->rates(base->q, u, dq);
        for (int i = 0; i < kind->n_q; i++) it->n[i * kind->n_u + j] = cimag(dq[i]) / TINY;
    }
    for (int j = 0; j < kind->n_q; j++) {
        number q[MOST];
        memcpy(q, base->q, sizeof q);
        q[j] += TINY * I;
        kind->rates(q, base->u, dq);
        for (int i = 0; i < kind->n_q; i++) it->g[i * kind->n_q + j] = cimag(dq[i]) / TINY;
    }
}

/* x := (sq - kappa g)^-1 x, n_q x columns */
static int turn(const mechanism *it, int columns, double *x)
{
    const int n = it->kind->n_q;
    double a[MOST * MOST];
    for (int i = 0; i < n * n; i++) a[i] = (i % (n + 1) ? 0.0 : it->sq) - it->kappa * it->g[i];
    return eliminate(n, a, columns, x);
}

static int tangent(void *context, double t, const double *y, const double *a, double s, double sq,
                   int kappa)
{
    mechanism *it = context;
    const sort *kind = it->kind;
    const int n_q = kind->n_q, n_u = kind->n_u;
    if (it->at.memory[3] != 0.0 && t > it->at.p[7]) return (int)it->at.memory[3];
    const point base = point_of(it, t, y, a);
    slopes(it, &base, offsetof(point, q), n_q, it->k);
    slopes(it, &base, offsetof(point, u), n_u, it->c);
    slopes(it, &base, offsetof(point, a), n_u, it->m);
    kinematics(it, &base);
    it->s = s;
    it->sq = sq;
    it->kappa = kappa;
    memcpy(it->w, it->n, sizeof it->w);
    if (turn(it, n_u, it->w)) return 5;
    for (int i = 0; i < n_u; i++)
        for (int j = 0; j < n_u; j++) {
            double sum = it->c[i * n_u + j] + s * it->m[i * n_u + j];
            for (int l = 0; l < n_q; l++) sum += it->k[i * n_q + l] * it->w[l * n_u + j];
            if (i < kind->imposed || j < kind->imposed) sum = i == j;
            it->z[i * n_u + j] = sum;
        }
    return 0;
}

/* With q = W u + (sq - kappa g)^-1 rho_q and a = s u - rho_u */
static int solve(void *context, const double *r, const double *rho_q, const double *rho_u,
                 double *dq, double *du, double *da)
{
    mechanism *it = context;
    const sort *kind = it->kind;
    const int n_q = kind->n_q, n_u = kind->n_u;
    double z[MOST * MOST], own[MOST] = {0};
    for (int i = 0; rho_q && i < n_q; i++) own[i] = i < kind->imposed ? 0.0 : rho_q[i];
    if (turn(it, 1, own)) return 6;
    for (int i = 0; i < n_u; i++) {
        du[i] = i < kind->imposed ? 0.0 : r[i];
        if (i < kind->imposed) continue;
        for (int l = 0; l < n_q; l++) du[i] -= it->k[i * n_q + l] * own[l];
        for (int l = kind->imposed; rho_u && l < n_u; l++) du[i] += it->m[i * n_u + l] * rho_u[l];
    }
    memcpy(z, it->z, sizeof z);
    if (eliminate(n_u, z, 1, du)) return 7;
    for (int i = 0; i < n_q; i++) {
        dq[i] = own[i];
        for (int j = 0; j < n_u; j++) dq[i] += it->w[i * n_u + j] * du[j];
        if (i < kind->imposed) dq[i] = 0.0;
    }
    for (int i = 0; i < n_u; i++)
        da[i] = i < kind->imposed ? 0.0 : it->s * du[i] - (rho_u ? rho_u[i] : 0.0);
    return 0;
}

/* Along (dq, du): a step into the imaginary of the whole state */
static int slope(void *context, double t, const double *y, const double *a, const double *dq,
                 const double *du, double *d_rates, double *d_r)
{
    const mechanism *it = context;
    const sort *kind = it->kind;
    number rate[MOST];
    point at = point_of(it, t, y, a);
    for (int i = 0; i < kind->n_q; i++) at.q[i] += dq[i] * TINY * I;
    for (int i = 0; i < kind->n_u; i++) at.u[i] += du[i] * TINY * I;
    residual_of(it, &at);
    kind->rates(at.q, at.u, rate);
    for (int i = 0; i < kind->n_u; i++) d_r[i] = cimag(at.r[i]) / TINY;
    for (int i = 0; i < kind->n_q; i++)
        d_rates[i] = i < kind->imposed ? 0.0 : cimag(rate[i]) / TINY;
    return 0;
}

static int rhs(void *context, double t, const double *y, double *dy)
{
    mechanism *it = context;
    const sort *kind = it->kind;
    const int n_q = kind->n_q, n_u = kind->n_u;
    double m[MOST * MOST], a[MOST];
    point at = point_of(it, t, y, NULL);
    residual_of(it, &at);
    for (int i = 0; i < n_u; i++) a[i] = -creal(at.r[i]);
    const point base = point_of(it, t, y, NULL);
    slopes(it, &base, offsetof(point, a), n_u, m);
    for (int i = 0; i < kind->imposed; i++) {
        memset(m + i * n_u, 0, (size_t)n_u * sizeof *m);
        m[i * n_u + i] = 1.0;
        a[i] = creal(at.a[i]);
    }
    for (int i = kind->imposed; i < n_u; i++)
        for (int j = 0; j < kind->imposed; j++) m[i * n_u + j] = 0.0;
    if (eliminate(n_u, m, 1, a)) return 8;
    at = point_of(it, t, y, a);
    residual_of(it, &at);
    number dq[MOST];
    kind->rates(at.q, at.u, dq);
    for (int i = 0; i < n_q; i++) dy[i] = creal(dq[i]);
    for (int i = 0; i < n_u; i++) dy[n_q + i] = a[i];
    for (int i = 0; i < kind->n_rest; i++) dy[n_q + n_u + i] = creal(at.rest[i]);
    return 0;
}

/* ---- the systems ---- */

static void same(const number *q, const number *u, number *dq)
{
    (void)q;
    for (int i = 0; i < 3; i++) dq[i] = u[i];
}
static void same_one(const number *q, const number *u, number *dq)
{
    (void)q;
    dq[0] = u[0];
}
static void same_two(const number *q, const number *u, number *dq)
{
    (void)q;
    dq[0] = u[0];
    dq[1] = u[1];
}

/* Three masses of 1 kg in a row between springs p[0], ground to third, dampers p[1] and a force
 * p[2] cos(p[3] t) on the last; its work */
static void chain(const double *p, number t, const number *q, const number *u, const number *a,
                  number *r, number *rest)
{
    const number force = p[2] * ccos(p[3] * t);
    for (int i = 0; i < 3; i++) {
        const number q_in = i ? q[i - 1] : 0.0, u_in = i ? u[i - 1] : 0.0;
        r[i] = a[i] + p[0] * (q[i] - q_in) + p[1] * (u[i] - u_in);
        if (i < 2) r[i] -= p[0] * (q[i + 1] - q[i]) + p[1] * (u[i + 1] - u[i]);
    }
    r[2] -= force;
    rest[0] = force * u[2];
}

/* Two rods of 1 m and 1 kg on pins, angles from the horizontal, both absolute; springs p[0] and
 * dampers p[1] against the inner one; the work of the dampers */
static void pendulum(const double *p, number t, const number *q, const number *u, const number *a,
                     number *r, number *rest)
{
    const double g = 9.81;
    const number c = ccos(q[0] - q[1]), s = csin(q[0] - q[1]);
    const number moment = p[0] * (q[1] - q[0]) + p[1] * (u[1] - u[0]);
    (void)t;
    r[0] =
        4.0 / 3.0 * a[0] + 0.5 * c * a[1] + 0.5 * s * u[1] * u[1] + 1.5 * g * ccos(q[0]) - moment;
    r[1] = a[1] / 3.0 + 0.5 * c * a[0] - 0.5 * s * u[0] * u[0] + 0.5 * g * ccos(q[1]) + moment;
    rest[0] = -p[1] * (u[1] - u[0]) * (u[1] - u[0]);
}

/* 1 kg on a spring p[0] and damper p[1] whose foot moves as sin t, or as sin p[2] t where p[2] is set */
static void base(const double *p, number t, const number *q, const number *u, const number *a,
                 number *r, number *rest)
{
    const double w = p[2] != 0.0 ? p[2] : 1.0;
    (void)rest;
    r[0] = a[0] + p[0] * (q[0] - csin(w * t)) + p[1] * (u[0] - w * ccos(w * t));
}

/* A pendulum of 1 kg and 1 m on a slide that a drive moves as p[0] sin(3 t); the work of the drive */
static void slide(const double *p, number t, const number *q, const number *u, const number *a,
                  number *r, number *rest)
{
    (void)p;
    (void)t;
    const number push = 2.0 * a[0] + a[1] * ccos(q[1]) - u[1] * u[1] * csin(q[1]);
    r[0] = push;
    r[1] = a[1] + a[0] * ccos(q[1]) + 9.81 * csin(q[1]);
    rest[0] = push * u[0];
}
/* 1 kg that a drive moves like that and nothing else; the work of the drive */
static void carried(const double *p, number t, const number *q, const number *u, const number *a,
                    number *r, number *rest)
{
    (void)p;
    (void)t;
    (void)q;
    r[0] = a[0];
    rest[0] = a[0] * u[0];
}
static void driven(const double *p, number t, number *q, number *u, number *a)
{
    q[0] = p[0] * csin(3.0 * t);
    u[0] = 3.0 * p[0] * ccos(3.0 * t);
    a[0] = -9.0 * p[0] * csin(3.0 * t);
}

/* A body on a ball, its mass centre off it: a quaternion and the angular velocity in its own axes */
static void ball(const double *p, number t, const number *q, const number *u, const number *a,
                 number *r, number *rest)
{
    const double J[] = {0.4, 0.9, 0.7}, weight = p[0];
    const number w = q[0], x = q[1], y = q[2], z = q[3];
    /* weight along -z of space in the body's axes, on the arm (0.3, 0, 1) */
    const number f[] = {-weight * 2.0 * (x * z - w * y), -weight * 2.0 * (y * z + w * x),
                        -weight * (1.0 - 2.0 * (x * x + y * y))};
    (void)t;
    (void)rest;
    r[0] = J[0] * a[0] + (J[2] - J[1]) * u[1] * u[2] - (0.0 * f[2] - 1.0 * f[1]);
    r[1] = J[1] * a[1] + (J[0] - J[2]) * u[2] * u[0] - (1.0 * f[0] - 0.3 * f[2]);
    r[2] = J[2] * a[2] + (J[1] - J[0]) * u[0] * u[1] - (0.3 * f[1] - 0.0 * f[0]);
}
static void turning_rates(const number *q, const number *u, number *dq)
{
    dq[0] = 0.5 * (-q[1] * u[0] - q[2] * u[1] - q[3] * u[2]);
    dq[1] = 0.5 * (q[0] * u[0] + q[2] * u[2] - q[3] * u[1]);
    dq[2] = 0.5 * (q[0] * u[1] + q[3] * u[0] - q[1] * u[2]);
    dq[3] = 0.5 * (q[0] * u[2] + q[1] * u[1] - q[2] * u[0]);
}

/* 1 kg pulled by a spring p[0] whose end moves at p[1], held by friction p[2] tanh(u / p[3]) */
static void friction(const double *p, number t, const number *q, const number *u, const number *a,
                     number *r, number *rest)
{
    (void)rest;
    r[0] = a[0] + p[0] * (q[0] - p[1] * t) + p[2] * ctanh(u[0] / p[3]);
}

/* A body that falls, above ground that does not know of it */
static void fall(const double *p, number t, const number *q, const number *u, const number *a,
                 number *r, number *rest)
{
    (void)p;
    (void)t;
    (void)q;
    (void)u;
    (void)rest;
    r[0] = a[0] + 9.81;
}

/* cos t until p[0], from then on what holds it at rest: never asked at p[0] itself */
static void piecewise(const double *p, number t, const number *q, const number *u, const number *a,
                      number *r, number *rest)
{
    (void)q;
    (void)rest;
    r[0] = a[0] - (creal(t) < p[0] ? ccos(t) : -u[0]) + (creal(t) == p[0] ? NAN : 0.0);
}

/* Falls over: q'' = p[0]^2 q, p[0] / s */
static void inverted(const double *p, number t, const number *q, const number *u, const number *a,
                     number *r, number *rest)
{
    (void)t;
    (void)u;
    (void)rest;
    r[0] = a[0] - p[0] * p[0] * q[0];
}

/* 1 kg before a stop of stiffness p[0] at 0 */
static void stop(const double *p, number t, const number *q, const number *u, const number *a,
                 number *r, number *rest)
{
    (void)t;
    (void)u;
    (void)rest;
    r[0] = a[0] + (creal(q[0]) < 0.0 ? p[0] * q[0] : 0.0);
}

static int gap(void *context, double t, const double *y, double *g)
{
    (void)context;
    (void)t;
    g[0] = y[0];
    return 0;
}

static int below(void *context, double t, const double *y, double *g)
{
    (void)context;
    (void)t;
    g[0] = -y[0];
    return 0;
}

/* memory[0] counts the bounces, p[0] = restitution */
static int bounce(void *context, int event, double t, double *y)
{
    parameters *at = context;
    (void)event;
    (void)t;
    at->memory[0] += 1.0;
    y[1] = -at->p[0] * y[1];
    return MSTMM_FIRE_RESTART;
}

static int unit(void *context, double t, double *y)
{
    const double r = 1.0 / sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2] + y[3] * y[3]);
    (void)context;
    (void)t;
    for (int i = 0; i < 4; i++) y[i] *= r;
    return 0;
}

parameters *test_mechanism(mstmm_system *system, const char *name);
void test_use_event(mstmm_system *system, const char *name);

parameters *test_mechanism(mstmm_system *system, const char *name)
{
    static const int of_ball[] = {1, 2, 3};
    static const sort kinds[] = {
        {"chain", 3, 3, 1, chain, same, NULL, 0},
        {"pendulum", 2, 2, 1, pendulum, same_two, NULL, 0},
        {"base", 1, 1, 0, base, same_one, NULL, 0},
        {"slide", 2, 2, 1, slide, same_two, driven, 1},
        {"carried", 1, 1, 1, carried, same_one, driven, 1},
        {"ball", 4, 3, 0, ball, turning_rates, NULL, 0},
        {"friction", 1, 1, 0, friction, same_one, NULL, 0},
        {"fall", 1, 1, 0, fall, same_one, NULL, 0},
        {"piecewise", 1, 1, 0, piecewise, same_one, NULL, 0},
        {"inverted", 1, 1, 0, inverted, same_one, NULL, 0},
        {"stop", 1, 1, 0, stop, same_one, NULL, 0},
    };
    mechanism *it = calloc(1, sizeof *it);
    memset(system, 0, sizeof *system);
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (!strcmp(kinds[i].name, name)) it->kind = &kinds[i];
    if (!it->kind) return NULL;
    it->implicit = (mstmm_implicit){.n_q = it->kind->n_q,
                                    .n_u = it->kind->n_u,
                                    .residual = residual,
                                    .residual_rate = residual_rate,
                                    .rates = rates,
                                    .tangent = tangent,
                                    .solve = solve,
                                    .coordinates = it->kind->n_q == it->kind->n_u ? NULL : of_ball,
                                    .slope = slope,
                                    .impose = it->kind->impose ? impose : NULL};
    system->context = it;
    system->rhs = rhs;
    system->n_state = it->kind->n_q + it->kind->n_u + it->kind->n_rest;
    system->n_error = system->n_state;
    system->implicit = &it->implicit;
    system->n_memory = 4;
    system->memory = it->at.memory;
    if (!strcmp(name, "ball")) system->accept = unit;
    return &it->at;
}

void test_use_event(mstmm_system *system, const char *name)
{
    if (!strcmp(name, "bounce")) {
        system->n_events = 1;
        system->events = below;
        system->fire = bounce;
    } else {
        system->n_switches = 1;
        system->events = gap;
    }
}
