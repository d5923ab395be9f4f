"""Every compiled kernel agrees with its equations, with its IR, and with mechanics."""

import json
from pathlib import Path

import pytest

from mstmm.bridge.crosscheck import Report, crosscheck
from mstmm.derive.catalogue.kernels import built_in
from mstmm.errors import ElementError

MANIFEST = Path(__file__).resolve().parents[2] / "generated" / "manifest.json"
ELEMENTS = [(e["kind"], e["name"]) for e in json.loads(MANIFEST.read_text())["elements"]]


@pytest.fixture(scope="module")
def reports() -> dict[tuple[str, str], Report]:
    """Reports by element, each made once."""
    return {}


@pytest.mark.parametrize(("kind", "name"), ELEMENTS)
def test_element_agrees(kind: str, name: str, reports: dict[tuple[str, str], Report]) -> None:
    report = reports[kind, name] = crosscheck(kind, name, points=1)
    assert report.passed, str(report)
    for kernel in report.kernels:
        assert kernel.equations is not None
        assert kernel.compiled is not None
        assert kernel.points - kernel.stopped >= 2
    if kind in ("hinge", "body", "force") or name.startswith(("generic", "laws")):
        assert report.statements
    assert json.loads(json.dumps(report.to_json()))["passed"]
    assert str(report).startswith(f"{kind} {name}: agrees")


def test_every_compiled_element_has_derivations() -> None:
    assert set(ELEMENTS) == set(built_in())


def test_unknown_element_is_refused() -> None:
    with pytest.raises(ElementError, match="no hinge called 'pinn'"):
        crosscheck("hinge", "pinn")
