"""Bodies whose shapes are their rigid-body motions: loads in balance do no work on them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mstmm.runtime.flexible.modal_body import ModalBody


def rigid_shapes(body: ModalBody) -> ModalBody:
    """The same body with its six rigid-body motions for shapes."""
    eps = np.zeros((3, 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        eps[i, j, k], eps[i, k, j] = 1.0, -1.0
    none, unit = np.zeros((6, 6)), np.eye(3)
    moved = np.einsum("a,bk->abk", body.first, unit)
    turned = np.einsum("bkc,ac->abk", eps, body.second)
    return replace(
        body, modes=tuple("123456"), K=none, D=none, G=np.zeros((3, 6, 6)),
        C=np.hstack([body.mass * unit, np.einsum("bkc,c->bk", eps, body.first)]),
        E=np.concatenate([moved, turned], axis=2), F=np.zeros((3, 3, 6, 6)),
        X=np.zeros((3, 3, 6, 6)),
        ports={
            name: replace(
                port,
                phi=np.hstack([unit, np.einsum("bkc,c->bk", eps, port.position)]),
                theta=np.hstack([np.zeros((3, 3)), unit]),
            )
            for name, port in body.ports.items()
        },
    )  # fmt: skip
