"""Trials of the checks of flexible bodies on random scenes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .motions import Rng, log_uniform
from .trials import Scene, Trial, build_model, run_trial, trial

#: First frequency of a clamped beam of 1 m, 1 kg and 1 N m2, rad/s, and those of the next shapes.
FIRST = 3.51602
FREQUENCIES = (3.51602, 22.0345, 61.6972, 120.902)


def beam(name: str = "beam", **more: Any) -> Scene:
    """Beam of 1 m, 1 kg and 1 N m2."""
    return {"name": name, "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0, **more}


def _tip(run: Any) -> np.ndarray:
    return np.asarray(run.deflection("beam", "tip"))


def _relative_tip_error(run: Any, exact: Any) -> float:
    """Error of the tip relative to its largest deflection."""
    if not run.success:
        return math.inf
    own_tip, reference_tip = _tip(run), _tip(exact)
    error = float(np.abs(own_tip - reference_tip).max() / np.abs(reference_tip).max())
    return error if math.isfinite(error) else math.inf


def spinning_linear_beam(rng: Rng) -> Trial:
    """A linear beam at a hub of some radius in spin-up."""
    ratio, ramp = log_uniform(rng, 0.03, 2.0), float(rng.uniform(4.0, 12.0))
    spin, radius = ratio * FIRST, float(rng.uniform(0, 1))
    angle = f"{spin / ramp!r}*(t^2/2 + ({ramp!r}/(2*pi))^2*(cos(2*pi*t/{ramp!r}) - 1))"
    drive = f"where(t < {ramp!r}, {angle}, {spin!r}*(t - {ramp / 2!r}))"
    inertia_ratio = {"name": "hub", "mass": 1.0, "inertia": [1, 1, 1],
           "ends": {"rim": {"position": [radius, 0, 0]}}}  # fmt: skip
    hinges = [
        {"name": "motor", "type": "pin", "inboard": "ground", "outboard": "hub", "drive": drive},
        {"name": "weld", "type": "fixed", "inboard": "hub.rim", "outboard": "beam"},
    ]
    times = np.linspace(0, 1.5 * ramp, 201)

    def build(stiffening: bool) -> Any:
        beam_table = beam(modes={"y": 3}, stiffening=stiffening)
        return build_model({"body": [inertia_ratio], "beam": [beam_table], "hinge": hinges})

    settings: dict[str, Any] = {
        "method": "rodas4p2",
        "rtol": 1e-6,
        "atol": 1e-8,
        "output_times": times,
    }
    run, risks = run_trial(build(False), 1.5 * ramp, **settings)
    exact = build(True).simulate(1.5 * ramp, **settings)
    return trial(ratio, run, risks, _relative_tip_error(run, exact) / 0.1)


def light_hub(rng: Rng) -> Trial:
    """A one-way beam on a hub that oscillates."""
    inertia_ratio, time = log_uniform(rng, 0.03, 300.0), float(rng.uniform(2.0, 6.0))
    center = {"name": "hub", "mass": 1.0, "inertia": [inertia_ratio / 3] * 3}
    effort = f"where(t < {time!r}, {0.02 * (inertia_ratio + 1) / 3!r}*sin(2*pi*t/{time!r}), 0)"
    hinges = [
        {"name": "motor", "type": "pin", "inboard": "ground", "outboard": "hub",
         "law": {"effort": effort}},
        {"name": "weld", "type": "fixed", "inboard": "hub", "outboard": "beam"},
    ]  # fmt: skip
    scene = {"body": [center], "beam": [beam(modes={"y": 3})], "hinge": hinges}
    settings: dict[str, Any] = {
        "rtol": 1e-7,
        "atol": 1e-9,
        "output_times": np.linspace(0, 2 * time, 101),
    }
    run, risks = run_trial(build_model(scene, flexibility="one-way"), 2 * time, **settings)
    exact = build_model(scene).simulate(2 * time, **settings)
    distance = np.abs(run.position("beam.tip") - exact.position("beam.tip")).max()
    return trial(inertia_ratio, run, risks, float(distance / np.abs(_tip(exact)).max()) / 0.3)


def _run_at_rest(tested: Any) -> tuple[Any, tuple[str, ...]]:
    """Short run from the static equilibrium."""
    equilibrium = tested.equilibrium(), np.zeros(tested.nu)
    return run_trial(tested, 1e-9, initial=equilibrium, output_times=[0.0, 1e-9])


def strongly_bent_beam(rng: Rng) -> Trial:
    """A clamped beam at rest under a force across its tip, sideways or oblique."""
    load, angle = log_uniform(rng, 0.02, 2.0), float(rng.uniform(-0.6, 0.6))
    force = [-load * math.sin(angle), load * math.cos(angle), 0.0]

    def build(pieces: int) -> Any:
        unique_names = ["beam", *(f"piece{i}" for i in range(1, pieces))]
        beams = [beam(name, modes={"y": 3}) | {"length": 1 / pieces} for name in unique_names]
        welds = [
            {"name": f"weld{i}", "type": "fixed", "outboard": name,
             "inboard": f"{unique_names[i - 1]}.tip" if i else "ground"}
            for i, name in enumerate(unique_names)
        ]  # fmt: skip
        end = f"{unique_names[-1]}.tip"
        return build_model(
            {"beam": beams, "hinge": welds, "load": [{"on": end, "force": force}]}
        ), end

    tested, end = build(1)
    run, risks = _run_at_rest(tested)
    fine_model, fine_end = build(10)
    exact, _ = _run_at_rest(fine_model)
    error = float(np.abs(run.position(end) - exact.position(fine_end)).max())
    return trial(load, run, risks, error / 0.02)


def shaken_beam(rng: Rng) -> Trial:
    """A clamped beam of some shapes whose root is shaken at a frequency drawn against the last."""
    shapes, ratio = int(rng.integers(1, 4)), log_uniform(rng, 0.05, 8.0)
    rate = ratio * FREQUENCIES[shapes - 1]
    drive = f"0.002*(1 - cos({rate!r}*t))"
    root = {"name": "root", "type": "prismatic", "axis": [0, 1, 0], "inboard": "ground",
            "outboard": "beam", "drive": drive}  # fmt: skip
    t_end = max(16 * math.pi / rate, 8 * math.pi / FIRST)
    settings: dict[str, Any] = {"method": "rodas5p", "rtol": 1e-7, "atol": 1e-10,
                           "output_times": np.linspace(0, t_end, 301)}  # fmt: skip

    def build(count: int) -> Any:
        return build_model({"beam": [beam(modes={"y": count}, damping=0.05)], "hinge": [root]})

    run, risks = run_trial(build(shapes), t_end, **settings)
    exact = build(shapes + 4).simulate(t_end, **settings)
    return trial(ratio, run, risks, _relative_tip_error(run, exact) / 0.1)
