"""Chains of equal planar beams welded end to end, at rest: product in doubles, exact, and sweep.

Clamped-free shapes, tangent frame; every beam is turned by +-0.3 rad.  The weight is given as loads
that do not turn, so that Z = A M + K; with A = 1 and no stiffness it is the acceleration form.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from mstmm.derive.classical.discrete import body as flexible_body
from mstmm.derive.classical.discrete import hinge as flexible_joint
from mstmm.derive.classical.discrete.body_options import PLANE, BodyStatement
from mstmm.derive.classical.discrete.hinge import Pairing
from mstmm.derive.lower.kernel_lowering import lower
from mstmm.derive.verification.kernel_evaluation import evaluate
from mstmm.ir import KernelIR
from mstmm.ir.interpreter import evaluate_floats

Array = NDArray[np.float64]
TURN = 0.3
WEIGHT = -9.81


@dataclass(frozen=True)
class Step:
    """Scalars of the time map, and the beams' bending stiffness (length and mass are 1)."""

    A: float = 1.0
    C: float = 0.0
    stiffness: float = 0.0


ACCELERATION = Step()


@cache
def shapes(modes: int) -> dict[str, Array]:
    """Roots and closed forms of clamped-free shapes on the unit beam (int phi^2 = 1)."""
    beta = np.array(
        [
            brentq(lambda b: np.cos(b) + 1 / np.cosh(b), (k + 0.2) * np.pi, (k + 0.8) * np.pi)
            for k in range(modes)
        ]
    )
    small = np.exp(-beta)
    sigma = (1 + small**2 + 2 * small * np.cos(beta)) / (1 - small**2 + 2 * small * np.sin(beta))
    sign = (-1.0) ** np.arange(modes)
    return {
        "beta": beta, "s": 2 * sigma / beta, "S_c": 2 / beta**2,
        "phi_O": 2 * sign, "Theta_O": 2 * sigma * beta * sign,
    }  # fmt: skip


@cache
def body_kernel(modes: int) -> KernelIR:
    """The planar beam with any number of modes."""
    beam = BodyStatement("beam", "", PLANE, "beam", modes, "", "")
    return lower(flexible_body.derivation(beam), "transfer")


@cache
def weld_kernel(inboard: int, outboard: int) -> KernelIR:
    """The fixed hinge between bodies with any numbers of modes."""
    return lower(
        flexible_joint.fixed_hinge(Pairing(PLANE, inboard, outboard), "weld", "", ""), "transfer"
    )


def beam_inputs(modes: int, angle: float, place: Array, step: Step) -> dict[str, list[float]]:
    """A beam at rest and undeformed, its input end at `place`."""
    upper, known = np.triu_indices(modes), shapes(modes)
    given: dict[str, Any] = {
        "m": 1.0, "S_0": [0.5, 0.0], "I_0": 1 / 3, "s": known["s"], "S_c": known["S_c"],
        "M_f": np.eye(modes)[upper], "K_f": np.diag(step.stiffness * known["beta"] ** 4)[upper],
        "D_f": np.zeros((modes, modes))[upper], "L": 1.0, "phi_O": known["phi_O"],
        "Theta_O": known["Theta_O"], "Theta_I": np.zeros(modes), "A": step.A, "C": step.C,
        "B_r": -step.A * place, "B_theta": -step.A * angle, "D_theta": -step.C * angle,
        "r_p": place, "theta_p": angle, "g": [0.0, 0.0], "q_p": [0.0, 0.0],
    }  # fmt: skip
    given |= _weight(modes, angle)
    given |= {name: np.zeros(modes) for name in ("B_eta", "D_eta", "eta_p")}
    return {name: [float(x) for x in np.atleast_1d(value)] for name, value in given.items()}


def _weight(modes: int, angle: float) -> dict[str, Any]:
    across = WEIGHT * np.cos(angle)
    return {"f_r": [0.0, WEIGHT], "f_m": 0.5 * across, "f_eta": across * shapes(modes)["s"]}


def angles(count: int) -> list[float]:
    """The zigzag."""
    return [TURN * (-1) ** k for k in range(count)]


Evaluation = Callable[[KernelIR, dict[str, list[Any]]], dict[str, list[Any]]]


def matrices(
    modes: int, count: int, step: Step, run: Evaluation = evaluate_floats
) -> list[tuple[list[list[Any]], list[list[Any]]]]:
    """(U of the weld before it, U) of every beam, row by row."""
    found, place, before = [], np.zeros(2), 0.0
    for k, angle in enumerate(angles(count)):
        own = run(body_kernel(modes), beam_inputs(modes, angle, place, step))
        inputs = {"W": own["W"], "Theta_O": [0.0] * modes, "gamma": [angle - before]}
        if k:
            inputs["Theta_I"] = [float(x) for x in shapes(modes)["Theta_O"]]
        weld = run(weld_kernel(modes if k else 0, modes), inputs)["U_h"]
        found.append((_rows(weld, 7 + (modes if k else 0)), _rows(own["U"], 7 + modes)))
        place = place + np.array([np.cos(angle), np.sin(angle)])
        before = angle
    return found


def _rows(entries: list[Any], columns: int) -> list[list[Any]]:
    return [entries[i : i + columns] for i in range(0, len(entries), columns)]


def root_load(modes: int, count: int, step: Step = ACCELERATION) -> Array:
    """(m, q) at the clamped root, by the product in doubles.  LinAlgError where it is singular."""
    total = np.eye(7)
    for weld, body in matrices(modes, count, step):
        total = np.array(body) @ (np.array(weld) @ total)
    return np.asarray(np.linalg.solve(total[3:6, 3:6], -total[3:6, 6]), dtype=float)


def exact_root_load(modes: int, count: int, step: Step = ACCELERATION) -> Array:
    """The same at 80 digits, from the same doubles."""
    with mpmath.workdps(80):
        total = mpmath.eye(7)
        for weld, body in matrices(modes, count, step, lambda k, i: evaluate(k, i, digits=80)):
            total = mpmath.matrix(body) * (mpmath.matrix(weld) * total)
        found = mpmath.lu_solve(total[3:6, 3:6], -total[3:6, 6])
        return np.array([float(x) for x in found])


def swept_root_load(modes: int, count: int, step: Step = ACCELERATION) -> Array:
    """The same by absorbing, condensing and passing welds, in doubles, tip to root."""
    known = shapes(modes)
    inertia, load = np.zeros((3, 3)), np.zeros(3)
    for angle in reversed(angles(count)):
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, -s], [s, c]])
        lever, across = turn @ [1.0, 0.0], turn @ [0.0, 1.0]
        port = np.zeros((3, 3 + modes))
        port[:2, :2], port[:2, 2], port[2, 2] = np.eye(2), [-lever[1], lever[0]], 1.0
        port[:2, 3:], port[2, 3:] = np.outer(across, known["phi_O"]), known["Theta_O"]
        mass = np.zeros((3 + modes, 3 + modes))
        mass[:2, :2], mass[2, 2] = np.eye(2), 1 / 3
        mass[:2, 2] = mass[2, :2] = 0.5 * across
        mass[:2, 3:] = np.outer(across, known["s"])
        mass[3:, :2] = mass[:2, 3:].T
        mass[2, 3:] = mass[3:, 2] = known["S_c"]
        mass[3:, 3:] = np.eye(modes)
        weight = _weight(modes, angle)
        rest = -np.concatenate([weight["f_r"], [weight["f_m"]], weight["f_eta"]])
        whole = step.A * mass + port.T @ inertia @ port
        whole[3:, 3:] += np.diag(step.stiffness * known["beta"] ** 4)
        rest = rest + port.T @ load
        gain = np.linalg.solve(whole[3:, 3:], np.column_stack([whole[3:, :3], rest[3:]]))
        inertia = whole[:3, :3] - whole[:3, 3:] @ gain[:, :3]
        load = rest[:3] - whole[:3, 3:] @ gain[:, 3]
    return np.asarray(load, dtype=float)[[2, 0, 1]]


def section_matrix(modes: int, step: Step = ACCELERATION) -> tuple[Array, Array]:
    """One beam from section to section (6 x 6, modes eliminated), and C_x of its elimination."""
    own = evaluate_floats(body_kernel(modes), beam_inputs(modes, 0.0, np.zeros(2), step))
    rows = {"W": own["W"], "Theta_O": [0.0] * modes, "gamma": [0.0]}
    first = _array(evaluate_floats(weld_kernel(0, modes), rows)["U_h"], 7)
    slopes = [float(x) for x in shapes(modes)["Theta_O"]]
    last = evaluate_floats(weld_kernel(modes, 0), {"Theta_I": slopes, "gamma": [0.0]})["U_h"]
    whole = _array(last, 7 + modes) @ _array(own["U"], 7 + modes) @ first
    return whole[:6, :6], _array(own["W"], 7 + modes)[:, 6 : 6 + modes]


def _array(entries: list[float], columns: int) -> Array:
    return np.array(entries).reshape(-1, columns)
