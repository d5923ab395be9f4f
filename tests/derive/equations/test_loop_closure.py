"""Kernels of closed loops: what their equations must hold, at 40 digits."""

from __future__ import annotations

import random
from typing import Any

import mpmath
import pytest

from mstmm.derive.catalogue.kernels import generic_kernels, loop_kernels
from mstmm.derive.verification.kernel_evaluation import evaluate

DIGITS = 40
KERNELS = {kernel.name: kernel.ir() for kernel in loop_kernels()}


def matrix(numbers: Any, columns: int) -> Any:
    rows = len(numbers) // columns
    return mpmath.matrix([list(numbers[columns * i : columns * (i + 1)]) for i in range(rows)])


@pytest.mark.parametrize("nu", range(7))
@pytest.mark.parametrize("plain", [False, True])
def test_complement(nu: int, plain: bool) -> None:
    """H^+ H = 1, N^T H = 0, N^T N = 1; axes along coordinates leave coordinate directions."""
    numbers = random.Random(nu)
    h = [numbers.uniform(-1, 1) for _ in range(6 * nu)]
    if plain:
        h = [float(i == 5 - k) for i in range(6) for k in range(nu)]
    with mpmath.workdps(DIGITS):
        complement = next(k for k in generic_kernels(nu) if k.name == "complement").ir()
        w = matrix(evaluate(complement, {"H": h}, DIGITS)["W"], 6)
        own = matrix(h, nu) if nu else mpmath.matrix(6, 0)
        for i in range(6):
            for k in range(nu):
                met = sum(w[i, j] * own[j, k] for j in range(6))
                assert abs(met - (i == k)) < 1e-35
        for i in range(nu, 6):
            for j in range(nu, 6):
                met = sum(w[i, k] * w[j, k] for k in range(6))
                assert abs(met - (i == j)) < 1e-35
            if plain:
                assert sorted(abs(w[i, k]) for k in range(6))[-2] < 1e-35


class Body:
    """A body that turns evenly about an axis of its own that turns evenly itself, while P moves on
    a parabola."""

    def __init__(self, numbers: random.Random) -> None:
        self.carrier, self.own, *self.place = (
            mpmath.matrix([mpmath.mpf(numbers.uniform(-1, 1)) for _ in range(3)]) for _ in range(5)
        )

    def motion(self, t: Any) -> dict[str, list[Any]]:
        """Axes, place, velocity, angular velocity and both their rates, own axes."""
        inner = _turn(self.own, t)
        axes = _turn(self.carrier, t) * inner
        start, speed, half = self.place
        carried = inner.T * self.carrier
        return {
            "A": list(axes), "x": list(start + t * speed + t**2 * half),
            "v": list(axes.T * (speed + 2 * t * half)), "rdd": list(axes.T * (2 * half)),
            "w": list(carried + self.own), "wd": list(_tilde(carried) * self.own),
        }  # fmt: skip


def _tilde(v: Any) -> Any:
    x, y, z = v
    return mpmath.matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def _turn(v: Any, t: Any) -> Any:
    """Rotation by t about v (Rodrigues)."""
    rate = mpmath.norm(v)
    k = _tilde(v / rate)
    return mpmath.eye(3) + mpmath.sin(t * rate) * k + (1 - mpmath.cos(t * rate)) * k * k


def relative(c: Body, b: Body, end: list[Any], t: Any) -> tuple[dict[str, Any], list[Any]]:
    """Outputs of the kernels meet and slip at a time."""
    of_c, of_b = c.motion(t), b.motion(t)
    met = evaluate(KERNELS["relative_pose"], {
        "A_C": of_c["A"], "x_C": of_c["x"], "A_B": of_b["A"], "x_B": of_b["x"],
        "r_e": end, "Rc": [1, 0, 0, 0, 1, 0, 0, 0, 1], "r": [0, 0, 0],
    }, 60)  # fmt: skip
    slip = evaluate(KERNELS["slip"], {
        "R_C": met["R_C"], "r_e": end, "d": met["d"], "v_C": of_c["v"], "w_C": of_c["w"],
        "v_B": of_b["v"], "w_B": of_b["w"],
    }, 60)["slip"]  # fmt: skip
    return met, list(slip)


def test_slip_and_drift_are_rates_of_an_open_gap() -> None:
    """d' is the slip's first half, and the drift is the rate of the slip, for bodies that move
    anyhow and are far apart."""
    numbers = random.Random(7)
    with mpmath.workdps(60):
        c, b = Body(numbers), Body(numbers)
        end = [mpmath.mpf(numbers.uniform(-1, 1)) for _ in range(3)]
        t, step = mpmath.mpf("0.3"), mpmath.mpf(10) ** -18
        met, slip = relative(c, b, end, t)
        ahead, behind = (relative(c, b, end, t + sign * step) for sign in (1, -1))
        of_c, of_b = c.motion(t), b.motion(t)
        drift = evaluate(KERNELS["drift"], {
            "R_C": met["R_C"], "r_e": end, "d": met["d"], "slip": slip,
            "motion_C": [*of_c["w"], *of_c["wd"], *of_c["rdd"]],
            "motion_B": [*of_b["w"], *of_b["wd"], *of_b["rdd"]],
        }, 60)["drift"]  # fmt: skip
        for i in range(3):
            rate = (ahead[0]["d"][i] - behind[0]["d"][i]) / (2 * step)
            assert abs(rate - slip[i]) < 1e-20
        for i in range(6):
            rate = (ahead[1][i] - behind[1][i]) / (2 * step)
            assert abs(rate - drift[i]) < 1e-18
