"""The bar of the elastic tests: 1 x 0.05 x 0.02 m of aluminium, between two ends."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

import mstmm
from mstmm.runtime.flexible.elastic.craig_bampton import Reduction, reduce
from mstmm.runtime.flexible.elastic.finite_element_model import ElasticModel
from mstmm.runtime.flexible.elastic.interface_nodes import select_port
from mstmm.runtime.flexible.elastic.modal_elastic import elastic_bodies, elastic_model
from mstmm.runtime.flexible.modal_body import ModalBody

Array = NDArray[np.float64]

YOUNG, DENSITY, HEIGHT, WIDTH, LENGTH = 7e10, 2700.0, 0.02, 0.05, 1.0
MASS = DENSITY * HEIGHT * WIDTH * LENGTH
#: Bending stiffness for deflections along z and along y.
EI_Z, EI_Y = YOUNG * WIDTH * HEIGHT**3 / 12, YOUNG * HEIGHT * WIDTH**3 / 12
ENDS = {"root": {"plane": [1, 0, 0, 0.0]}, "tip": {"plane": [1, 0, 0, LENGTH]}}


def table(**changes: Any) -> dict[str, Any]:
    """An [[elastic]] table of the bar, its keys replaced by `changes`."""
    corner = [0, -WIDTH / 2, -HEIGHT / 2]
    box = {"size": [LENGTH, WIDTH, HEIGHT], "divisions": [20, 1, 1], "corner": corner}
    whole = {
        "name": "bar", "box": box, "young": YOUNG, "poisson": 0.3, "density": DENSITY, "modes": 4,
        "ends": ENDS,
    } | changes  # fmt: skip
    return {key: value for key, value in whole.items() if value is not None}


def from_arrays(**changes: Any) -> dict[str, Any]:
    """An [[elastic]] table made of matrices in memory."""
    none = dict.fromkeys(("box", "young", "poisson", "density"))
    return table(**none, **changes)


def scene(elastic: dict[str, Any], hinge: str = "fixed", **more: Any) -> mstmm.Scene:
    """The bar on a hinge at its root, a load at its tip."""
    holding = {"name": "held", "type": hinge, "inboard": "ground", "outboard": "bar.root"}
    load = {"on": "bar.tip", "force": [0, 0, 1.0]}
    tables: dict[str, Any] = {"hinge": [holding], "load": [load]} | more
    return mstmm.Scene(gravity=[0, 0, -9.81], elastic=[elastic], **tables)


def body(elastic: dict[str, Any], hinge: str = "fixed", **more: Any) -> ModalBody:
    """The modal body of the bar; made once for each description."""
    return _body(json.dumps(elastic), hinge, json.dumps(more))


@cache
def _body(elastic: str, hinge: str, more: str) -> ModalBody:
    return elastic_bodies(scene(json.loads(elastic), hinge, **json.loads(more)))["bar"]


def frequencies(found: ModalBody) -> Array:
    """Of the modes, rad/s."""
    squares = np.diag(found.K) / np.diag(found.Mff)
    return np.asarray(np.sqrt(squares))


def short(elements: int = 5) -> dict[str, Any]:
    """The box of a coarse mesh, for what does not ask for accuracy."""
    return table()["box"] | {"divisions": [elements, 1, 1]}


@cache
def model(poisson: float = 0.3, elements: int = 20) -> ElasticModel:
    """Quadratic hexahedra in one row."""
    return elastic_model(scene(table(poisson=poisson, box=short(elements))).elastic[0])


@cache
def reduction(poisson: float, modes: int, frame: str = "tangent") -> Reduction:
    """The bar's shapes, with both ends loaded."""
    found, ends = model(poisson), scene(table()).elastic[0].ends
    ports = [select_port(found, name, end, True) for name, end in ends.items()]
    return reduce(found, ports, ports[0], modes, frame)
