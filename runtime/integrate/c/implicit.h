/* Interface of a mechanical system to implicit methods: its equations of motion as a residual, and
 * their linearisation factored and solved.  mstmm_system points to it. */
#ifndef MSTMM_IMPLICIT_H
#define MSTMM_IMPLICIT_H

/* cdef begin */
/* y = [q (n_q), u (n_u), quadratures (the rest)];  q' = N(q) u,  u' = a,  0 = R(t, q, u, a).
 * K, C, M are the slopes of R in q, u, a.  Functions return 0 or a failure code. */
typedef struct mstmm_implicit {
    int n_q, n_u;
    /* R are accelerations in addition to the right-hand side, a - f(t, q, u): carrying a as an
   * unknown of its own has no advantage. */
    int evaluated;
    /* n_u: a coordinate that each speed changes, whose tolerance weighs the speed's error.  NULL,
   * where there are as many coordinates as speeds: the one of the same number. */
    const int *coordinates;
    /* R (n_u); work: rates of the quadratures, or NULL.  Rows of speeds that somebody imposes are
   * zero; what a drive prescribes is filled in by t, whatever y and a say of it. */
    int (*residual)(void *context, double t, const double *y, const double *a, double *r,
                    double *work);
    /* R of steps that ask rows of positions where they end: of accelerations, beyond those under which
   * gaps go, coordinates changing by 1 / closing times theirs.  NULL: rows are of accelerations. */
    int (*placing)(void *context, double t, const double *y, const double *a, double closing,
                   double *r);
    /* Tangents from now on are those of `placing`, or of `residual`, and so are the speeds at which
   * states are accepted: left to err, or obeying rows.  NULL where `placing` is. */
    void (*ask_positions)(void *context, int asked);
    /* dR/dt at fixed (q, u, a), drives and their derivatives included */
    int (*residual_rate)(void *context, double t, const double *y, const double *a, double *r_t);
    /* dq = N(q) u, zero where somebody imposes it; NULL: dq = u, entry by entry, nobody does */
    int (*rates)(void *context, const double *q, const double *u, double *dq);
    /* Takes (t, y, a) as the base point and factors K W + C + s M for increments da = s du and
   * dq = W du, W = (sq - kappa g_q)^-1 N, where g_q is the slope of N(q) u in q at the base.
   * With kappa 0 solutions are asked for without rho. */
    int (*tangent)(void *context, double t, const double *y, const double *a, double s, double sq,
                   int kappa);
    /* The same with slopes of laws in place of K and C, which costs about as much as a solution: an
   * approximation.  NULL: there is none. */
    int (*laws)(void *context, double t, const double *y, const double *a, double s, double sq,
                int kappa);
    int laws_spare; /* it is so much cheaper than the tangent that iterations should try it */
  /* With the last of both, K dq + C du + M da = r,  sq dq = kappa g_q dq + N du + rho_q,
   * s du = da + rho_u, at the base point; rho may be NULL (zeros).  Entries of imposed speeds come
   * back as zeros. */
    int (*solve)(void *context, const double *r, const double *rho_q, const double *rho_u,
                 double *dq, double *du, double *da);
    /* Changes of the rates of the coordinates (n_q) and of R (n_u) along (dq, du) at (t, y, a), zeros
   * where somebody imposes them.  Exponential methods alone ask for it. */
    int (*slope)(void *context, double t, const double *y, const double *a, const double *dq,
                 const double *du, double *d_rates, double *d_r);
    /* Writes the coordinates, speeds and accelerations that drives prescribe at t into y and a; NULL:
   * there are none */
    int (*impose)(void *context, double t, double *y, double *a);
} mstmm_implicit;
/* cdef end */

#endif
