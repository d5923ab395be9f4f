/* Timing loops, the same for every peer.  Compiled without vectorisation: scalar stores are read
 * back by scalar loads, so that nobody's inputs are held up in the store buffer. */
#include "native.h"

#include <time.h>

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static double walk(const subject *s, int rounds, double link)
{
    const double t = 0.0, *efforts = s->inputs + s->nq + s->nu;
    double *q = s->inputs, *u = s->inputs + s->nq;
    int code = 0;
    for (int i = 0; i < s->nu; i++) s->inputs[s->nq + s->nu + i] = 0.0;
    for (int i = 0; i < s->nq; i++) s->qdot[i] = 0.0;
    for (int i = 0; i < s->nu; i++) s->udot[i] = 0.0;
    const double begin = now();
    for (int round = 0; round < rounds; round++)
        for (int k = 0; k < s->n_states; k++) {
            const double *from_q = s->q + k * s->nq, *from_u = s->u + k * s->nu;
            if (link < 0) {
                code |= s->f(s->context, &t, from_q, from_u, s->memory, efforts, s->qdot, s->udot);
                continue;
            }
            for (int i = 0; i < s->nq; i++) q[i] = from_q[i] + link * s->qdot[i];
            for (int i = 0; i < s->nu; i++) u[i] = from_u[i] + link * s->udot[i];
            code |= s->f(s->context, &t, q, u, s->memory, efforts, s->qdot, s->udot);
        }
    const double spent = now() - begin;
    return code ? -1.0 : spent;
}

double throughput(const subject *s, int rounds) { return walk(s, rounds, -1.0); }

double chained(const subject *s, int rounds) { return walk(s, rounds, s->zero); }

int evaluate_all(const subject *s, double *out)
{
    const double t = 0.0, *efforts = s->inputs + s->nq + s->nu;
    int code = 0;
    for (int i = 0; i < s->nu; i++) s->inputs[s->nq + s->nu + i] = 0.0;
    for (int k = 0; k < s->n_states; k++)
        code |= s->f(s->context, &t, s->q + k * s->nq, s->u + k * s->nu, s->memory, efforts,
                     s->qdot, out + k * s->nu);
    return code;
}
