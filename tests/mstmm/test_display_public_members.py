"""Public members: `dir` shows what the reference documents, and nothing of pydantic."""

from __future__ import annotations

import inspect
import re

import numpy as np
import pytest

import mstmm
from mstmm.display import PublicMembers
from mstmm.runtime.linear.linear_model import Linear
from mstmm.runtime.linear.modes import Modes
from mstmm.runtime.model.session import Session
from tests.support.paths import EXAMPLES, ROOT

API = ROOT / "docs" / "reference" / "api"


@pytest.fixture(scope="module")
def objects() -> dict[type[PublicMembers], PublicMembers]:
    model = mstmm.compile(mstmm.load_scene(EXAMPLES / "simple_pendulum" / "scene.toml"), "looped")
    linear = model.linearize()
    return {
        mstmm.Scene: model.scene, mstmm.Model: model, Session: model.session(), Linear: linear,
        mstmm.Result: model.simulate(0.1), Modes: linear.modes(),
    }  # fmt: skip


@pytest.mark.parametrize("cls", [mstmm.Scene, mstmm.Model, mstmm.Result, Session, Linear, Modes])
def test_dir_shows_documented_members(
    cls: type[PublicMembers], objects: dict[type[PublicMembers], PublicMembers]
) -> None:
    names = [name for group in cls.public_members().values() for name in group]
    assert len(names) == len(set(names))
    shown = [name for name in dir(objects[cls]) if not name.startswith("_")]
    assert shown == sorted(names)
    tables = {*mstmm.Scene.model_fields} if cls is mstmm.Scene else set()
    texts = [(base.__doc__ or "").partition("Attributes:")[2] for base in cls.__mro__]
    attributes = set(re.findall(r"[a-z]\w*", " ".join(texts)))
    for name in {*names} - tables - attributes:
        assert inspect.getdoc(inspect.getattr_static(cls, name)), name
    pages = [page.read_text(encoding="utf-8") for page in API.glob("*.md")]
    assert any(f"member-groups:: {prefix}{cls.__name__}\n" in page
               for page in pages for prefix in ("mstmm.", f"{cls.__module__}."))  # fmt: skip


def test_simulate_has_few_parameters() -> None:
    for method in (mstmm.Model.simulate, mstmm.Model.simulate_batch, mstmm.Model.session):
        assert len(inspect.signature(method).parameters) - 1 <= 12


def test_methods_hold_their_own_options() -> None:
    model = mstmm.compile(mstmm.load_scene(EXAMPLES / "simple_pendulum" / "scene.toml"), "looped")
    method = mstmm.methods.GeneralizedAlpha(radius=0.5)
    run = model.simulate(0.1, method, step=0.01)
    assert (run.settings.method, run.settings.radius) == ("genalpha", 0.5)
    other = model.simulate(0.1, "genalpha", step=0.01)
    assert not np.array_equal(run.q, other.q)
    assert mstmm.methods.method("genalpha", radius=0.5) == method
    with pytest.raises(mstmm.SceneError, match=r'radius: method "dop853" has no such option'):
        mstmm.methods.method("dop853", radius=0.5)
