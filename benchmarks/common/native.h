/* One signature for everybody: accelerations from a state.  `context` is mstmm's parameter array,
 * or whatever else a peer needs. */
#ifndef BENCHMARK_NATIVE_H
#define BENCHMARK_NATIVE_H

#ifdef __cplusplus
extern "C" {
#endif

typedef int (*accelerations)(const double *context, const double *t, const double *q,
                             const double *u, const double *memory, const double *efforts,
                             double *qdot, double *udot);

typedef struct {
    accelerations f;
    const double *context, *memory;
    int nq, nu, n_states;
    const double *q, *u;          /* n_states x nq, n_states x nu */
    double *qdot, *udot, *inputs; /* nq, nu, nq + 2 nu (the last nu stay 0: efforts) */
    double zero;                  /* 0.0, which the compiler does not know */
} subject;

/* CPU ns of this thread for `rounds` walks through the states.  throughput: every call can start
 * while the one before is still running.  chained: inputs wait on outputs, as in an integrator.
 * Returns a negative number when a call failed. */
double throughput(const subject *s, int rounds);
double chained(const subject *s, int rounds);
/* udot of every state, n_states x nu. */
int evaluate_all(const subject *s, double *out);

#ifdef __cplusplus
}
#endif
#endif
