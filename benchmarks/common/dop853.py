"""Adaptive Dormand-Prince 8(5,3) method in C for programs without an integrator.

Coefficients and step control are SciPy's (Hairer, Norsett, Wanner); stages are unrolled
without zeros, the state is on the stack, and nothing is allocated.
"""

from __future__ import annotations

import ctypes
from functools import cache

import numpy as np
from scipy.integrate._ivp import dop853_coefficients as table

from . import native

TEXT = """
#include <math.h>
#include <string.h>
#include "native.h"

static void rates(accelerations f, const double *context, const double *memory,
                  const double *efforts, int nq, int nu, double t, const double *y, double *k)
{
    f(context, &t, y, y + nq, memory, efforts, k, k + nq);
}

/* Integrates y = [q, u] from 0 to t_end; returns the number of evaluations. */
__attribute__((visibility("default")))
long dop853(accelerations f, const double *context, const double *memory, int nq, int nu,
            double t_end, double rtol, double atol, double *restrict y)
{
    const int n = nq + nu;
    double K[13][n], x[n], next[n], efforts[nu];
    double t = 0.0, h;
    long evaluations = 1;
    memset(efforts, 0, sizeof efforts);
    rates(f, context, memory, efforts, nq, nu, t, y, K[0]);
    {
        double d0 = 0, d1 = 0;
        for (int i = 0; i < n; i++) {
            const double s = atol + rtol * fabs(y[i]);
            d0 += y[i] * y[i] / (s * s), d1 += K[0][i] * K[0][i] / (s * s);
        }
        h = d0 < 1e-10 || d1 < 1e-10 ? 1e-6 : 0.01 * sqrt(d0 / d1);
    }
    int rejected = 0;
    while (t < t_end) {
        const int last = t + h * (1 + 1e-12) >= t_end;
        if (last) h = t_end - t;
%s
        for (int i = 0; i < n; i++) next[i] = %s;
        rates(f, context, memory, efforts, nq, nu, t + h, next, K[12]);
        evaluations += 12;
        double e5 = 0, e3 = 0;
        for (int i = 0; i < n; i++) {
            const double s = 1 / (atol + rtol * fmax(fabs(y[i]), fabs(next[i])));
            const double five = (%s) * s, three = (%s) * s;
            e5 += five * five, e3 += three * three;
        }
        const double error = e5 > 0 ? h * e5 / sqrt((e5 + 0.01 * e3) * n) : 0;
        double factor = error > 0 ? 0.9 * pow(error, -0.125) : 10;
        if (error < 1) {
            t = last ? t_end : t + h;
            memcpy(y, next, sizeof next);
            memcpy(K[0], K[12], sizeof next);
            h *= rejected ? fmin(1, factor) : fmin(10, factor);
            rejected = 0;
        } else {
            h *= fmax(0.2, factor);
            rejected = 1;
        }
        if (!(h > 1e-13)) return -1;
    }
    return evaluations;
}
"""


def combination(weights: np.ndarray) -> str:
    """Weighted sum of stages without zeros."""
    parts = [f"{float(w)!r} * K[{j}][i]" for j, w in enumerate(weights) if w != 0]
    return " + ".join(parts).replace("+ -", "- ")


def c_source() -> str:
    """The C source."""
    stages = "".join(
        f"        for (int i = 0; i < n; i++) x[i] = y[i] + h * ({combination(table.A[s, :s])});\n"
        f"        rates(f, context, memory, efforts, nq, nu, t + {float(table.C[s])!r} * h, x, "
        f"K[{s}]);\n"
        for s in range(1, 12)
    )
    new_state = f"y[i] + h * ({combination(table.B)})"
    return TEXT % (stages, new_state, combination(table.E5), combination(table.E3))


@cache
def library() -> ctypes.CDLL:
    """The compiled integrator."""
    flags = ["-O3", "-march=native", "-std=gnu17"]
    shared_library = ctypes.CDLL(str(native.compile_library("dop853", c_source(), flags)))
    shared_library.dop853.restype = ctypes.c_long
    shared_library.dop853.argtypes = [
        *[ctypes.c_void_p] * 3, *[ctypes.c_int] * 2, *[ctypes.c_double] * 3, ctypes.c_void_p,
    ]  # fmt: skip
    return shared_library


def run(subject: native.Subject, t_end: float, tolerance: float) -> tuple[np.ndarray, int]:
    """End state [q, u] from the subject's first state, and the evaluations it took."""
    state = np.concatenate([subject.q[0], subject.u[0]])
    r = subject.record
    calls = library().dop853(
        r.f, r.context, r.memory, r.nq, r.nu, t_end, tolerance, tolerance, state.ctypes.data
    )
    if calls < 0:
        raise RuntimeError("the step became too small")
    return state, calls
