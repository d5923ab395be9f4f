"""Bodies whose numbers defeat linear algebra: refused by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from mstmm.errors import SceneError

if TYPE_CHECKING:
    from .modal_body import ModalBody


def checked_result(what: str, make: Callable[[], ModalBody]) -> ModalBody:
    """What `make` gives; SceneError naming `what`, such as 'beam "b"', where a matrix on the way is
    singular or a number of the body overflows."""
    try:
        with np.errstate(all="ignore"):
            body = make()
    except np.linalg.LinAlgError as failure:
        raise _refused(what, str(failure).lower()) from None
    ports = [array for port in body.ports.values() for array in vars(port).values()]
    numbers = [body.second, body.C, body.E, body.F, body.G, body.X, body.K, body.D, *ports]
    if not all(np.isfinite(array).all() for array in numbers):
        raise _refused(what, "overflow")
    return body


def _refused(what: str, why: str) -> SceneError:
    return SceneError(
        f"{what}: its shapes and masses cannot be computed in double precision ({why}); look for "
        "masses, stiffnesses or lengths of its parts that lie too far apart, or take fewer shapes"
    )
