/* Amplitudes under harmonic pushes: Z(s) x = r with Z(s) = s^2 M + s C + K, the tangent in complex
 * numbers.  What bodies bring is put together once a state; every s is one elimination, O(bodies). */
#ifndef MSTMM_RESPONSE_HEADER
#define MSTMM_RESPONSE_HEADER

#include "tangent.h"

/* cdef begin */
/* A scene behind mstmm_residual, and what is kept; everything is the caller's.  Complex numbers are
 * two of these. */
typedef struct {
    mstmm_tangent *at;
    int64_t n_numbers;   /* see mstmm_tangent_lay */
    real *brought;       /* 2 n_numbers: what s brings, what s^2 brings; the rest is the tangent's */
    real *numbers;       /* n_numbers complex */
    real *workspace;     /* as many complex as the model has */
    real *column;        /* nu complex */
    real *scratch;       /* 3 nu + 2 n_coupled */
    real *answers;       /* n_coupled x nu complex: to one of each coupling */
    real *closure;       /* n_coupled x (4 n_coupled + 2) complex */
    real growth;         /* of the last elimination: it made inertia so many times larger, */
    int grown;           /* of this body most */
} mstmm_response;

/* What bodies bring about the state of the last residual. */
int mstmm_response_begin(mstmm_response *of);
/* Amplitudes x (count, n, nu) complex of n right-hand sides (n, nu) at every s (count) complex, with
 * the growth and the body of each; what is singular has infinite growth, and zeros. */
void mstmm_response_many(mstmm_response *of, int64_t count, const real *s, int64_t n,
                         const real *columns, real *x, real *growth, int *grown);
/* cdef end */

/* The rest is for the passes in complex numbers (complex_steps.c). */

typedef double _Complex mstmm_complex;

typedef struct {
    mstmm_complex *numbers;
    const real *held;    /* what no s changes of them */
    mstmm_complex *unit; /* a load that is one in a right-hand side; NULL: none */
} mstmm_complex_tangents;

typedef struct {
    mstmm_complex *workspace;
} mstmm_complex_slope;

/* What a pass is at: numbers of the state are plain, what moves is complex. */
typedef struct {
    const mstmm_model *model;
    real *workspace;
    const real *memory;
    const mstmm_complex *column;
    mstmm_complex *answer;
    mstmm_complex_slope *slope;
    mstmm_complex_tangents *tangents;
    mstmm_failure *failure;
    int observed;
} mstmm_complex_state;

static inline double mstmm_complex_size(mstmm_complex x)
{
    return fabs(__real__ x) + fabs(__imag__ x);
}

static inline int mstmm_complex_fail(mstmm_complex_state *state, int reason, int element, int code)
{
    *state->failure = (mstmm_failure){.reason = reason, .element = element, .code = code};
    return reason;
}

/* The code of an elimination: signs of determinants mean nothing here. */
static inline int mstmm_complex_judged(mstmm_complex_state *state, int code)
{
    (void)state;
    return code == MSTMM_NEGATIVE ? 0 : code;
}

int mstmm_complex_at_tangent_eliminated(mstmm_complex_state *state, int index);
int mstmm_complex_at_tangent_column(mstmm_complex_state *state, int index);
int mstmm_complex_at_tangent_carried(mstmm_complex_state *state, int index);
int mstmm_complex_at_tangent_answered(mstmm_complex_state *state, int index);
int mstmm_complex_sweep_tangent_invert(int n, const mstmm_complex *restrict D,
                                       const mstmm_complex *restrict one,
                                       mstmm_complex *restrict inverse,
                                       mstmm_complex *restrict work);

#endif
