"""Compiles scenes; gives the model behind a result and what was simplified in it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mstmm
from mstmm.runtime.packing.simplification import Simplification
from mstmm.runtime.result.result import Result


def compile_scene(scene: Mapping[str, Any], engine: str = "auto", **options: Any) -> mstmm.Model:
    """Model of a scene given as a dictionary."""
    return mstmm.compile(mstmm.Scene(**scene), engine, **options)


def looped_model(scene: Mapping[str, Any]) -> mstmm.Model:
    """Model of a scene given as a dictionary, on the looped engine."""
    return compile_scene(scene, "looped")


def model_of(result: Result) -> mstmm.Model:
    """Model that was simulated, as the user had it."""
    assert isinstance(result.model, mstmm.Model)
    return result.model


def non_link_simplifications(model: mstmm.Model) -> list[Simplification]:
    """Simplifications except links, which nearly every scene has."""
    return [one for one in model.simplifications if one.kind != "links"]
