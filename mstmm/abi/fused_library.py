"""ABI of a fused library, as data: ABI number, descriptor and compiler flags.

The printer of the C text and the loader of the library both use this one definition.
"""

from __future__ import annotations

#: Number of the layout below: changed with the layout, and checked when a library is opened.
ABI_VERSION = 10

#: Name of the one variable that a library exports.
SYMBOL = "mstmm_fused_library"

#: Contraction to fused multiply-add is intended; -ffast-math would break the inlined sine, and -O1
#: takes minutes.  Merging scalar statements into vectors is off, because it is slower (measured).
COMPILER_FLAGS = (
    "-O2", "-std=gnu17", "-march=native", "-ffp-contract=fast", "-fno-math-errno",
    "-fno-trapping-math", "-fno-tree-slp-vectorize",
)  # fmt: skip

#: Flags that some compilers do not support (clang) and that change no result.
OPTIONAL_FLAGS = ("-fno-tree-slp-vectorize",)

_AT = "const double *p, const double *t, const double *q, const double *u, const double *memory, "
_STATE = _AT + "const double *efforts, double *qdot, double *udot"
_GIVEN = _AT + "const double *a"
_END = _AT + "const double *end"

#: `failures` holds (reason, element, code) of guard codes 1, 2, ... as mstmm_failure has them.
#: Functions that a library does not contain are NULL.  A kernel returns 0 or a guard's code; its
#: outputs are invalid after a guard.  In lanes, entry i of an array is at [i * lanes + lane], for p
#: too; codes[lane] is set, and the result is non-zero if any lane failed.
DECLARATIONS = f"""\
/* n states, each array row by row: entry i of a state at [state * width + i].  With a stride of 0
 * all states share one row, otherwise the stride is the distance of rows.  Efforts and
 * qdot may be NULL. */
typedef struct {{
    long long n;
    const double *p, *t, *q, *u, *memory, *efforts;
    long long p_stride, t_stride, memory_stride, efforts_stride;
    double *qdot, *udot;
    int *codes;
}} mstmm_batch;

typedef struct {{
    int abi, nq, nu, np, n_memory, lanes, n_closures;
    const char *key;
    int n_failures;
    const int *failures;
    int (*accelerations)({_STATE});
    int (*accelerations_power)({_STATE}, double *power, double *potential);
    /* Where loops are closed; see derive/fuse/loop_assembly.py. */
    int (*gaps)({_AT}const double *efforts, double *dq, double *gap, double *apart);
    int (*slips)({_AT}const double *efforts, double *du, double *strain);
    int (*accelerations_lanes)({_STATE}, int *codes);
    /* Fills codes (n); returns the number of states that failed. */
    long long (*accelerations_many)(const mstmm_batch *batch);
    /* For implicit methods; see derive/fuse/implicit_residual.py. */
    int (*residual)({_GIVEN}, double *r);
    int (*residual_power)({_GIVEN}, double *r, double *power);
    int (*residual_rate)({_GIVEN}, double *r_t);
    int (*tangent)({_GIVEN}, const double *steps, double *factors);
    int (*tangent_slopes)({_GIVEN}, const double *steps, double *slopes, double *factors);
    int (*rest)({_GIVEN}, const double *slopes, const double *r, const double *dq,
                const double *da, double *rest);
    int (*solution)(const double *factors, const double *r, double *x);
    int (*rates)({_GIVEN}, double *dq);
    int (*coordinates)({_GIVEN}, const double *steps, const double *x, const double *rho,
                       double *dq);
    /* Inverse dynamics and the mass matrix; see derive/fuse/scene_kernels.py. */
    int (*required)({_GIVEN}, double *efforts);
    int (*mass)({_GIVEN}, double *M);
    /* A point of one body; see derive/fuse/point_kinematics.py. */
    int (*pose)({_END}, double *place, double *axes);
    int (*velocities)({_END}, double *velocity);
    int (*jacobian)({_END}, double *J);
    int (*jacobian_rate)({_END}, double *J);
    /* The slopes of the residual about a state; see derive/fuse/linearisation.py. */
    int (*linear)({_GIVEN}, double *M, double *C, double *K, double *G, double *r_t);
}} mstmm_fused;
"""
