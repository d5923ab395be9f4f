"""The generated text: deterministic, accepted by the compiler, safe against any name or message."""

from __future__ import annotations

import dataclasses
import json
import os
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import jinja2
import pytest

from mstmm.abi import element_library as abi
from mstmm.derive.codegen.kernel_text import comment_text, literal_text, string_literal
from mstmm.derive.codegen.template_rendering import (
    element_source,
    generated_files,
    registry_source,
    write_generated,
)
from mstmm.ir import Assign, Constant, Guard, KernelIR, Port, Store, Temporary
from mstmm.ir.element_spec import ElementSpec, Param, element_from_json, element_to_json
from mstmm.ir.graph import Graph
from tests.support.kernels.c_library import build, compile_library
from tests.support.kernels.random_kernels import element, random_kernel
from tests.support.paths import ROOT

SPEC = element("drawn", random_kernel("first", 1), random_kernel("second", 2))
NASTY = 'a "quoted" \\ back\\n slash ??/ trigraph */ end /* begin \x07 Größe\nline \\'

DIGEST = """
import hashlib, sys
sys.path.insert(0, sys.argv[1])
from tests.support.kernels.random_kernels import element, random_kernel
from mstmm.derive.codegen.template_rendering import generated_files
files = generated_files([element("b", random_kernel("k", 1)), element("a", random_kernel("k", 2))])
for name, text in files.items():
    print(name, hashlib.sha256(text.encode()).hexdigest())
"""


def test_two_processes_with_other_hash_seeds_write_the_same_bytes() -> None:
    root = str(ROOT)
    outputs = [
        subprocess.run(
            [sys.executable, "-c", DIGEST, root],
            env=os.environ | {"PYTHONHASHSEED": seed, "PYTHONPATH": root},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("1", "2")
    ]
    assert outputs[0] == outputs[1]
    assert "hinge_a.c" in outputs[0] and "tape.h" in outputs[0]


def test_the_order_of_the_specs_does_not_matter() -> None:
    other = element("another", random_kernel("k", 3))
    assert generated_files([SPEC, other]) == generated_files([other, SPEC])


def test_two_elements_of_one_name_are_refused() -> None:
    with pytest.raises(ValueError, match="two elements have the name hinge 'drawn'"):
        generated_files([SPEC, SPEC])


def test_files_written_are_the_files_generated(tmp_path: Path) -> None:
    paths = write_generated([SPEC], tmp_path / "new" / "folder")
    texts = {path.name: path.read_text(encoding="utf-8") for path in paths}
    assert texts == generated_files([SPEC])
    assert set(texts) >= {
        "mstmm.h", "elements.h", "registry.c", "manifest.json", "hinge_drawn.c",
        "hinge_drawn.json", "tape.h", "fused.h", "failures.h",
    }  # fmt: skip
    manifest = json.loads(texts["manifest.json"])
    assert manifest["abi"] == abi.ABI_VERSION
    assert manifest["elements"] == [{"kind": "hinge", "name": "drawn", "hash": SPEC.hash()}]
    assert element_from_json(texts["hinge_drawn.json"]) == SPEC


def test_no_time_path_or_version_in_the_text() -> None:
    text = "\n".join(generated_files([SPEC]).values())
    for word in ("/work", str(Path.cwd()), "202", jinja2.__version__, sys.version.split()[0]):
        assert word not in text.replace(SPEC.hash(), ""), word


def nasty_spec() -> ElementSpec:
    """Every free text of a spec filled with what could break out of a literal or a comment."""
    kernel = KernelIR(
        "k",
        (Port("x", (2,), NASTY, NASTY), Port("unused", (), NASTY, NASTY)),
        (Port("y", (), NASTY, NASTY),),
        (
            Guard(Constant("1"), 3, NASTY),
            Assign(0, "neg", (Constant("-1/3"),)),
            Store("y", (), Temporary(0)),
        ),
        purpose=NASTY,
        sources=(NASTY,),
    )
    group = (Param(NASTY, NASTY, NASTY),)
    return ElementSpec("hinge", "nasty", NASTY, group, group, group, (kernel,), (NASTY,))


def test_free_text_cannot_break_the_c(tmp_path: Path) -> None:
    library = build(tmp_path, nasty_spec())
    found = library.elements["nasty"]
    assert library.text(found.q_names[0]) == NASTY
    assert library.text(found.p_units[0]) == NASTY
    assert library.text(library.kernel("nasty", "k").guards[0].message) == NASTY
    outcome = library.call("nasty", "k", {"x": [1.0, 2.0], "unused": [0.0]})
    assert (outcome.code, outcome.outputs["y"]) == (0, [1 / 3])
    assert element_from_json(element_to_json(nasty_spec())) == nasty_spec()


@pytest.mark.parametrize("name", ["a b", "x;y", "1st", "", "a-b", "größe", "a\n"])
def test_names_that_are_not_c_names_are_refused(name: str) -> None:
    with pytest.raises(ValueError, match="is no valid C name"):
        element_source(dataclasses.replace(SPEC, name=name))
    with pytest.raises(ValueError, match="is no valid C name"):
        element_source(element("e", KernelIR(name, (), (), ())))
    with pytest.raises(ValueError, match="is no valid C name"):
        element_source(element("e", KernelIR("k", (Port(name),), (), ())))


def test_the_descriptor_carries_the_spec(tmp_path: Path) -> None:
    library = build(tmp_path, SPEC)
    found = library.elements["drawn"]
    assert (found.abi, library.text(found.kind)) == (abi.ABI_VERSION, "hinge")
    assert library.text(found.hash) == SPEC.hash()
    assert (found.nq, found.nu, found.np, found.n_kernels) == (1, 1, 1, 2)
    assert library.text(found.q_names[0]) == "angle"
    assert library.text(found.u_units[0]) == "rad/s"
    kernel = library.kernel("drawn", "second")
    assert library.text(kernel.ir_hash) == SPEC.kernels[1].hash()
    ports = [kernel.inputs[i] for i in range(kernel.n_inputs)]
    assert [(library.text(p.name), p.length, p.power) for p in ports] == [("x", 4, 0), ("A", 6, 0)]


def test_an_element_without_anything_compiles(tmp_path: Path) -> None:
    bare = ElementSpec("body", "bare", "", (), (), (), (KernelIR("nothing", (), (), ()),))
    library = build(tmp_path, bare, dataclasses.replace(bare, name="barer", kernels=()))
    assert library.call("bare", "nothing", {}).code == 0
    assert library.elements["barer"].n_kernels == 0


def test_registry_without_elements_compiles(tmp_path: Path) -> None:
    write_generated([], tmp_path)
    compile_library([tmp_path / "registry.c"], tmp_path / "empty.so")
    assert "mstmm_element_count = 0" in registry_source([])


def test_a_generated_name_is_declared_as_it_is_defined(tmp_path: Path) -> None:
    """elements.h, included before the element's own file, must not contradict it."""
    write_generated([SPEC], tmp_path)
    unity = tmp_path / "unity.c"
    unity.write_text('#include "elements.h"\n#include "hinge_drawn.c"\n')
    # The declaration in the element's own file is then a second, equal one.
    compile_library([unity], tmp_path / "unity.so", "-Wno-redundant-decls")


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("3", "3.0"),
        ("-3", "(-3.0)"),
        ("1/2", "0.5"),
        ("1/3", "((real)1 / (real)3)"),
        ("-2/3", "(-((real)2 / (real)3))"),
        ("pi", "MSTMM_PI"),
        ("0", "0.0"),
        (str(Fraction(0.1)), "0.1"),
        ("1" + "0" * 30, "1e+30"),
        ("1/" + "1" + "0" * 30, "1e-30"),
    ],
)
def test_literals(text: str, written: str) -> None:
    assert literal_text(text) == written


def test_literals_mean_the_nearest_double(tmp_path: Path) -> None:
    texts = ["1/3", "-22/7", "123456789/1000000007", str(Fraction(0.1)), "pi", "10/3"]
    texts += ["98765432109876543210/12345678901234567891", str(2**70 + 1), "1/" + str(10**320)]
    graph = Graph()
    values = [graph.pi if text == "pi" else graph.constant(Fraction(text)) for text in texts]
    kernel = graph.kernel("k", [], [Port("y", (len(texts),))], {"y": values})
    found = build(tmp_path, element("literals", kernel)).call("literals", "k", {})
    assert found.outputs["y"] == [Constant(text).number for text in texts]


def test_string_and_comment() -> None:
    assert string_literal('a"b\\c?\n') == '"a\\042b\\134c\\077\\012"'
    assert comment_text("a */ b\n/* c \\") == "a * / b / * c"
    assert "*/" not in comment_text("**//**//")


def test_templates_are_strict() -> None:
    from mstmm.derive.codegen import template_rendering

    environment = template_rendering._environment()
    assert environment.undefined is jinja2.StrictUndefined
    assert environment.autoescape is False
    with pytest.raises(jinja2.UndefinedError):
        environment.from_string("{{ nothing }}").render()
