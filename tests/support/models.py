"""Models behind results, and what is packed otherwise in them than their scenes say."""

from __future__ import annotations

import mstmm
from mstmm.runtime.packing.merging.simplification import Simplification
from mstmm.runtime.result.result import Result


def model_of(result: Result) -> mstmm.Model:
    """What ran, as the user had it."""
    assert isinstance(result.model, mstmm.Model)
    return result.model


def otherwise(model: mstmm.Model) -> list[Simplification]:
    """What is packed otherwise, but for links, which nearly every scene has."""
    return [one for one in model.simplifications if one.kind != "links"]
