"""Settings of both programs on both scenes: label -> how to evaluate and time a run."""

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
DESCRIPTIONS = {
    "spin-up": "beam of 10 m, 20 s, largest tip deflection -0.57375 m (Simo and Vu-Quoc 1986)",
    "chain": f"{COUNT} steel strips of 0.1 m on pins, at first straight, 45 degrees down, 3 s",
}


@dataclass(frozen=True)
class Setting:
    """`evaluate` returns (error m, time error s or None, CPU s); `run_time` the CPU s of a run."""

    evaluate: Callable[[], tuple[float, float | None, float]]
    run_time: Callable[[], float]


Tools = dict[str, dict[str, Setting]]


# --- spin-up --------------------------------------------------------------------------------------


def largest_deflection_error(times: Array, deflection: Array) -> tuple[float, float]:
    """Errors of the largest deflection (m) and of its time (s), by a parabola through 3 samples."""
    k = int(np.clip(np.argmin(deflection), 1, len(times) - 2))
    a, b, c = np.polyfit(times[k - 1 : k + 2] - times[k], deflection[k - 1 : k + 2], 2)
    vertex = -b / (2 * a)
    return abs(c - b * b / (4 * a) - Spin.LARGEST), times[k] + vertex - Spin.LARGEST_TIME


def mstmm_spin_setting(engine: str, modes: int, method: dict[str, Any]) -> Setting:
    """One setting of mstmm."""
    model = _mstmm_spin_model(engine, modes)

    def run(times: Any) -> mstmm.Result:
        result = model.simulate(Spin.T_END, output_times=times, **method)
        if not result.success:
            raise RuntimeError(result.message)
        return result

    def evaluate() -> tuple[float, float, float]:
        start_time = time.process_time()
        run([Spin.T_END])
        cpu_s = time.process_time() - start_time
        result = run(np.arange(0.0, Spin.T_END, 0.01))
        position, angle = result.position("blade.tip"), Spin.angle(result.t)
        deflection = np.cos(angle) * position[:, 1] - np.sin(angle) * position[:, 0]
        return *largest_deflection_error(result.t, deflection), cpu_s

    def cpu_seconds() -> float:
        count = 20
        return measure.cpu_time(lambda: [run([Spin.T_END]) for _ in range(count)]) / count

    return Setting(evaluate, cpu_seconds)


_MODELS: dict[Any, Any] = {}


def _mstmm_spin_model(engine: str, modes: int) -> Any:
    key = (engine, modes)
    if key not in _MODELS:
        _MODELS[key] = mstmm.compile(mstmm.Scene(**Spin.scene(modes)), engine=engine)
    return _MODELS[key]


def exudyn_spin_setting(elements: int, reduced: int, options: dict[str, Any]) -> Setting:
    """One setting of Exudyn."""
    key = ("exudyn", elements, reduced)
    if key not in _MODELS:
        _MODELS[key] = exudyn_cable.SpinUp(elements, reduced)
    system = _MODELS[key]

    def evaluate() -> tuple[float, float, float]:
        system.solve(Spin.T_END, solver="EXUdense", record_positions=True, **options)
        error_and_lateness = largest_deflection_error(*system.deflection())
        return *error_and_lateness, system.solve(Spin.T_END, solver="EXUdense", **options)

    return Setting(evaluate, lambda: system.solve(Spin.T_END, solver="EXUdense", **options))


def spin_up_settings(quick: bool) -> Tools:
    """Grid of settings of both programs for the spin-up."""
    mstmm_tools: Tools = {}
    for engine, modes in itertools.product(("fused", "looped"), (1, 2, 3)):
        tool = mstmm_tools.setdefault(f"mstmm {engine}", {})
        for method, tolerance in itertools.product(("dop853", "dopri5"), (1e-2, 1e-3, 1e-4, 1e-5)):
            tool[f"{modes} shapes, {method} {tolerance:.0e}"] = mstmm_spin_setting(
                engine, modes, {"method": method, "rtol": tolerance, "atol": tolerance}
            )
        for steps in (200, 250, 300, 400, 800):
            tool[f"{modes} shapes, rk4 in {steps} steps"] = mstmm_spin_setting(
                engine, modes, {"method": "rk4", "step": Spin.T_END / steps}
            )
    exudyn_settings = {}
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
        exudyn_settings[label] = exudyn_spin_setting(elements, reduced, options)
    return {**mstmm_tools, "Exudyn": exudyn_settings}


# --- chain ----------------------------------------------------------------------------------------


def interpolate_path(times: Array, positions: Array) -> Array:
    """Cubic interpolation of a path."""
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(times, positions)(TIMES))


def path_difference(a: Array, b: Array) -> float:
    """Largest distance between two paths."""
    return float(np.linalg.norm(a - b, axis=1).max())


class MstmmChain:
    """Chain of strips with `modes` shape functions each, on one engine."""

    def __init__(self, engine: str, modes: int, frame: str) -> None:
        beam_keys: dict[str, Any] = {"frame": frame}
        if frame == "tangent":
            beam_keys |= {"basis": "simply-supported", "quadrature": False}
        scene = mstmm.Scene(**Strip.chain(COUNT, modes, **beam_keys))
        self.model = mstmm.compile(scene, engine=engine)
        print(self.model.engine_reason, flush=True)

    def run(self, times: Any, **method: Any) -> mstmm.Result:
        """Run to the end; RuntimeError if it fails."""
        result = self.model.simulate(Strip.T_END, output_times=times, **method)
        if not result.success:
            raise RuntimeError(result.message)
        return result

    def path(self, **method: Any) -> Array:
        """Path of the tip at TIMES, m."""
        return self.run(TIMES, **method).position(f"strip{COUNT - 1}.tip")[:, :2]

    def setting(self, reference: Array, method: dict[str, Any]) -> Setting:
        """One setting."""

        def evaluate() -> tuple[float, None, float]:
            error = path_difference(self.path(**method), reference)
            return error, None, cpu_seconds()

        def cpu_seconds() -> float:
            return measure.cpu_time(lambda: self.run([Strip.T_END], **method))

        return Setting(evaluate, cpu_seconds)


def chain_settings(quick: bool) -> Tools:
    """Settings of both programs, each against a converged run of the same program."""
    accurate = {"method": "dop853", "rtol": 1e-8, "atol": 1e-8}
    mstmm_reference = MstmmChain("looped", 2, "chord").path(**accurate)
    reference_chain = exudyn_cable.Chain(COUNT, 2)
    settings: dict[str, Any] = {"tolerance": (1e-8, 1e-3), "solver": "EigenSparse"}
    steps = 2000 if quick else 8000
    reference_chain.solve(
        Strip.T_END, steps, 0.9, newton="once a step", record_positions=True, **settings
    )
    exudyn_reference = interpolate_path(*reference_chain.recorded_positions())
    reference_difference = path_difference(mstmm_reference, exudyn_reference)
    print(f"converged runs of both tools differ by {reference_difference:.1e} m", flush=True)
    DESCRIPTIONS["chain"] += (
        f"; converged runs of both tools differ by {reference_difference:.1e} m"
    )
    tools: Tools = {}
    for engine, frame, modes in (
        ("fused", "tangent", 1), ("looped", "chord", 1), ("looped", "tangent", 1)
    ):  # fmt: skip
        system = MstmmChain(engine, modes, frame)
        tool = tools.setdefault(f"mstmm {engine}", {})
        for method, tolerance in itertools.product(("dop853", "dopri5"), (3e-2, 1e-2, 1e-3, 1e-4)):
            tool[f"{modes} shape, {frame}, {method} {tolerance:.0e}"] = system.setting(
                mstmm_reference, {"method": method, "rtol": tolerance, "atol": tolerance}
            )
        for steps in (700, 800, 850, 900, 950, 1000, 1300):
            tool[f"{modes} shape, {frame}, rk4 in {steps} steps"] = system.setting(
                mstmm_reference, {"method": "rk4", "step": Strip.T_END / steps}
            )
    tools["Exudyn"] = dict(_exudyn_chain_settings(exudyn_reference, settings, quick))
    return tools


def _exudyn_chain_settings(reference: Array, settings: dict[str, Any], quick: bool) -> Any:
    # With the tight tolerance full Newton takes far longer than one Jacobian a step; with looser
    # ones it is no cheaper at the same error.
    joints, tight_tolerance = ("constraint", "spring"), (1e-8, 1e-3)
    loose_tolerances = ((1e-6, 1e-2), (3e-6, 3e-2))
    one_update = ("once a step",)
    grid = [
        *itertools.product(
            joints,
            (300, 600, 800, 1000, 1300),
            (0.4, 0.7),
            ("modified", *one_update),
            (tight_tolerance,),
        ),
        *itertools.product(
            joints, (1100, 1200, 1600), (0.2, 0.3, 0.5), one_update, (tight_tolerance,)
        ),
        *itertools.product(
            joints, (1100, 1200, 1300, 1400, 1600), (0.3, 0.4, 0.5), one_update, loose_tolerances
        ),
    ]
    chains = {joint: exudyn_cable.Chain(COUNT, 1, joint) for joint in joints}
    for joint, steps, radius, newton, tolerance in grid[:: 7 if quick else 1]:
        system = chains[joint]
        options = {**settings, "steps": steps, "radius": radius, "newton": newton}
        options["tolerance"] = tolerance

        def evaluate(system: Any = system, options: Any = options) -> tuple[float, None, float]:
            cpu_s = system.solve(Strip.T_END, record_positions=True, **options)
            return (
                path_difference(interpolate_path(*system.recorded_positions()), reference),
                None,
                cpu_s,
            )

        def cpu_seconds(system: Any = system, options: Any = options) -> float:
            return float(system.solve(Strip.T_END, **options))

        label = f"1 element, {joint}s, {steps} steps, rho {radius}, Newton {newton}"
        label += "" if tolerance == tight_tolerance else f" {tolerance[0]:.0e} {tolerance[1]:.0e}"
        yield label, Setting(evaluate, cpu_seconds)


SCENES: dict[str, Callable[[bool], Tools]] = {"spin-up": spin_up_settings, "chain": chain_settings}
