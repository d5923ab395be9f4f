"""Matrices and ends that describe no free elastic body: one clear SceneError each."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg
from numpy.typing import NDArray

from mstmm.errors import SceneError
from mstmm.runtime.flexible.elastic.matrices import save_matrices
from tests.support.scenes import elastic_bar as bar

Array = NDArray[np.float64]
Arrays = dict[str, Any]


def matrices() -> Arrays:
    model = bar.model(elements=1)
    return {
        "mass": model.mass.toarray(), "stiffness": model.stiffness.toarray(),
        "nodes": model.nodes.copy(), "scalar_mass": model.scalar_mass.toarray(),
    }  # fmt: skip


def refusal(elastic: dict[str, Any], **more: Any) -> str:
    with pytest.raises(SceneError) as caught:
        bar.body(elastic, **more)
    message = str(caught.value)
    assert message.startswith('elastic "bar"'), message
    assert "\n" not in message
    return message


def unsymmetric(a: Arrays) -> None:
    a["stiffness"][3, 7] += 1e3


def triangle(a: Arrays) -> None:
    a["mass"] = np.triu(a["mass"])


def negative_mass(a: Arrays) -> None:
    a["mass"] = a["mass"] - 1.5 * np.diag(np.diag(a["mass"]))


def indefinite_stiffness(a: Arrays) -> None:
    """A self-balanced pattern of forces, so that rigid-body motions still cost nothing."""
    model = bar.model(elements=1)
    draw = np.random.default_rng(2).normal(size=len(a["stiffness"]))
    draw -= (
        model.rigid_displacements @ np.linalg.lstsq(model.rigid_displacements, draw, rcond=None)[0]
    )
    a["stiffness"] = a["stiffness"] - 1e8 * np.outer(draw, draw)


def scale_stiffness(a: Arrays) -> None:
    a["stiffness"][0, 0] *= 1.1


def shuffled_nodes(a: Arrays) -> None:
    a["nodes"] = a["nodes"][::-1]


def lost_direction(a: Arrays) -> None:
    a["mass"][1::3] *= 0.5
    a["mass"][:, 1::3] *= 0.5


def pieces(a: Arrays) -> None:
    """The bar twice, side by side."""
    n = len(a["nodes"])
    for key in ("mass", "stiffness"):
        a[key] = scipy.linalg.block_diag(a[key], a[key])
    a["nodes"] = np.vstack([a["nodes"], a["nodes"] + [0, 1.0, 0]])
    a["scalar_mass"] = None
    assert len(a["nodes"]) == 2 * n


def other_scalar(a: Arrays) -> None:
    a["scalar_mass"] = a["scalar_mass"] * 2


def not_numbers(a: Arrays) -> None:
    a["stiffness"][0, 0] = np.nan


def too_small(a: Arrays) -> None:
    a["mass"], a["stiffness"] = a["mass"][:-3, :-3], a["stiffness"][:-3, :-3]


def not_square(a: Arrays) -> None:
    a["mass"] = a["mass"][:-1]


def shrink_mass(a: Arrays) -> None:
    a["mass"] = a["mass"][:-3, :-3]


def flat_nodes(a: Arrays) -> None:
    a["nodes"] = a["nodes"][:, :2]


def clear_stiffness(a: Arrays) -> None:
    a["stiffness"] = np.zeros_like(a["stiffness"])


CASES: list[tuple[Callable[[Arrays], None], list[str]]] = [
    (unsymmetric, ["stiffness: expected a symmetric matrix", "row", "column"]),
    (triangle, ["mass: expected a symmetric matrix", "triangle"]),
    (negative_mass, ["mass: expected a positive semidefinite matrix", "diagonal"]),
    (indefinite_stiffness, ["stiffness: expected a positive semidefinite matrix", "negative"]),
    (
        scale_stiffness,
        ["stiffness: expected no force in rigid-body motions", "translation", "free body"],
    ),
    (shuffled_nodes, ["stiffness: expected no force in rigid-body motions", "rotation"]),
    (lost_direction, ["mass: expected the same mass in kg along x, y and z", "2.7", "order"]),
    (pieces, ["expected one connected body, found 2 pieces"]),
    (other_scalar, ["scalar_mass: expected the mass matrix", "leave it out"]),
    (not_numbers, ["stiffness: expected finite numbers, found nan"]),
    (too_small, ["expected 3 or 6 unknowns for each of 27 nodes", "found 78"]),
    (not_square, ["mass: expected a square matrix"]),
    (shrink_mass, ["mass and stiffness: expected the same size, found 78 and 81 rows"]),
    (flat_nodes, ["nodes: expected N rows of x, y, z in m"]),
    (clear_stiffness, ["stiffness: expected a matrix of an elastic body, found only zeros"]),
]


#: Names of cases whose functions have others: they are in the names of the tests.
IDS = {"scale_stiffness": "held", "shrink_mass": "unlike", "clear_stiffness": "nothing"}
CASE_IDS = [IDS.get(case[0].__name__, case[0].__name__) for case in CASES]


@pytest.mark.parametrize(("spoil", "words"), CASES, ids=CASE_IDS)
def test_matrices(tmp_path: Path, spoil: Callable[[Arrays], None], words: list[str]) -> None:
    arrays = matrices()
    spoil(arrays)
    path = save_matrices(tmp_path / "bar.npz", **arrays)
    message = refusal(bar.from_arrays(matrices=str(path)))
    assert "(bar.npz)" in message
    for word in words:
        assert word in message


def test_the_unspoiled_matrices_are_accepted(tmp_path: Path) -> None:
    path = save_matrices(tmp_path / "bar.npz", **matrices())
    assert bar.body(bar.from_arrays(matrices=str(path))).n == 10


def plain_file(path: Path) -> None:
    path.write_bytes(b"no arrays")


def one_array(path: Path) -> None:
    with path.open("wb") as file:
        np.save(file, np.eye(3))


def without_nodes(path: Path) -> None:
    np.savez(path, mass=np.eye(3), stiffness=np.eye(3))


def odd_key(path: Path) -> None:
    np.savez(path, mass=np.eye(3), stifness=np.eye(3), nodes=np.zeros((1, 3)))


def half_sparse(path: Path) -> None:
    np.savez(path, mass_data=np.ones(3), mass_indptr=np.arange(4), nodes=np.zeros((1, 3)))


def odd_order(path: Path) -> None:
    np.savez(path, mass=np.eye(3), stiffness=np.eye(3), nodes=np.zeros((1, 3)), order="both")


@pytest.mark.parametrize(
    ("write", "words"),
    [
        (None, "there is no file"),
        (plain_file, "is not a file of arrays"),
        (one_array, "is not a file of arrays"),
        (without_nodes, "the array 'nodes' is missing"),
        (odd_key, "unknown array 'stifness'; did you mean \"stiffness\"?"),
        (half_sparse, "a sparse mass needs mass_data, mass_indices, mass_indptr"),
        (odd_order, 'order: expected "node"'),
    ],
)
def test_files(tmp_path: Path, write: Callable[[Path], None] | None, words: str) -> None:
    path = tmp_path / "bar.npz"
    if write is not None:
        write(path)
    assert words in refusal(bar.from_arrays(matrices=str(path)))


SPOILED: dict[str, tuple[Callable[[Arrays], object], str]] = {
    "column out of range": (lambda z: z["mass_indices"].__setitem__(5, 10**8), "columns from 0"),
    "negative column": (lambda z: z["mass_indices"].__setitem__(0, -7), "columns from 0 to 80"),
    "falling rows": (lambda z: z["stiffness_indptr"].__setitem__(3, 0), "numbers that rise"),
    "rows beyond the data": (lambda z: z["mass_indptr"].__setitem__(-1, 10**6), "that rise from 0"),
    "short indices": (
        lambda z: z.update(mass_indices=z["mass_indices"][:-1]), "one per entry of data"
    ),
    "indices that are no whole numbers": (
        lambda z: z.update(mass_indices=z["mass_indices"] + 0.5), "mass_indices: expected whole"
    ),
    "a table of rows": (
        lambda z: z.update(mass_indptr=z["mass_indptr"][None]), "mass_indptr: expected whole"
    ),
    "one number": (lambda z: z.update(mass_indptr=np.array(3)), "mass_indptr: expected whole"),
}  # fmt: skip


@pytest.mark.parametrize("how", SPOILED)
def test_sparse_parts_that_do_not_fit(tmp_path: Path, how: str) -> None:
    """SciPy takes them, and reads and writes beyond its arrays."""
    spoil, words = SPOILED[how]
    model = bar.model(elements=1)
    path = save_matrices(tmp_path / "bar.npz", model.mass, model.stiffness, model.nodes)
    with np.load(path) as file:
        arrays = dict(file)
    spoil(arrays)
    np.savez(path, **arrays)
    message = refusal(bar.from_arrays(matrices=str(path)))
    assert words in message and "is not a sparse matrix in row form" in message


def test_a_file_cut_off_anywhere(tmp_path: Path) -> None:
    model = bar.model(elements=1)
    path = save_matrices(tmp_path / "bar.npz", model.mass, model.stiffness, model.nodes)
    whole = path.read_bytes()
    for length in range(0, len(whole), len(whole) // 40):
        path.write_bytes(whole[:length])
        assert "is not a file of arrays" in refusal(bar.from_arrays(matrices=str(path)))


def test_a_file_with_changed_bytes(tmp_path: Path, rng: np.random.Generator) -> None:
    """Refused, or as good as it was: the checksums of the archive see most changes."""
    model = bar.model(elements=1)
    path = save_matrices(tmp_path / "bar.npz", model.mass, model.stiffness, model.nodes)
    whole = path.read_bytes()
    for _ in range(60):
        content = bytearray(whole)
        content[rng.integers(len(whole))] ^= 1 << int(rng.integers(8))
        path.write_bytes(content)
        try:
            bar.body(bar.from_arrays(matrices=str(path)))
        except SceneError as error:
            assert str(error).startswith('elastic "bar"')


def test_an_archive_whose_header_is_no_text(tmp_path: Path) -> None:
    """Python 3.12 has an exception of its own for it."""
    path, header = tmp_path / "bar.npz", io.BytesIO()
    np.save(header, np.ones(3))
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("mass.npy", header.getvalue().replace(b"'descr':", b"'descr'\x0f"))
    with pytest.raises(SceneError, match="is not a file of arrays"):
        bar.body(bar.from_arrays(matrices=str(path)))


def test_whatever_a_reader_makes_of_damage_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stumble(*_: object, **__: object) -> None:
        raise LookupError

    (tmp_path / "bar.npz").write_bytes(b"PK")
    monkeypatch.setattr(np, "load", stumble)
    with pytest.raises(SceneError, match=r"is not a file of arrays \(.npz\): LookupError"):
        bar.body(bar.from_arrays(matrices=str(tmp_path / "bar.npz")))


FACE = [[0, -1, -1], [0, 1, 1]]


@pytest.mark.parametrize(
    ("end", "words"),
    [
        ({"plane": [1, 0, 0, 1.5]}, ["ends.tip: the plane contains no node", "0.5 m away"]),
        ({"box": [[2, 0, 0], [3, 1, 1]]}, ["the box contains no node", "[1, ", "1 m away"]),
        ({"sphere": [0, 0, 9, 0.1]}, ["the sphere contains no node"]),
        ({"nodes": [7, 100000]}, ["nodes: expected numbers from 0 to", "found 100000"]),
        ({"nodes": [7]}, ["three or more nodes that do not lie on one line", "found 1"]),
        ({"box": [[0.8, -0.025, -0.01], [1, -0.025, -0.01]]}, ["found 3 on a line"]),
        ({"box": FACE}, ["ends.tip and ends.root share node"]),
    ],
)
def test_ends(end: dict[str, Any], words: list[str]) -> None:
    ends = bar.ENDS | {"tip": end}
    message = refusal(bar.table(box=bar.short(), ends=ends))
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"modes": 199, "box": bar.short(1)}, ["modes: expected at most 27", "found 199"]),
        ({"highest_frequency": 1.0}, ["highest_frequency: expected at least the lowest"]),
        ({"initial": {"eta": [0.1]}}, ["initial.eta: expected 10 numbers", "found 1"]),
        ({"damping": [0.1, 0.1]}, ["damping: expected one ratio, or one for each of 10"]),
    ],
)
def test_shapes(changes: dict[str, Any], words: list[str]) -> None:
    message = refusal(bar.table(**{"box": bar.short()} | changes))
    for word in words:
        assert word in message


def test_no_shape_at_all() -> None:
    ends = {"root": bar.ENDS["root"]}
    one = bar.table(box=bar.short(), ends=ends, modes=0)
    with pytest.raises(SceneError, match=r"modes = 0 leaves no shape, .*give modes = 1"):
        bar.body(one, load=[])


def test_mechanism_inside() -> None:
    """Two bars joined at one node: a ball joint, which no strain resists."""
    arrays = matrices()
    n = len(arrays["nodes"])
    other = np.arange(n)
    tip = int(np.argmax(arrays["nodes"] @ [1.0, 0.1, 0.1]))
    mirrored = arrays["nodes"] @ np.diag([-1.0, 1, 1]) + [2 * bar.LENGTH, 0, 0]
    place = np.where(other == tip, tip, n + other - (other > tip))
    size = 3 * (2 * n - 1)
    whole = {"mass": np.zeros((size, size)), "stiffness": np.zeros((size, size))}
    for key, matrix in whole.items():
        flip = np.kron(np.eye(n), np.diag([-1.0, 1, 1]))
        matrix[: 3 * n, : 3 * n] += arrays[key]
        where = (3 * place[:, None] + np.arange(3)).ravel()
        matrix[np.ix_(where, where)] += flip @ arrays[key] @ flip
    nodes = np.zeros((2 * n - 1, 3))
    nodes[place], nodes[:n] = mirrored, arrays["nodes"]
    joined = {key: matrix.tolist() for key, matrix in whole.items()} | {"nodes": nodes.tolist()}
    message = refusal(bar.from_arrays(arrays=joined, ends={"root": bar.ENDS["root"]}, modes=6),
                      load=[])  # fmt: skip
    assert "without" in message
    assert "mechanism" in message
