"""Render ElementSpecs as C text: pass names, numbers and expressions to the templates.

The templates only lay out text and contain no arithmetic or physics.  The output depends only on
the specs, not on time, path, version or the order of a set.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import jinja2

import mstmm.templates
from mstmm.abi import element_library as abi
from mstmm.abi import fused_library as fused_abi
from mstmm.abi.failure_codes import FailureCode
from mstmm.ir import OPERATIONS, Guard, KernelIR, Port, Solve
from mstmm.ir.element_spec import ElementSpec, Param, element_to_json
from mstmm.ir.hinge_properties import HingeProperties, hinge_properties_to_data
from mstmm.ir.statements import NEGATIVE_DETERMINANT
from mstmm.ir.tape import GUARD_OPCODE, INSTRUCTION_WIDTH, OPCODES, OUTPUT_WIDTH

from .kernel_calls import kernel_calls_header
from .kernel_text import (
    INDENT,
    KernelText,
    comment_text,
    solver_template,
    string_literal,
    wrapped_lines,
)
from .slot_storage import layout_header
from .sweep_text import REAL_PORTS, complex_kernels, complex_passes, sweep_files, to_complex
from .vector_loops import VECTORIZED_OUTPUTS

#: Run-time sizes for which the compiler unrolls the loops of a kernel.
_UNROLLED_SIZES = (1, 2, 3, 4)
#: Kinds of elements whose kernels are called through their descriptors only.
_KINDS_BY_DESCRIPTOR = ("hinge", "body", "force", "law")
#: Text that reads the run-time size.
_SIZE = re.compile(r"< n;|n \*")


def element_source(spec: ElementSpec) -> str:
    """C file of one element: a function and a trampoline per kernel that has C; the descriptor."""
    return _render("element.c.jinja", element=_element_view(spec))


def mstmm_header() -> str:
    """`mstmm.h`: scalar type, ABI number and descriptors."""
    return _render("mstmm.h.jinja")


def registry_source(specs: Sequence[ElementSpec]) -> str:
    """`registry.c`: table of the descriptors of elements with C, in the order given."""
    return _render("registry.c.jinja", elements=_summaries(specs))


def elements_header(specs: Sequence[ElementSpec]) -> str:
    """`elements.h`: descriptors, and the kernels that C calls by name."""
    return _render("elements.h.jinja", elements=_summaries(specs))


def engine_headers() -> dict[str, str]:
    """File name -> text of the engine's headers for tapes, fused libraries and failures."""
    return {name: _render(f"{name}.jinja") for name in ("tape.h", "fused.h", "failures.h")}


def manifest_text(specs: Sequence[ElementSpec], files: Mapping[str, str]) -> str:
    """`manifest.json`: ABI number, SHA-256 of the C text, names and hashes of elements.

    It detects a module that was compiled from other text (runtime/libraries/build_extension.py).
    """
    text = hashlib.sha256()
    for name in sorted(name for name in files if name.endswith((".c", ".h"))):
        text.update(f"{name}\n{files[name]}".encode())
    elements = [{"kind": s.kind, "name": s.name, "hash": s.hash()} for s in specs]
    head = {"abi": abi.ABI_VERSION, "sources": text.hexdigest()}
    return f'{json.dumps(head)[:-1]}, "elements": {_lines_of(elements)}}}\n'


def catalogue_text(specs: Iterable[ElementSpec]) -> str:
    """`catalogue.json`: element data for lists, without kernels."""
    entries = [
        {
            "kind": spec.kind,
            "name": spec.name,
            "title": spec.title,
            "coordinates": {p.name: p.unit for p in spec.coordinates},
            "speeds": {p.name: p.unit for p in spec.speeds},
            "parameters": {p.name: p.unit for p in spec.parameters},
            "sources": list(spec.sources),
        }
        for spec in specs
    ]
    return _lines_of(entries) + "\n"


def _lines_of(entries: Iterable[Any]) -> str:
    """JSON list with one entry a line."""
    return "[\n" + ",\n".join(map(json.dumps, entries)) + "\n]"


def generated_files(
    specs: Iterable[ElementSpec],
    *,
    hinges: Sequence[HingeProperties] = (),
    on_demand: Iterable[ElementSpec] = (),
) -> dict[str, str]:
    """File name -> text of everything generated, elements sorted by kind and name.

    `hinges` are the facts of the hinges that a scene may name.  `on_demand` are elements whose
    kernels are derived at first use; they are only listed in the catalogue.
    Raises ValueError if two elements share kind and name.
    """
    sorted_specs = sorted(specs, key=_sort_key)
    files = {
        "mstmm.h": mstmm_header(),
        "elements.h": elements_header(sorted_specs),
        **engine_headers(),
    }
    for spec in sorted_specs:
        stem = f"{spec.kind}_{spec.name}"
        if f"{stem}.json" in files:
            raise ValueError(f"two elements have the name {spec.kind} {spec.name!r}")
        if abi.has_c(spec):
            files[f"{stem}.c"] = element_source(spec)
        files[f"{stem}.json"] = element_to_json(spec)
    files["registry.c"] = registry_source(sorted_specs)
    if ("sweep", "frames") in {(spec.kind, spec.name) for spec in sorted_specs}:
        files |= _engine_files(sorted_specs)
    if hinges:
        files["hinges.json"] = _lines_of(map(hinge_properties_to_data, hinges)) + "\n"
    files["catalogue.json"] = catalogue_text(sorted((*sorted_specs, *on_demand), key=_sort_key))
    files["manifest.json"] = manifest_text(sorted_specs, files)
    return files


def _engine_files(specs: Sequence[ElementSpec]) -> dict[str, str]:
    """Generated files of the looped engine: named kernel calls, layout and passes."""
    specs_by_name = {(spec.kind, spec.name): spec for spec in specs}
    return {
        "kernel_calls.h": kernel_calls_header(specs_by_name),
        "layout.h": layout_header(),
        **sweep_files(specs_by_name),
        "complex_steps.c": complex_source(specs_by_name),
    }


def complex_source(specs: Mapping[tuple[str, str], ElementSpec]) -> str:
    """C text of `complex_steps.c`: elimination of the tangent matrix in complex numbers."""
    kernels = [_kernel_view(*pair, REAL_PORTS) for pair in complex_kernels(specs)]
    return to_complex(
        _render("complex_steps.c.jinja", kernels=kernels, passes=complex_passes(specs))
    )


def _sort_key(spec: ElementSpec) -> tuple[str, str]:
    return spec.kind, spec.name


def write_generated(
    specs: Iterable[ElementSpec],
    folder: Path | str,
    *,
    hinges: Sequence[HingeProperties] = (),
    on_demand: Iterable[ElementSpec] = (),
) -> list[Path]:
    """Write `generated_files` into `folder` (created if missing); returns the paths, sorted."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, text in generated_files(specs, hinges=hinges, on_demand=on_demand).items():
        path = target / name
        path.write_text(text, encoding="utf-8", newline="\n")
        paths.append(path)
    return sorted(paths)


@cache
def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(mstmm.templates.__path__[0]),
        undefined=jinja2.StrictUndefined,
        autoescape=False,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        newline_sequence="\n",
    )
    environment.filters["c_string"] = string_literal
    environment.filters["c_comment"] = comment_text
    environment.filters["c_lines"] = lambda text, indent=INDENT: "\n".join(
        wrapped_lines(text, indent)
    )
    return environment


def _render(name: str, **values: Any) -> str:
    return (
        _environment()
        .get_template(name)
        .render(
            abi=abi,
            fused_abi=fused_abi,
            tape=_tape_view(),
            failures=FailureCode,
            negative=NEGATIVE_DETERMINANT,
            **values,
        )
    )


def _tape_view() -> dict[str, Any]:
    """The tape's instruction set; operands are the interpreter's locals a, b, c."""
    truths = {"t0": "fabs(a) > 0", "t1": "fabs(b) > 0"}
    return {
        "guard": GUARD_OPCODE,
        "width": INSTRUCTION_WIDTH,
        "output_width": OUTPUT_WIDTH,
        "operations": [
            {
                "name": name,
                "code": OPCODES[name],
                "expression": row.c.format("a", "b", "c", **truths),
            }
            for name, row in OPERATIONS.items()
        ],
    }


def _summaries(specs: Sequence[ElementSpec]) -> list[dict[str, Any]]:
    return [
        {
            "symbol": abi.element_symbol(spec.kind, spec.name),
            "prototypes": [
                abi.prototype(spec.kind, spec.name, kernel)
                for kernel in abi.c_kernels(spec)
                if spec.kind not in _KINDS_BY_DESCRIPTOR
            ],
        }
        for spec in specs
        if abi.has_c(spec)
    ]


def _element_view(spec: ElementSpec) -> dict[str, Any]:
    symbol, kernels = abi.element_symbol(spec.kind, spec.name), abi.c_kernels(spec)
    return {
        "symbol": symbol,
        "kind": spec.kind,
        "name": spec.name,
        "title": spec.title,
        "sources": list(spec.sources),
        "hash": spec.hash(),
        "header": "mstmm.h" if spec.kind in _KINDS_BY_DESCRIPTOR else "elements.h",
        "replayed": [kernel.name for kernel in spec.kernels if kernel not in kernels],
        "solvers": sorted(
            {
                solver_template(s)
                for kernel in kernels
                for s in kernel.statements
                if isinstance(s, Solve)
            }
        ),
        "tables": [
            *_name_tables("q", spec.coordinates),
            *_name_tables("u", spec.speeds),
            *_name_tables("p", spec.parameters),
        ],
        "nq": len(spec.coordinates),
        "nu": len(spec.speeds),
        "np": len(spec.parameters),
        "two": any((spec.name, kernel.name) in VECTORIZED_OUTPUTS for kernel in kernels),
        "kernels": [_kernel_view(spec, kernel) for kernel in kernels],
    }


def _name_tables(letter: str, group: Sequence[Param]) -> list[dict[str, Any]]:
    return [
        {"name": f"{letter}_names", "entries": [string_literal(p.name) for p in group]},
        {"name": f"{letter}_units", "entries": [string_literal(p.unit) for p in group]},
    ]


def _kernel_view(
    spec: ElementSpec, kernel: KernelIR, plain: Collection[str] = ()
) -> dict[str, Any]:
    """Template data of a kernel; `plain` names inputs that stay real in complex kernels."""
    vector_outputs = () if plain else VECTORIZED_OUTPUTS.get((spec.name, kernel.name), ())
    text = KernelText(kernel, vector_outputs, plain)
    outputs = abi.c_outputs(kernel)
    names_read = text.used_names()
    arguments = ["n"] if kernel.size_symbol else []
    arguments += [f"in[{index}]" for index in range(len(kernel.inputs))]
    arguments += [f"out[{index}]" for index in range(len(outputs))]
    statements = text.statements()
    names_written = {text.names[s.port] for s in kernel.statements if hasattr(s, "port")}
    names = [text.names[port.name] for port in (*kernel.inputs, *kernel.outputs)]
    unused_names = [name for name in names if name not in names_read | names_written]
    uses_size = any(s["kind"] == "solve" or _SIZE.search(str(s)) for s in statements)
    solved_outputs = [s["output"] for s in statements if s["kind"] == "solve" and s["negative"]]
    guards = [(s.code, s.message) for s in kernel.statements if isinstance(s, (Guard, Solve))]
    guards += [(NEGATIVE_DETERMINANT, "the determinant is negative; all results are there")] * bool(
        solved_outputs
    )
    return {
        "name": kernel.name,
        "function": abi.kernel_symbol(spec.kind, spec.name, kernel.name),
        "prototype": abi.prototype(spec.kind, spec.name, kernel, plain=plain),
        "is_static": spec.kind in _KINDS_BY_DESCRIPTOR,
        "sized": _sized_view(spec, kernel, plain) if kernel.size_symbol else None,
        "purpose": kernel.purpose,
        "sources": [s for s in kernel.sources if plain or s not in spec.sources],
        "inputs": [_port_view(port) for port in kernel.inputs],
        "outputs": [_port_view(port) for port in outputs],
        "arguments": arguments,
        "unused": (["n"] if kernel.size_symbol and not uses_size else []) + unused_names,
        "statements": statements,
        "negative": NEGATIVE_DETERMINANT,
        "solved_outputs": solved_outputs,
        "guards": [{"code": code, "message": string_literal(message)} for code, message in guards],
        "hash": kernel.hash(),
    }


def _sized_view(spec: ElementSpec, kernel: KernelIR, plain: Collection[str]) -> dict[str, Any]:
    """Template data of the function compiled for fixed sizes, and its arguments but the size."""
    names = abi.parameter_names(kernel)
    return {
        "prototype": abi.prototype(spec.kind, spec.name, kernel, "_sized", plain),
        "sizes": _UNROLLED_SIZES,
        "arguments": [names[port.name] for port in kernel.inputs]
        + [names.get(port.name, port.name) for port in abi.c_outputs(kernel)],
    }


def _port_view(port: Port) -> dict[str, Any]:
    length = 1
    for extent in port.shape:
        length *= extent if isinstance(extent, int) else 1
    return {
        "name": string_literal(port.name),
        "length": length,
        "power": sum(isinstance(extent, str) for extent in port.shape),
        "unit": string_literal(port.unit),
        "accumulate": int(port.accumulate),
        "remark": _remark(port),
    }


def _remark(port: Port) -> str:
    """One line of a function's comment: name, shape, unit, meaning."""
    shape = "".join(f"[{extent}]" for extent in port.shape)
    parts = [f"{port.name}{shape}", f"({port.unit})" if port.unit else "", port.meaning]
    line = " ".join(part for part in parts if part)
    return comment_text(line + (", added to what is there" if port.accumulate else ""))
