"""Settings of both tools on both scenes: label -> how it is watched and how it is timed."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from common import exudyn_cable, measure
from common.flexible_scenes import Spin, Strip

import mstmm

Array = np.ndarray
#: Number of strips in the chain, and the times at which its tip is compared.
COUNT = 100
TIMES = np.linspace(0.0, Strip.T_END, 301)
ABOUT = {
    "spin-up": "beam of 10 m, 20 s, largest tip deflection -0.57375 m (Simo and Vu-Quoc 1986)",
    "chain": f"{COUNT} steel strips of 0.1 m on pins, at first straight, 45 degrees down, 3 s",
}


@dataclass(frozen=True)
class Setting:
    """`watch` gives (error m, lateness s or None, CPU s); `time` CPU s of a run unwatched."""

    watch: Callable[[], tuple[float, float | None, float]]
    time: Callable[[], float]


Tools = dict[str, dict[str, Setting]]


# --- spin-up --------------------------------------------------------------------------------------


def largest(times: Array, deflection: Array) -> tuple[float, float]:
    """(error, lateness) of the largest deflection: vertex of the parabola through three samples."""
    k = int(np.clip(np.argmin(deflection), 1, len(times) - 2))
    a, b, c = np.polyfit(times[k - 1 : k + 2] - times[k], deflection[k - 1 : k + 2], 2)
    shift = -b / (2 * a)
    return abs(c - b * b / (4 * a) - Spin.LARGEST), times[k] + shift - Spin.AT


def spin_mstmm(engine: str, modes: int, method: dict[str, Any]) -> Setting:
    """One setting of mstmm."""
    model = _spin_model(engine, modes)

    def run(times: Any) -> mstmm.Result:
        result = model.simulate(Spin.T_END, output_times=times, **method)
        if not result.success:
            raise RuntimeError(result.message)
        return result

    def watch() -> tuple[float, float, float]:
        begin = time.process_time()
        run([Spin.T_END])
        spent = time.process_time() - begin
        result = run(np.arange(0.0, Spin.T_END, 0.01))
        place, angle = result.position("blade.tip"), Spin.angle(result.t)
        found = np.cos(angle) * place[:, 1] - np.sin(angle) * place[:, 0]
        return *largest(result.t, found), spent

    def repeated() -> float:
        count = 20
        return measure.cpu(lambda: [run([Spin.T_END]) for _ in range(count)]) / count

    return Setting(watch, repeated)


_MODELS: dict[Any, Any] = {}


def _spin_model(engine: str, modes: int) -> Any:
    key = (engine, modes)
    if key not in _MODELS:
        _MODELS[key] = mstmm.compile(mstmm.Scene(**Spin.scene(modes)), engine=engine)
    return _MODELS[key]


def spin_exudyn(elements: int, reduced: int, options: dict[str, Any]) -> Setting:
    """One setting of Exudyn."""
    key = ("exudyn", elements, reduced)
    if key not in _MODELS:
        _MODELS[key] = exudyn_cable.SpinUp(elements, reduced)
    subject = _MODELS[key]

    def watch() -> tuple[float, float, float]:
        subject.solve(Spin.T_END, solver="EXUdense", watched=True, **options)
        found = largest(*subject.deflection())
        return *found, subject.solve(Spin.T_END, solver="EXUdense", **options)

    return Setting(watch, lambda: subject.solve(Spin.T_END, solver="EXUdense", **options))


def spin_up(quick: bool) -> Tools:
    """Elements, integration order, steps, damping, Newton against modes, methods, tolerances."""
    own: Tools = {}
    for engine, modes in itertools.product(("fused", "looped"), (1, 2, 3)):
        tool = own.setdefault(f"mstmm {engine}", {})
        for method, tolerance in itertools.product(("dop853", "dopri5"), (1e-2, 1e-3, 1e-4, 1e-5)):
            tool[f"{modes} shapes, {method} {tolerance:.0e}"] = spin_mstmm(
                engine, modes, {"method": method, "rtol": tolerance, "atol": tolerance}
            )
        for steps in (200, 250, 300, 400, 800):
            tool[f"{modes} shapes, rk4 in {steps} steps"] = spin_mstmm(
                engine, modes, {"method": "rk4", "step": Spin.T_END / steps}
            )
    other = {}
    grid = itertools.product(
        (2, 3, 4), (0, 1), (300, 400, 500, 600, 700, 800, 1000, 2000),
        (0.0, 0.3, 0.5, 0.6, 0.8), ("full", "once a step"),
        ((1e-8, 1e-3), (1e-5, 1e-1)),
    )  # fmt: skip
    for elements, reduced, steps, radius, newton, tolerance in list(grid)[:: 41 if quick else 1]:
        label = (
            f"{elements} elements{', reduced' if reduced else ''}, {steps} steps, rho {radius}, "
            f"Newton {newton} {tolerance[0]:.0e} {tolerance[1]:.0e}"
        )
        options = {"steps": steps, "radius": radius, "newton": newton, "tolerance": tolerance}
        other[label] = spin_exudyn(elements, reduced, options)
    return {**own, "Exudyn": other}


# --- chain ----------------------------------------------------------------------------------------


def at_times(times: Array, places: Array) -> Array:
    """Cubic interpolation of a path."""
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(times, places)(TIMES))


def apart(a: Array, b: Array) -> float:
    """Largest distance of two paths."""
    return float(np.linalg.norm(a - b, axis=1).max())


class MstmmChain:
    """Chain with so many shapes a strip, in one engine; references are run once."""

    def __init__(self, engine: str, modes: int, frame: str) -> None:
        more: dict[str, Any] = {"frame": frame}
        if frame == "tangent":
            more |= {"basis": "simply-supported", "quadrature": False}
        scene = mstmm.Scene(**Strip.chain(COUNT, modes, **more))
        self.model = mstmm.compile(scene, engine=engine)
        print(self.model.engine_reason, flush=True)

    def run(self, times: Any, **method: Any) -> mstmm.Result:
        """To the end, or an error."""
        result = self.model.simulate(Strip.T_END, output_times=times, **method)
        if not result.success:
            raise RuntimeError(result.message)
        return result

    def path(self, **method: Any) -> Array:
        """The tip at TIMES."""
        return self.run(TIMES, **method).position(f"strip{COUNT - 1}.tip")[:, :2]

    def setting(self, reference: Array, method: dict[str, Any]) -> Setting:
        """One setting."""

        def watch() -> tuple[float, None, float]:
            error = apart(self.path(**method), reference)
            return error, None, once()

        def once() -> float:
            return measure.cpu(lambda: self.run([Strip.T_END], **method))

        return Setting(watch, once)


def chain(quick: bool) -> Tools:
    """Both tools against converged runs of their own, two shapes or two elements a strip."""
    accurate = {"method": "dop853", "rtol": 1e-8, "atol": 1e-8}
    own = MstmmChain("looped", 2, "chord").path(**accurate)
    fine = exudyn_cable.Chain(COUNT, 2)
    settings: dict[str, Any] = {"tolerance": (1e-8, 1e-3), "solver": "EigenSparse"}
    steps = 2000 if quick else 8000
    fine.solve(Strip.T_END, steps, 0.9, newton="once a step", watched=True, **settings)
    theirs = at_times(*fine.places())
    between = apart(own, theirs)
    print(f"converged runs of both tools are {between:.1e} m apart", flush=True)
    ABOUT["chain"] += f"; converged runs of both tools {between:.1e} m apart"
    tools: Tools = {}
    for engine, frame, modes in (
        ("fused", "tangent", 1), ("looped", "chord", 1), ("looped", "tangent", 1)
    ):  # fmt: skip
        subject = MstmmChain(engine, modes, frame)
        tool = tools.setdefault(f"mstmm {engine}", {})
        for method, tolerance in itertools.product(("dop853", "dopri5"), (3e-2, 1e-2, 1e-3, 1e-4)):
            tool[f"{modes} shape, {frame}, {method} {tolerance:.0e}"] = subject.setting(
                own, {"method": method, "rtol": tolerance, "atol": tolerance}
            )
        for steps in (700, 800, 850, 900, 950, 1000, 1300):
            tool[f"{modes} shape, {frame}, rk4 in {steps} steps"] = subject.setting(
                own, {"method": "rk4", "step": Strip.T_END / steps}
            )
    tools["Exudyn"] = dict(_cables(theirs, settings, quick))
    return tools


def _cables(reference: Array, settings: dict[str, Any], quick: bool) -> Any:
    # With the tight tolerance full Newton takes far longer than one Jacobian a step; with looser
    # ones it is no cheaper at the same error.
    joints, tight = ("constraint", "spring"), (1e-8, 1e-3)
    loose = ((1e-6, 1e-2), (3e-6, 3e-2))
    one = ("once a step",)
    grid = [
        *itertools.product(
            joints, (300, 600, 800, 1000, 1300), (0.4, 0.7), ("modified", *one), (tight,)
        ),
        *itertools.product(joints, (1100, 1200, 1600), (0.2, 0.3, 0.5), one, (tight,)),
        *itertools.product(joints, (1100, 1200, 1300, 1400, 1600), (0.3, 0.4, 0.5), one, loose),
    ]
    made = {joint: exudyn_cable.Chain(COUNT, 1, joint) for joint in joints}
    for joint, steps, radius, newton, tolerance in grid[:: 7 if quick else 1]:
        subject = made[joint]
        options = {**settings, "steps": steps, "radius": radius, "newton": newton}
        options["tolerance"] = tolerance

        def watch(subject: Any = subject, options: Any = options) -> tuple[float, None, float]:
            spent = subject.solve(Strip.T_END, watched=True, **options)
            return apart(at_times(*subject.places()), reference), None, spent

        def once(subject: Any = subject, options: Any = options) -> float:
            return float(subject.solve(Strip.T_END, **options))

        label = f"1 element, {joint}s, {steps} steps, rho {radius}, Newton {newton}"
        label += "" if tolerance == tight else f" {tolerance[0]:.0e} {tolerance[1]:.0e}"
        yield label, Setting(watch, once)


SCENES: dict[str, Callable[[bool], Tools]] = {"spin-up": spin_up, "chain": chain}
