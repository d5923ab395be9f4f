"""Every compiled kernel agrees with its equations, with its IR, and with mechanics."""

import json
import re

import pytest

from mstmm.derive.catalogue.kernels import built_in
from mstmm.derive.codegen.kernel_calls import NAMED_CALLEES
from mstmm.errors import ElementError
from mstmm.pipeline.crosscheck import CrossCheckReport, crosscheck
from mstmm.runtime.kernels import prebuilt_kernels
from mstmm.runtime.libraries.build_extension import hand_written_sources
from tests.support.paths import ROOT

GENERATED = ROOT / "generated"
ELEMENTS = [
    (entry["kind"], entry["name"])
    for entry in json.loads((GENERATED / "catalogue.json").read_text())
]
#: Elements whose kernels are those of others where some numbers are known.
INSTANCES = {("sweep", "planar_pin")}
#: Kernels made from others: all derivatives of an output, several steps in one.
MADE = {
    "load_by_motion", "rates_by_coordinates", "rates_by_speeds", "body_motion", "directions",
}  # fmt: skip


@pytest.fixture(scope="module")
def reports() -> dict[tuple[str, str], CrossCheckReport]:
    """Reports by element, each made once."""
    return {}


def c_kernel_names(kind: str, name: str) -> set[str]:
    """The kernels of an element that have a C function."""
    element = prebuilt_kernels.elements().get((kind, name))
    return set(element.functions) if element else set()


@pytest.mark.parametrize(("kind", "name"), ELEMENTS)
def test_element_agrees(
    kind: str, name: str, reports: dict[tuple[str, str], CrossCheckReport]
) -> None:
    report = reports[kind, name] = crosscheck(kind, name, points=1)
    assert report.passed, str(report)
    for kernel in report.kernels:
        derived = kernel.kernel.endswith("_slope") or kernel.kernel in MADE
        derived |= (kind, name) in INSTANCES
        assert (kernel.equations is None) == derived
        assert kernel.compiled is not None
        assert kernel.interpreted == (kernel.kernel not in c_kernel_names(kind, name))
        assert kernel.points - kernel.stopped >= 2
    if kind in ("hinge", "body", "force") or name.startswith(("generic", "laws")):
        assert report.statements
    assert json.loads(json.dumps(report.to_json()))["passed"]
    assert str(report).startswith(f"{kind} {name}: agrees")


def test_every_listed_element_has_derivations() -> None:
    assert set(ELEMENTS) == set(built_in()) | INSTANCES > set(prebuilt_kernels.elements())


def test_what_no_run_calls_has_no_c() -> None:
    """Functions that the engine's C, or Python by a descriptor, calls; and no others but these."""
    printed = [GENERATED / name for name in ("sweep_steps.c", "link_steps.h")]
    paths = [*hand_written_sources(GENERATED.parent), *printed]
    text = "".join(path.read_text() for path in paths)
    called = set(re.findall(r"\bmstmm_(\w+)\(", text))
    pasted = re.findall(r"\bmstmm_(\w+?)##pairing##(\w+)\(", text)
    pairings = set(re.findall(r"\b(?:CALL|BY_SPACE)\((\w+),", text))
    called |= {before + pairing + behind for before, behind in pasted for pairing in pairings}
    short = {key: name for name, key in NAMED_CALLEES.items()}
    by_name = {
        "hinge", "forward", "condense", "recover", "angle", "singularity", "inertia", "bias_load",
        "energy", "wrench", "linear", "full", "rotation", "six", "turn",
    }  # fmt: skip
    by_name |= {f"{name}_slope" for name in by_name} | MADE
    for (kind, name), element in prebuilt_kernels.elements().items():
        family = "generic" if name.startswith("generic") else short.get((kind, name))
        plain = kind in ("hinge", "body", "force") or name.startswith(("link_", "laws"))
        for kernel in element.functions:
            known = f"{family}_{kernel}" in called or (plain and kernel in by_name)
            assert known, (kind, name, kernel)


def test_unknown_element_is_refused() -> None:
    with pytest.raises(ElementError, match="no hinge named 'pinn'"):
        crosscheck("hinge", "pinn")
