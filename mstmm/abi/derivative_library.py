"""ABI of a derivative library, as data: ABI number, descriptor and name of the symbol."""

from __future__ import annotations

#: Number of the layout below: changed with the layout, and checked when a library is opened.
ABI_VERSION = 1

#: Name of the one variable that a library exports.
SYMBOL = "mstmm_columns_library"

#: `run` gives the derivatives of each of `states` states along n directions.  `inputs` are those of
#: the kernel "accelerations" in its order; `strides` is the distance of the rows of two states (0:
#: all states share them), `direction_stride` that of directions (n, width_in).  The result is
#: (states, n, width_out).
DECLARATIONS = """\
typedef struct {
    const double *inputs[6];
    long long strides[6];
    long long states, n;
    const double *directions;
    long long direction_stride;
    double *result;
} mstmm_columns_call;

typedef struct {
    int width_in, width_out;
    void (*run)(const mstmm_columns_call *call);
} mstmm_columns_kernel;

typedef struct {
    int abi, n_kernels;
    const char *key;
    const mstmm_columns_kernel *kernels;
} mstmm_columns;
"""
