"""The linear model of a sprayer with its boom, against every node of the boom and a long run.

    python examples/spray_boom/check.py

`whole.py` is the second program: all 396 free unknowns of both wings, no shapes and no sweep.
"""

from __future__ import annotations

import warnings
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import fsolve

import mstmm

Whole: Any = import_module("whole").Whole  # beside this file
SCENE = Path(__file__).with_name("scene.toml")
INPUTS = ["cylinder", "road_roll", "road_roll_rate", "ground.acceleration.z"]
OUTPUTS = ["left_tip", "left_half", "right_tip"]
OMEGA = 2 * np.pi * np.geomspace(0.05, 5.0, 40)
Array = NDArray[np.float64]


def model(modes: int | None = None) -> mstmm.Model:
    """The scene, with this many shapes of each wing."""
    scene = mstmm.load_scene(SCENE)
    if modes is not None:
        wings = tuple(wing.model_copy(update={"modes": modes}) for wing in scene.elastic)
        scene = scene.model_copy(update={"elastic": wings})
    return mstmm.compile(scene, engine="looped")


def check_trapezoid(c: dict[str, float]) -> None:
    """Both links keep their length: where the boom's pivots go when it rolls."""
    a, b, h = c["a"], c["b"], c["h"]
    length, depth = np.hypot(b - a, h), 0.3  # m, of a point below the pivots

    def links(middle: Array, roll: float) -> list[float]:
        y, z = middle
        ends = [(y + s * b * np.cos(roll) - s * a, z + s * b * np.sin(roll)) for s in (1, -1)]
        return [np.hypot(*end) - length for end in ends]

    def point(roll: float) -> Array:
        middle = fsolve(links, [0.0, -h], args=(roll,), xtol=1e-14)
        return np.asarray(middle + depth * np.array([np.sin(roll), -np.cos(roll)]))

    step = 1e-3
    left, rest, right = point(-step), point(0.0), point(step)
    centre, climb = h * b / (b - a), a * b * length**2 / (h * (b - a) ** 2)
    radius = (right - left)[0] / (2 * step)
    curve = (left + right - 2 * rest)[1] / step**2
    print(f"trapezoid: turns {radius - depth:.5f} m above the pivots (formula {centre:.5f}), "
          f"climbs {curve - radius:.5f} m more than a pin there (formula {climb:.5f})")  # fmt: skip
    assert abs(radius - depth - centre) < 1e-5 and abs(curve - radius - climb) < 1e-5


def check_modes(every: Array) -> None:
    """The table of motions; effective masses are all the mass there is."""
    linear = model().linearize()
    assert not linear.warnings and np.abs(linear.state.u).max() == 0
    modes, undamped = linear.modes(), linear.modes(damped=False)
    print("   Hz  damping  without  of all nodes   moves most")
    for k in range(11):
        hertz = [x / (2 * np.pi) for x in (modes.omega[k], undamped.omega[k], every[k])]
        print(
            f"{hertz[0]:6.3f}  {modes.damping_ratio[k]:.4f}  {hertz[1]:7.4f}  {hertz[2]:9.5f}      "
            f"{', '.join(modes.dominant_coordinates(k)[:3])}"
        )
    assert undamped.is_complete and np.abs(undamped.omega[:11] / every[:11] - 1).max() < 1e-4
    mass = 9500.0 + 90.0 + 160.0 + 2 * 230.4473927787
    total = undamped.effective_modal_mass.sum(axis=0)
    print(f"effective masses add up to {total.round(4)} of {mass:.4f} kg")
    np.testing.assert_allclose(total, mass, rtol=1e-9)


def check_shapes(whole: Any, every: Array) -> None:
    """More and more shapes, to all that the wings have."""
    reference = whole.response(OMEGA)
    print("shapes of a wing: parts apart from all nodes, motions below 4 Hz and tips up to 5 Hz")
    for count, bounds in {8: (1e-4, 2e-2), 24: (1e-5, 1e-3), 48: (1e-7, 2e-6),
                          99: (1e-7, 1e-8)}.items():  # fmt: skip
        linear = model(count).linearize(inputs=INPUTS)
        found = linear.frequency_response(OMEGA, outputs=OUTPUTS).response
        apart = np.abs(linear.modes(damped=False).omega[:11] / every[:11] - 1).max()
        tips = np.abs(found / reference - 1).max()
        print(f"{count:5}: {apart:.1e}, {tips:.1e}")
        assert apart < bounds[0] and tips < bounds[1], (count, apart, tips)


def check_dense() -> None:
    """The sweep, frequency by frequency, against the matrices."""
    linear = model().linearize(inputs=INPUTS)
    found = linear.frequency_response(OMEGA, outputs=linear.coordinate_names).response
    worst = 0.0
    for w, values in zip(OMEGA, found, strict=True):
        dense = np.linalg.solve(linear.K + 1j * w * linear.C - w**2 * linear.M, linear.V)
        worst = max(worst, float((np.abs(values - dense) / np.abs(dense).max(axis=0)).max()))
    print(f"sweep and dense solution: {worst:.1e} apart")
    assert worst < 1e-11


def sine(hertz: float, periods: int, amplitude: float, quarter: bool = False) -> dict[str, Any]:
    """A signal: sin, or with `quarter` cos, along a cubic spline."""
    times = np.linspace(0, periods / hertz, 24 * periods + 1)
    shape = np.cos if quarter else np.sin
    values = amplitude * shape(2 * np.pi * hertz * times)
    return {"times": times, "values": values, "interpolation": "cubic"}


def check_run(hertz: float, periods: int, inputs: dict[str, Any], pushes: list[complex]) -> None:
    """The scene itself under a small sine, from rest until only the sine is left."""
    scene = model()
    linear = scene.linearize(inputs=INPUTS)
    omega = 2 * np.pi * hertz
    answer = linear.frequency_response([omega], outputs=OUTPUTS).response[0] @ np.array(pushes)
    times = np.linspace((periods - 1) / hertz, periods / hertz, 25)
    run = scene.simulate(
        times[-1], initial=(linear.state.q, linear.state.u), inputs=inputs, output_times=times,
        rtol=1e-8, atol=1e-11,
    )  # fmt: skip
    assert run.success, run.message
    turns = np.stack([np.sin(omega * times), np.cos(omega * times), np.ones_like(times)], axis=1)
    for name, expected in zip(OUTPUTS, answer, strict=True):
        along, ahead, _ = np.linalg.lstsq(turns, run.quantity(name).values, rcond=None)[0]
        apart = abs(along + 1j * ahead - expected) / abs(expected)
        print(f"{hertz} Hz, {name}: {1e3 * abs(expected):.4f} mm, "
              f"{np.degrees(np.angle(expected)):.2f} deg; the run {apart:.1e} apart")  # fmt: skip
        assert apart < 1e-4


def main() -> None:
    """The statements of README.md."""
    warnings.simplefilter("error")
    whole = Whole()
    every = whole.omega(11)
    check_trapezoid(whole.constants)
    check_modes(every)
    check_dense()
    check_shapes(whole, every)
    check_run(0.3, 30, {"cylinder": sine(0.3, 30, 10.0)}, [10, 0, 0, 0])
    tilt, rate = 1e-4, 1e-4 * 2 * np.pi * 2.9
    road = {"road_roll": sine(2.9, 220, tilt), "road_roll_rate": sine(2.9, 220, rate, True)}
    check_run(2.9, 220, road, [0, tilt, 1j * rate, 0])


if __name__ == "__main__":
    main()
