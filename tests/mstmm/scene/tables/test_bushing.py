"""[[bushing]]: what is accepted, what is refused, and what a file says of it."""

from __future__ import annotations

import tomllib
from typing import Any

import numpy as np
import pytest

from mstmm.errors import SceneError
from mstmm.scene import Scene
from mstmm.scene.tables.bushing import full_matrix
from tests.support.scenes.minimal import Data, arm

SIX = [1.0, 2, 3, 4, 5, 6]
#: Symmetric, without negative eigenvalues, and singular.
FULL = (np.diag(SIX) + np.eye(6, k=1) + np.eye(6, k=-1)) * 2


def mount(**changes: Any) -> Data:
    bushing = {"name": "mount", "from": "rod1.tip", "to": "ground", "stiffness": SIX}
    return arm(bushing=[{k: v for k, v in (bushing | changes).items() if v is not ...}])


def test_matrices_as_they_are_written() -> None:
    upper = FULL[np.triu_indices(6)].tolist()
    for given in (FULL.tolist(), upper, FULL):
        assert full_matrix(Scene(**mount(damping=given)).bushing[0].damping) == FULL.tolist()
    (one,) = Scene(**mount()).bushing
    assert full_matrix(one.stiffness) == np.diag(SIX).tolist()


def test_a_file_holds_it_all() -> None:
    scene = Scene(**mount(name=..., damping=FULL.tolist(), preload=[0, 1, 0, 0, 0, 2.0],
                            rest={"position": [0, 0.1, 0], "orientation": [0.1, 0, 0]},
                            position=[1, 2, 3], orientation=[0, 0, "30*deg"]))  # fmt: skip
    assert scene.bushing[0].name == "bushing1"
    assert Scene.from_data(tomllib.loads(scene.to_toml())) == scene


def skew(entry: float) -> Any:
    matrix = FULL.copy()
    matrix[0, 4] = entry
    return matrix.tolist()


def test_matrices_of_bearings() -> None:
    """Any matrix, in six rows, as 36 numbers, or two rows across the axis x."""
    across = [[3.0, 1.0], [-2.0, 4.0]]
    (one,) = Scene(**mount(stiffness=across, damping=skew(1.0), conservative=False)).bushing
    known = np.zeros((6, 6))
    known[1:3, 1:3] = across
    np.testing.assert_array_equal(full_matrix(one.stiffness), known)
    np.testing.assert_array_equal(full_matrix(one.damping), skew(1.0))
    assert one.element == "bearing6"
    scene = Scene(**mount(stiffness=known, conservative=False))
    assert scene.bushing[0].element == "bearing3"
    assert Scene.from_data(tomllib.loads(scene.to_toml())) == scene
    (gaining,) = Scene(**mount(stiffness=[-1.0, *SIX[1:]], conservative=False)).bushing
    assert full_matrix(gaining.stiffness)[0][0] == -1


BAD = [
    (mount(to="rod1"), 'to: both ends are on "rod1", so it has no effect; connect two bodies'),
    (mount(to="rod2", position=[1, 0, 0]), "only a bushing on the ground has a position"),
    (mount(stiffness=...), "stiffness: missing; a bushing needs stiffness, damping or a preload"),
    (mount(**{"from": "rod1.end"}), 'from: body "rod1" has no end "end"; the only one is tip'),
    (mount(to="rod3"), 'to: there is no body "rod3"'),
    (mount(stiffness=SIX[:5]), "stiffness: expected 6 numbers, three in N/m and three in N m"),
    (mount(stiffness=[*SIX[:5], "soft"]), "stiffness[5]: expected a number, found 'soft'"),
    (mount(damping=[SIX] * 5 + [SIX[:4]]), "damping[5]: expected 6 numbers"),
    (mount(damping=skew(1.0)), "expected a symmetric matrix, found 1 at [0][4] and 0 at [4][0]"),
    (mount(stiffness=[[1, 2], [3, 4]]), "set conservative = false if that is intended"),
    (mount(stiffness=[[1, 2], [3]], conservative=False), "stiffness[1]: expected 6 numbers"),
    (mount(conservative=1), "conservative: expected true or false"),
    (mount(stiffness=[-1.0, *SIX[1:]]), "adds energy to a motion (along x); correct its signs"),
    (mount(stiffness=(FULL - 3 * np.eye(6)).tolist()), "expected a matrix without negative"),
    (
        mount(damping=(FULL - np.diag([0, 0, 0, 8, 0, 0])).tolist()),
        "adds energy to a motion (about x)",
    ),
    (mount(preload=[1, 2, 3]), "preload: expected three forces in N and three moments in N m"),
    (mount(rest=[1, 2]), "rest.position: expected three numbers"),
    (mount(name="rod1"), 'name: "rod1" is also the name of a body; rename one'),
    (mount(elastic=1), "elastic: unknown key"),
]


@pytest.mark.parametrize(("data", "expected"), BAD, ids=range(len(BAD)))
def test_refused(data: Data, expected: str) -> None:
    with pytest.raises(SceneError) as caught:
        Scene.from_data(data, "arm.toml")
    (line,) = str(caught.value).splitlines()
    assert line.startswith("arm.toml: bushing ")
    assert expected in line
