"""Windows of four-bars in a row, two and forty, through ten seconds and their singular poses.

Statements: (1) the cranks go round as one pendulum does, I theta'' = -W cos(theta) with
I = (N + 1)/3 + N and W = 9.81 ((N + 1)/2 + N), with an error that follows the tolerance, and energy
stays.  (2) At the end they are side by side to 1e-12 rad, although in every pose flat on the
ground, where couplers and cranks are in line, each window could fold.  (3) Of five rows a window
two say anything, one motion is left.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import mstmm

SCENE = Path(__file__).with_name("scene.toml")
TIMES = np.linspace(0.0, 10.0, 101)


def windows(count: int) -> mstmm.Scene:
    """The scene with its window repeated."""
    data = tomllib.loads(SCENE.read_text(encoding="utf-8"))

    def moved_on(text: str, k: int) -> str:
        onward = re.sub(r"^([a-z]+)1", rf"\g<1>{k}", text)
        return re.sub(r"^crank0", f"crank{k - 1}", onward)

    for table in ("body", "hinge"):
        first = [one for one in data[table] if one["name"].endswith("1")]
        for k in range(2, count + 1):
            for one in first:
                new = {key: moved_on(x, k) if isinstance(x, str) else x for key, x in one.items()}
                if "position" in one:
                    new["position"] = [k, 0, 0]
                data[table].append(new)
    return mstmm.Scene(**data)


def pendulum(count: int) -> NDArray[np.float64]:
    """Angles of the cranks at TIMES, from their one equation."""
    ratio = 9.81 * ((count + 1) / 2 + count) / ((count + 1) / 3 + count)
    done = solve_ivp(
        lambda _, y: [y[1], -ratio * np.cos(y[0])], (0.0, 10.0), [np.pi / 2, -1.0], "DOP853",
        t_eval=TIMES, rtol=1e-13, atol=1e-13,
    )  # fmt: skip
    return np.asarray(done.y[0])


def main() -> None:
    """All three statements for two windows and for forty."""
    for count in (2, 40):
        model = mstmm.compile(windows(count))
        loops = model.loops
        assert (len(loops.constraint_rows), loops.rank, loops.mobility) == (5 * count, 2 * count, 1)
        cranks = [
            model.coordinate_layout.hinges[f"foot{k}"].q_slice.start for k in range(count + 1)
        ]
        wanted = pendulum(count)
        for rtol, bound in ((1e-6, 1e-3), (1e-9, 1e-6)):
            result = model.simulate(10.0, "dop853", rtol=rtol, atol=1e-3 * rtol, output_times=TIMES)
            assert result.success, result.message
            angles = result.q[:, cranks]
            apart = np.ptp(angles[-1])
            error = np.abs(angles[:, 0] - wanted).max()
            energy = result.energy()
            kept = np.abs(energy - energy[0]).max() / energy[0]
            steps = result.statistics
            assert steps is not None
            print(
                f"{count} windows, rtol {rtol:.0e}: off by {error:.1e} rad, cranks apart by "
                f"{apart:.0e}, energy by {kept:.1e}, {steps.evaluations} evaluations"
            )
            assert error < bound
            assert apart < 1e-12
            assert kept < bound


if __name__ == "__main__":
    main()
