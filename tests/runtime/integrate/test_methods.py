"""Methods as objects: families, options, and what is refused."""

from __future__ import annotations

import dataclasses

import pytest

import mstmm
from mstmm.errors import SceneError
from mstmm.runtime.integrate.methods import FAMILIES, to_method
from mstmm.runtime.integrate.settings import Settings
from mstmm.runtime.integrate.steppers import BUILT_IN, IMPLICIT, METHODS_WITH_RADIUS
from mstmm.runtime.run import classical_run
from tests.support.scenes.results import pins


def test_a_name_has_the_options_of_its_family() -> None:
    for name in (*BUILT_IN, *classical_run.METHODS, "auto", "scipy-BDF"):
        found = mstmm.methods.method(name)
        assert found.name == name and to_method(name) == found
        assert ("radius" in found.options) == (name in METHODS_WITH_RADIUS)
        assert ("tangent" in found.options) == (name in IMPLICIT)
        assert ("scheme" in found.options) == (name in classical_run.METHODS)


def test_defaults_are_those_of_the_settings_of_a_run() -> None:
    defaults = {field.name: field.default for field in dataclasses.fields(Settings)}
    for family in FAMILIES:
        assert family().options.items() <= defaults.items(), family


@pytest.mark.parametrize(
    ("name", "option", "owner"),
    [
        ("dop853", "radius", "methods with it: genalpha, dttmm"),
        ("newmark", "radius", "methods with it: genalpha, dttmm"),
        ("dop853", "tangent", "methods with it: rodas4"),
        ("genalpha", "scheme", "methods with it: dttmm-classical"),
        ("genalpha", "rtol", "no method has it"),
    ],
)
def test_an_option_of_another_family_is_refused(name: str, option: str, owner: str) -> None:
    words = f'{option}: method "{name}" has no such option; {owner}'
    with pytest.raises(SceneError, match=words):
        mstmm.methods.method(name, **{option: 0.5})


def test_an_object_is_not_changed_and_reaches_the_run() -> None:
    method = mstmm.methods.method("genalpha", radius=0.3, max_steps=50)
    assert to_method(method) is method
    model = mstmm.compile(pins(1, [0.3]), engine="looped")
    settings = model.simulate(0.1, method, step=0.01).settings
    assert (settings.method, settings.radius, settings.max_steps) == ("genalpha", 0.3, 50)
    assert model.session(method=method, step=0.01).settings.radius == 0.3


def test_without_a_name_the_method_is_chosen() -> None:
    model = mstmm.compile(pins(1, [0.3]), engine="looped")
    limited = mstmm.methods.Method(max_step=0.05)
    run, plain = model.simulate(0.5, limited), model.simulate(0.5)
    assert run.settings.max_step == 0.05 and run.settings.method == plain.settings.method
    assert model.simulate(0.5, limited, rtol=1e-3).success
    assert model.session(method=limited).settings.method == "dop853"
