"""References in long double by CasADi's equations: accelerations, and runs by RK4."""

from __future__ import annotations

import ctypes
import tempfile
from pathlib import Path

import casadi as ca
import numpy as np

from . import native
from .aba import articulated_body
from .links import Tree

TEXT = """
#include <tgmath.h>
#define CASADI_SYMBOL_EXPORT static
%s
static void rates(const long double *y, long double *k)
{
    static const long double efforts[%d];
    const long double *arg[] = {0, y, y + %d, efforts};
    long double *res[] = {k, k + %d};
    aba(arg, res, 0, 0, 0);
}

void accelerations(long n_states, const double *q, const double *u, double *udot)
{
    enum { n = %d, nq = %d };
    for (long s = 0; s < n_states; s++) {
        long double y[n], k[n];
        for (int i = 0; i < nq; i++) y[i] = q[s * nq + i];
        for (int i = nq; i < n; i++) y[i] = u[s * (n - nq) + i - nq];
        rates(y, k);
        for (int i = nq; i < n; i++) udot[s * (n - nq) + i - nq] = k[i];
    }
}

void run(double t_end, long steps, double *state)
{
    enum { n = %d };
    const long double h = (long double)t_end / steps;
    long double y[n], x[n], k[4][n];
    for (int i = 0; i < n; i++) y[i] = state[i];
    for (long step = 0; step < steps; step++) {
        rates(y, k[0]);
        for (int i = 0; i < n; i++) x[i] = y[i] + h / 2 * k[0][i];
        rates(x, k[1]);
        for (int i = 0; i < n; i++) x[i] = y[i] + h / 2 * k[1][i];
        rates(x, k[2]);
        for (int i = 0; i < n; i++) x[i] = y[i] + h * k[2][i];
        rates(x, k[3]);
        for (int i = 0; i < n; i++)
            y[i] += h / 6 * (k[0][i] + 2 * (k[1][i] + k[2][i]) + k[3][i]);
    }
    for (int i = 0; i < n; i++) state[i] = y[i];
}
"""


def _compiled_library(tree: Tree, level: str) -> ctypes.CDLL:
    function, _ = articulated_body(tree, baked=True)
    with tempfile.TemporaryDirectory() as folder:
        options = {"casadi_real": "long double", "include_math": False}
        generator = ca.CodeGenerator("aba.c", options)
        generator.add(function)
        generator.generate(folder + "/")
        body = (Path(folder) / "aba.c").read_text()
    size = tree.nq + tree.nu
    text = TEXT % (body, tree.nu, tree.nq, tree.nq, size, tree.nq, size)
    return ctypes.CDLL(str(native.compile_library("reference", text, [level, "-std=gnu17", "-w"])))


def end_state(tree: Tree, q: np.ndarray, u: np.ndarray, t_end: float, steps: int) -> np.ndarray:
    """State [q, u] at t_end."""
    library = _compiled_library(tree, "-O2")
    library.run.argtypes = [ctypes.c_double, ctypes.c_long, ctypes.c_void_p]
    state = np.concatenate([q, u]).astype(float)
    library.run(t_end, steps, state.ctypes.data)
    return state


def accelerations(tree: Tree, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """udot (n, nu) of states q (n, nq), u (n, nu)."""
    library, udot = _compiled_library(tree, "-O0"), np.zeros_like(u)
    q, u = np.ascontiguousarray(q), np.ascontiguousarray(u)
    pointer = ctypes.c_void_p
    library.accelerations.argtypes = [ctypes.c_long, pointer, pointer, pointer]
    library.accelerations(len(q), q.ctypes.data, u.ctypes.data, udot.ctypes.data)
    return udot
