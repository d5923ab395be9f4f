"""CasADi's function over SIMD lanes: its C text compiled as C++ with std::experimental::simd.

CasADi does not offer this; a user could do it by hand. It is the counterpart of mstmm's lanes.
"""

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
#include <experimental/simd>
#include <cmath>
namespace stdx = std::experimental;
using lanes = stdx::fixed_size_simd<double, 8>;
#define CASADI_SYMBOL_EXPORT static inline
%s
extern "C" __attribute__((visibility("default")))
void evaluate_many(const double *p, long n, const double *q, const double *u, double *udot)
{
    enum { np = %d, nq = %d, nu = %d };
    static thread_local lanes P[np + 1], Q[nq], U[nu], E[nu], QD[nq], UD[nu];
    for (int i = 0; i < np; i++) P[i] = p[i];
    for (int i = 0; i < nu; i++) E[i] = 0.0;
    const lanes *arg[] = {P, Q, U, E};
    lanes *res[] = {QD, UD};
    for (long k = 0; k + 8 <= n; k += 8) {
        const double *from_q = q + k * nq, *from_u = u + k * nu;
        double *to = udot + k * nu;
        for (int i = 0; i < nq; i++) Q[i] = lanes([&](int lane) { return from_q[lane * nq + i]; });
        for (int i = 0; i < nu; i++) U[i] = lanes([&](int lane) { return from_u[lane * nu + i]; });
        aba(arg, res, nullptr, nullptr, 0);
        for (int i = 0; i < nu; i++)
            for (int lane = 0; lane < 8; lane++) to[lane * nu + i] = UD[i][lane];
    }
}
"""
FLAGS = ["-march=native", "-std=c++17", "-fno-math-errno", "-fvisibility=hidden", "-w"]


class Lanes:
    """Accelerations of many states; their number is a multiple of eight."""

    def __init__(self, tree: Tree, level: str = "O3") -> None:
        function, numbers = articulated_body(tree)
        with tempfile.TemporaryDirectory() as folder:
            options = {"casadi_real": "lanes", "include_math": False, "cpp": False}
            generator = ca.CodeGenerator("aba.c", options)
            generator.add(function)
            generator.generate(folder + "/")
            body = (Path(folder) / "aba.c").read_text()
        text = TEXT % (body, len(numbers), tree.nq, tree.nu)
        path = native.compile_library("casadi_lanes", text, [f"-{level}", *FLAGS], "g++", ".cpp")
        self.library = ctypes.CDLL(str(path))
        pointer = ctypes.c_void_p
        self.library.evaluate_many.argtypes = [pointer, ctypes.c_long, pointer, pointer, pointer]
        self.numbers = native.aligned_copy(numbers)

    def __call__(self, q: np.ndarray, u: np.ndarray, udot: np.ndarray) -> None:
        """udot into `out`."""
        self.library.evaluate_many(
            self.numbers.ctypes.data, len(q), q.ctypes.data, u.ctypes.data, udot.ctypes.data
        )
