"""Rejection of flexible bodies that cannot be computed in double precision."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from mstmm.errors import SceneError

if TYPE_CHECKING:
    from .modal_body import ModalBody


def checked_result(what: str, make: Callable[[], ModalBody]) -> ModalBody:
    """Body that `make` returns.

    Raises SceneError naming `what`, such as 'beam "b"', for a singular matrix or an overflow.
    """
    try:
        with np.errstate(all="ignore"):
            body = make()
    except np.linalg.LinAlgError as failure:
        raise _precision_error(what, str(failure).lower()) from None
    ports = [values for port in body.ports.values() for values in vars(port).values()]
    arrays = [body.second, body.C, body.E, body.F, body.G, body.X, body.K, body.D, *ports]
    if not all(np.isfinite(values).all() for values in arrays):
        raise _precision_error(what, "overflow")
    return body


def _precision_error(what: str, why: str) -> SceneError:
    return SceneError(
        f"{what}: its shapes and masses cannot be computed in double precision ({why}); look for "
        "masses, stiffnesses or lengths that differ by too many orders of magnitude, or use fewer "
        "shapes"
    )
