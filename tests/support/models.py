"""The model behind a result, for runs of it that are made otherwise."""

from __future__ import annotations

import mstmm
from mstmm.runtime.result.result import Result


def model_of(result: Result) -> mstmm.Model:
    """What ran, as the user had it."""
    assert isinstance(result.model, mstmm.Model)
    return result.model
