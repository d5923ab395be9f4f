"""Trials of the checks of steps, loads, masses and rotations on random scenes."""

from __future__ import annotations

import math

import numpy as np

import mstmm
from mstmm.atlas.error_measures import refinement_correction
from mstmm.atlas.shared_scenes import rod, spinning_top
from mstmm.runtime.engine.jacobian import fastest_eigenvalue

from .trials import Scene, Trial, build_model, coordinate_error, run_trial, trial

Rng = np.random.Generator


def log_uniform(rng: Rng, low: float, high: float) -> float:
    """Random number, uniform in its logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def rod_row(rng: Rng, count: int, law: Scene, first_law: Scene | None = None) -> Scene:
    """Rods of different mass on pins in a row; `first_law` overrides `law` for the first hinge."""
    bodies = [rod(f"rod{i}", mass=log_uniform(rng, 0.3, 3.0)) for i in range(count)]
    hinges = [
        {"name": f"pin{i}", "type": "pin", "outboard": f"rod{i}",
         "inboard": f"rod{i - 1}.tip" if i else "ground",
         "initial": {"q": [float(rng.uniform(-0.5, 0.5))]},
         "law": law if i or first_law is None else law | first_law}
        for i in range(count)
    ]  # fmt: skip
    return {"body": bodies, "hinge": hinges}


def explicit_step(rng: Rng) -> Trial:
    """Springs and dampers by explicit methods; the step is drawn against the fastest motion."""
    law = {"stiffness": log_uniform(rng, 10, 1e5), "damping": log_uniform(rng, 1e-2, 1e3)}
    tested = build_model(rod_row(rng, int(rng.integers(1, 5)), law))
    q, u = tested.initial_state()
    rate = abs(
        fastest_eigenvalue(tested.looped, 0.0, np.append(q, u), tested.looped.start_memory())[0]
    )
    step_rate = log_uniform(rng, 0.2, 20)
    step = step_rate / rate
    t_end = 60 * step
    method = str(rng.choice(["rk4", "dopri5", "dop853"]))
    run, risks = run_trial(tested, t_end, method=method, step=step)
    exact = tested.simulate(t_end, rtol=1e-11, atol=1e-13, output_times=run.t)
    return trial(step_rate, run, risks, coordinate_error(run, exact) / 0.1)


def implicit_step(rng: Rng) -> Trial:
    """Swinging rods by implicit fixed steps, drawn against their period."""
    tested = build_model(rod_row(rng, int(rng.integers(1, 4)), {}) | {"gravity": [9.81, 0, 0]})
    step = log_uniform(rng, 2e-3, 1.0)
    t_end = max(2.0, 5 * step)
    method = str(rng.choice(["genalpha", "rodas4p2", "esdirk436", "hht"]))
    run, risks = run_trial(tested, t_end, method=method, step=step)
    exact = tested.simulate(t_end, rtol=1e-11, atol=1e-13, output_times=run.t)
    return trial(step, run, risks, coordinate_error(run, exact) / 0.1)


def pulse_in_angle(rng: Rng) -> Trial:
    """A load that is narrow in an angle, with adaptive steps; some within comparisons, with other
    laws, or with few output times."""
    width, position = log_uniform(rng, 1e-4, 1.0), float(rng.uniform(2.0, 6.0))
    push = f"{0.5 / width / math.sqrt(math.pi)!r}*exp(-((q - {position!r})/{width!r})^2)"
    if rng.random() < 0.3:
        low, high = position - 6 * width, position + 6 * width
        push = f"where(q > {low!r}, where(q < {high!r}, {push}, 0), 0)"
    law = {"stiffness": float(rng.choice([0.0, 0.3])), "damping": float(rng.choice([0.0, 0.02]))}
    scene = rod_row(rng, int(rng.integers(1, 3)), law, {"effort": push})
    scene["hinge"][0]["initial"]["u"] = [float(rng.uniform(3.0, 5.0))]
    tested, rtol = build_model(scene), log_uniform(rng, 1e-9, 1e-4)
    times = None if rng.random() < 0.5 else np.linspace(0, 3.0, int(rng.integers(2, 20)))
    method = str(rng.choice(["dop853", "dopri5", "auto"]))
    run, risks = run_trial(
        tested, 3.0, method=method, rtol=rtol, atol=rtol / 100, output_times=times
    )
    short_steps = mstmm.methods.Method(max_step=min(0.05, width / 10))
    exact = tested.simulate(3.0, short_steps, rtol=1e-11, atol=1e-13, output_times=run.t)
    return trial(width, run, risks, coordinate_error(run, exact) / max(1e-3, 100 * rtol))


def pulse_in_time(rng: Rng) -> Trial:
    """A load that is narrow in time, with fixed steps."""
    step, position = log_uniform(rng, 1e-3, 5e-2), float(rng.uniform(0.5, 1.5))
    ratio = log_uniform(rng, 0.02, 20)
    width = ratio * step
    push = f"{0.3 / width / math.sqrt(math.pi)!r}*exp(-((t - {position!r})/{width!r})^2)"
    tested = build_model(rod_row(rng, int(rng.integers(1, 4)), {"damping": 0.05}, {"effort": push}))
    run, risks = run_trial(tested, 2.0, method="rk4", step=step)
    exact = tested.simulate(2.0, rtol=1e-11, atol=1e-13, output_times=run.t)
    return trial(ratio, run, risks, coordinate_error(run, exact) / 1e-3)


def heavy_tip(rng: Rng) -> Trial:
    """Light rods with a heavy one; error of accelerations by refinement."""
    count, mass = int(rng.integers(3, 10)), log_uniform(rng, 1e2, 1e13)
    position = count - 1 if rng.random() < 0.8 else int(rng.integers(count))
    bodies = [
        rod(f"rod{i}", mass=mass if i == position else log_uniform(rng, 0.5, 2.0))
        for i in range(count)
    ]
    hinge_type = str(rng.choice(["pin", "ball"]))
    hinges: list[Scene] = [
        {"name": f"h{i}", "type": hinge_type, "outboard": f"rod{i}",
         "inboard": f"rod{i - 1}.tip" if i else "ground"}
        for i in range(count)
    ]  # fmt: skip
    for hinge in hinges if hinge_type == "pin" else ():
        hinge["initial"] = {"q": [float(rng.uniform(-1.5, 1.5))]}
    for hinge in hinges if hinge_type == "ball" else ():
        quaternion = rng.normal(size=4)
        hinge["initial"] = {"q": (quaternion / np.linalg.norm(quaternion)).tolist()}
    scene = {"gravity": [0, -9.81, 0], "body": bodies, "hinge": hinges}
    tested = build_model(scene, sweep="riccati")
    run, risks = run_trial(tested, 0.0)
    return trial(mass, run, risks, refinement_correction(tested, [tested.initial_state()]) / 1e-8)


def gimbal_top(rng: Rng) -> Trial:
    """A free top on three angles near gimbal lock, with fixed and adaptive steps."""
    distance = log_uniform(rng, 1e-6, 0.5)
    spin = float(rng.uniform(0.5, 2.0))
    angular_velocity = [spin * math.sin(distance), spin * math.cos(distance), 0.0]
    tested, t_end = spinning_top("gimbal"), 2.0 / spin
    fixed = rng.random() < 0.5
    step, rtol = log_uniform(rng, 2e-4, 1e-2), log_uniform(rng, 1e-9, 1e-5)
    settings = {"method": "rk4", "step": step} if fixed else {"rtol": rtol, "atol": rtol / 100}
    run, risks = run_trial(
        tested, t_end, initial=([0.0, 0.0, distance], angular_velocity), **settings
    )
    start = [math.cos(distance / 2), 0.0, 0.0, math.sin(distance / 2)]
    exact = spinning_top("ball").simulate(
        t_end, rtol=1e-12, atol=1e-14, initial=(start, angular_velocity), output_times=[t_end]
    )
    if not run.success:
        return trial(distance, run, risks, math.inf)
    a, b = run.orientation("top")[-1], exact.orientation("top")[-1]
    error = min(np.abs(a - b).max(), np.abs(a + b).max())
    return trial(distance, run, risks, float(error) / (1e-5 if fixed else 10 * rtol))


def loose_balls(rng: Rng) -> Trial:
    """Tumbling bodies on balls, tolerances from loose to tight."""
    count, rtol = int(rng.integers(1, 4)), log_uniform(rng, 1e-8, 3e-2)
    bodies = [rod(f"rod{i}", inertia=(0.05, 0.12, 0.1)) for i in range(count)]
    hinges = [
        {"name": f"h{i}", "type": "ball", "outboard": f"rod{i}",
         "inboard": f"rod{i - 1}.tip" if i else "ground",
         "initial": {"u": rng.uniform(-3, 3, 3).tolist()}}
        for i in range(count)
    ]  # fmt: skip
    tested = build_model({"gravity": [0, -9.81, 0], "body": bodies, "hinge": hinges})
    times = np.linspace(0, 2, 41)
    method = str(rng.choice(["dop853", "dopri5", "rodas4p2", "scipy-RK45"]))
    run, risks = run_trial(tested, 2.0, method=method, rtol=rtol, atol=rtol, output_times=times)
    exact = tested.simulate(2.0, rtol=1e-12, atol=1e-14, output_times=times)
    return trial(rtol, run, risks, coordinate_error(run, exact) / 1e-2)
