"""A flexible arm brought to rest by LQR with an observer, in the scene and from Python.

Statement: the controller that is designed on the linear model holds the nonlinear arm, run in C by
the scene's [[controller]] or in Python over a session, with the same motion; and for a small turn
the motion is that of the linear closed loop, advanced by matrix powers.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray

import mstmm

SCENE = Path(__file__).with_name("scene.toml")
SAMPLE = 0.01  # s
MEASURED = ["turn", "gyro"]
Array = NDArray[np.float64]
STEPS: dict[str, Any] = {"method": "dop853", "step": SAMPLE / 4}
COUNT = 400


def linear_model() -> Any:
    """The arm near rest at its goal, pushed by the motor."""
    model = mstmm.compile(mstmm.load_scene(SCENE))
    return model.linearize(q=np.zeros(model.nq), inputs=["motor"])


def plant_of(linear: Any) -> Any:
    """Its system between samples, under a motor that is held."""
    return control.sample_system(linear.to_control(MEASURED), SAMPLE)


def regulator(linear: Any) -> dict[str, Any]:
    """A [[controller]]: x estimates the states of the arm from what was measured, and the motor
    pushes against what is estimated."""
    plant, n = plant_of(linear), len(linear)
    tip, _ = linear.output_matrices(["arm.tip.position.y"])
    weights = 100 * tip.T @ tip + np.diag([1.0] * n + [0.1] * n)
    gain = control.dlqr(plant, weights, np.array([[0.3]]))[0]
    noise = np.diag([1e-6, 1e-4])
    observer = control.dlqe(plant.A, plant.B, plant.C, np.array([[1.0]]), noise)[0]
    inner = plant.A - plant.B @ gain - observer @ plant.C + observer @ plant.D @ gain
    start = np.zeros(2 * n)
    start[0] = -1.0  # the encoder says where the arm begins
    return {
        "name": "regulator", "sample_time": SAMPLE, "inputs": MEASURED, "outputs": ["motor"],
        "A": inner.tolist(), "B": observer.tolist(), "C": (-gain).tolist(),
        "D": [[0.0] * len(MEASURED)], "initial": start.tolist(),
    }  # fmt: skip


def closed(controller: dict[str, Any], q: float = -1.0) -> mstmm.Scene:
    """The scene with the controller in it, the arm beginning at the angle q (rad)."""
    data = tomllib.loads(SCENE.read_text())
    data["hinge"][0]["initial"] = {"q": [q]}
    begun = [q, *controller["initial"][1:]] if controller["initial"] else []
    return mstmm.Scene(**data, controller=[controller | {"initial": begun}])


def in_c(controller: dict[str, Any], q: float) -> mstmm.Result:
    """The loop closed in the scene."""
    times = np.arange(COUNT + 1) * SAMPLE
    model = mstmm.compile(closed(controller, q))
    return model.simulate(times[-1], output_times=times, **STEPS)


def in_python(controller: dict[str, Any], q: float) -> tuple[Array, Array]:
    """The same by ticks: q (COUNT + 1, nq) and the motor's moment at the samples."""
    model = mstmm.compile(mstmm.load_scene(SCENE))
    start = np.zeros(model.nq)
    start[0] = q
    session = model.session(start, np.zeros(model.nu), **STEPS)
    a, b, c = (np.array(controller[key]) for key in "ABC")
    x = np.array([q, *controller["initial"][1:]])
    rows, pushes = [session.q], []
    for _ in range(COUNT):
        seen = session.outputs()
        motor = (c @ x)[0]
        x = a @ x + b @ [seen["turn"], seen["gyro"]]
        session.advance(SAMPLE, {"motor": motor})
        rows.append(session.q)
        pushes.append(motor)
    return np.array(rows), np.array(pushes)


def by_powers(controller: dict[str, Any], plant: Any, q: float) -> Array:
    """Angles (COUNT + 1,) of the linear closed loop."""
    a, b, c = (np.array(controller[key]) for key in "ABC")
    loop = np.block([[plant.A, plant.B @ c], [b @ plant.C, a + b @ plant.D @ c]])
    state = np.zeros(len(loop))
    state[0] = state[len(plant.A)] = q
    found = [state]
    for _ in range(COUNT):
        found.append(loop @ found[-1])
    return np.array(found)[:, 0]


def main() -> None:
    """Design, close the loop both ways, compare with the linear one."""
    linear = linear_model()
    controller, plant = regulator(linear), plant_of(linear)
    result = in_c(controller, -1.0)
    assert result.success, result.message
    q, pushes = in_python(controller, -1.0)
    apart = float(abs(result.q - q).max())
    motor = float(abs(result.quantity("motor").values[:-1] - pushes).max())
    late = float(abs(result.position("arm.tip")[300:, 1]).max())
    print(f"in C and from Python: q apart by {apart:.1e}, the motor by {motor:.1e} N m")
    print(f"the tip swings by {1e3 * late:.2f} mm behind 3 s")
    assert apart < 1e-12 and motor < 1e-10 and late < 0.005
    small = in_c(controller, -1e-3)
    linear_angle = by_powers(controller, plant, -1e-3)
    off = float(abs(small.q[:, 0] - linear_angle).max()) / 1e-3
    print(f"a turn of 1 mrad: {off:.1e} of it from the linear closed loop")
    assert off < 1e-7


if __name__ == "__main__":
    main()
