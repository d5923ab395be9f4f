"""A corner of a car over a bump, then steered, against geometry and Lagrange's equations.

Statements: (1) balls close two loops by six independent rows, and the mobility is 2.  (2) The
car stands still before the bump.  (3) Over three seconds upright and tie rod are where circles and
spheres put them for the angle of the lower wishbone and the place of the rack, to 1e-9 m, and loops
are closed.  (4) Accelerations of car and wishbone are those of Lagrange's equations for thirty mass
points (`geometry.py`).  (5) Camber and steer of the wheel change by less than 0.6 degrees over the
bump, and the rack turns it by more than seven.
"""

from __future__ import annotations

from pathlib import Path

import geometry
import numpy as np

import mstmm

SCENE = Path(__file__).with_name("scene.toml")
DRIVEN = ("heave", "lower_axis", "steering", "bump")
POINTS = ("upright", "upright.top", "upright.arm", "upright.hub", "tie")


def places(heave: float, angle: float, rack: float) -> np.ndarray:
    """POINTS by circles and spheres (5, 3)."""
    found = geometry.frames(heave, angle, rack)
    foot, turned = found["upright"]
    ends = [turned @ geometry.end("upright", name) for name in ("top", "arm", "hub")]
    return np.array([foot, *(foot + one for one in ends), found["tie"][0]])


def moved(result: mstmm.Result) -> tuple[np.ndarray, np.ndarray]:
    """q and u (times, 4) of heave, lower wishbone, rack and road."""
    slots = [result.model.coordinate_layout.hinges[name] for name in DRIVEN]
    return result.q[:, [one.q for one in slots]], result.u[:, [one.u for one in slots]]


def attitudes(q: np.ndarray) -> np.ndarray:
    """Camber and steer (times, 2) of the wheel, whose axle lies along y, in degrees."""
    turned = np.array([geometry.frames(*row[:3])["upright"][1] for row in q])
    return np.degrees(np.stack([np.arcsin(turned[:, 2, 1]), -np.arcsin(turned[:, 0, 1])], axis=-1))


def main() -> None:
    """All five statements."""
    model = mstmm.compile(mstmm.load_scene(SCENE))
    loops = model.loops
    print(
        f"cut: {', '.join(loops.cut_hinges)}; {loops.rank} of {len(loops.constraint_rows)} rows "
        f"count"
    )
    # A drive for the rack, one for the road.
    assert (len(loops.constraint_rows), loops.rank, loops.mobility) == (6, 6, 2)

    result = model.simulate(3.0, rtol=1e-8, output_times=np.linspace(0.0, 3.0, 151))
    assert result.success, result.message
    q, u = moved(result)
    before = result.t < 0.2
    still = np.abs(q[before, :2]).max()
    print(f"before the bump the car moves by {still:.1e} m")
    assert still < 1e-4

    wanted = np.array([places(*row[:3]) for row in q])
    found = np.stack([result.position(name) for name in POINTS], axis=1)
    apart = np.abs(found - wanted).max()
    gaps = [
        np.abs(result.position(one) - result.position(other)).max()
        for one, other in (("upper.ball", "upright.top"), ("tie.ball", "upright.arm"))
    ]
    print(f"points off their circles by {apart:.1e} m, loops open by {max(gaps):.1e} m")
    assert apart < 1e-9
    assert max(gaps) < 1e-12

    error, largest = 0.0, 0.0
    pushed = [result.quantity(f"{name}.udot").values for name in DRIVEN]
    for row in range(0, len(q), 5):
        udot = np.array([one[row] for one in pushed])
        lagrange = geometry.accelerations(q[row], u[row], udot[2:])
        error = max(error, float(np.abs(udot[:2] - lagrange).max()))
        largest = max(largest, float(np.abs(lagrange).max()))
    print(f"accelerations up to {largest:.3g}, off by {error:.1e} of that of Lagrange")
    assert error < 1e-6 * largest

    turns = attitudes(q) - attitudes(q[:1])
    camber, steer = np.ptp(turns[result.t < 1.0], axis=0)
    steered = turns[-1, 1]
    print(
        f"over the bump camber {camber:.2f} and steer {steer:.2f} degrees; "
        f"steered by {steered:.1f} degrees"
    )
    assert max(camber, steer) < 0.6
    assert steered > 7.0


if __name__ == "__main__":
    main()
