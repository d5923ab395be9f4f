"""`mstmm list`: elements and methods available in scenes and in `mstmm show`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from mstmm.display import escape_control_characters

from .options import Json, quote
from .stored_elements import Entry, builtin_entries, entry_from_spec, name_with_unit
from .terminal_output import build_table, print_json, table_console

if TYPE_CHECKING:
    from pydantic import BaseModel


class Section(NamedTuple):
    """Section of the list: title, column headings, rows, and the same as plain data."""

    title: str
    columns: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    data: Any


def _hinge_section() -> Section:
    from mstmm.ir.hinge_properties import builtin_hinges

    entries = [
        Entry(
            "hinge", kind.name, kind.allows,
            tuple(name_with_unit(c.name, c.unit) for c in kind.coordinates),
            tuple(name_with_unit(c.name, c.unit) for c in kind.speeds), kind.keys,
        )
        for kind in builtin_hinges().values()
    ]  # fmt: skip
    rows = [(e.name, e.title, _join_names(e.coordinates), ", ".join(e.parameters)) for e in entries]
    columns = ("hinge", "allowed motions", "coordinates q", "additional keys")
    data = [entry.to_json() for entry in entries]
    for one in data:
        one["keys"] = one.pop("parameters")
    return Section("hinges", columns, rows, data)


#: Parameters of the built-in body in a scene; its kernels use moments derived from these.
_RIGID_BODY_PARAMETERS = ("mass [kg]", "center_of_mass [m]", "inertia [kg*m2]")


def _element_section(kind: str, title: str) -> Section:
    entries = [
        replace(e, parameters=_RIGID_BODY_PARAMETERS) if (kind, e.name) == ("body", "rigid") else e
        for e in builtin_entries(kind)
    ]
    rows = [(e.name, e.title, _join_names(e.parameters)) for e in entries]
    return Section(title, (kind, "description", "parameters"), rows, [e.to_json() for e in entries])


def _flexible_section() -> Section:
    from mstmm.scene.tables.beam import Beam
    from mstmm.scene.tables.elastic import Elastic

    return _key_section("flexible bodies", {"beam": Beam, "elastic": Elastic})


def _law_section() -> Section:
    from mstmm.scene.tables.law import Friction, Law, Limits, SpringLaw

    owners: dict[str, type[BaseModel]] = {
        "law": Law, "friction": Friction, "limits": Limits, "law of a spring": SpringLaw,
    }  # fmt: skip
    return _key_section("laws on coordinates", owners)


def _key_section(title: str, owners: Mapping[str, type[BaseModel]]) -> Section:
    """Section of keys of tables of a scene, with their expected values."""
    rows = [
        (owner, key, str(entry.get("description") or "a table, see the scene format"))
        for owner, model in owners.items()
        for key, entry in model.model_json_schema()["properties"].items()
    ]
    columns = ("table", "key", "expected")
    return _plain_section(title, columns, columns, rows)


def _plain_section(
    title: str, columns: tuple[str, ...], keys: tuple[str, ...], rows: Sequence[tuple[str, ...]]
) -> Section:
    """Section whose data are its rows, with keys for the columns."""
    return Section(title, columns, rows, [dict(zip(keys, row, strict=True)) for row in rows])


def _matrix_section() -> Section:
    rows = [
        (f"classical_{entry.name}", entry.title, "; ".join(entry.sources))
        for entry in builtin_entries("classical")
    ]
    columns, keys = ("matrix", "description", "source"), ("name", "title", "sources")
    return _plain_section("classical transfer matrices", columns, keys, rows)


def _sweep_section() -> Section:
    rows = [(f"sweep_{e.name}", e.title) for e in builtin_entries("sweep")]
    return _plain_section("steps of the sweep", ("name", "description"), ("name", "title"), rows)


def _method_section() -> Section:
    from mstmm.runtime.integrate.steppers import AUTO, AUTO_EXPLICIT, get, names
    from mstmm.runtime.run import classical_run, sundials

    methods: list[tuple[str, int | None, str, str]] = []
    for name in names():
        method = get(name)
        steps = "adaptive or fixed" if method.adaptive else "fixed"
        methods.append((name, method.order, steps, method.source))
    choice = f"{AUTO_EXPLICIT}, and rodas4p2 or rodas5p where stability limits its steps"
    methods += [(AUTO, None, "adaptive", choice), ("scipy-NAME", None, "adaptive", _SCIPY_TEXT)]
    methods += ((name, None, "adaptive", _SUNDIALS_TEXT) for name in sundials.METHODS)
    for name, product in classical_run.METHODS.items():
        solution = "product of the matrices" if product else "Riccati on the matrices"
        methods.append((name, 2, "fixed", f"{_CLASSICAL_TEXT}, {solution}"))
    rows = [(name, str(order or ""), steps, source) for name, order, steps, source in methods]
    data = [dict(zip(("name", "order", "steps", "source"), one, strict=True)) for one in methods]
    for one in data:
        one["source"] = "scipy.integrate" if one["source"] == _SCIPY_TEXT else one["source"]
    return Section("integration methods", ("method", "order>", "steps", "source"), rows, data)


_SCIPY_TEXT = "solve_ivp of SciPy on the same kernels: RK23, RK45, DOP853, Radau, BDF or LSODA"
_SUNDIALS_TEXT = "CVODE of SUNDIALS on the same kernels (extra stiff)"
_CLASSICAL_TEXT = "Rui, Wang, Zhang, ch. 7 and 8: absolute coordinates"


def _user_section() -> Section:
    from mstmm.runtime.kernels import kernel_store

    entries = [entry_from_spec(spec) for spec in kernel_store.all_specs().values()]
    rows = [
        (e.kind, e.name, e.title, _join_names(e.coordinates), _join_names(e.parameters))
        for e in entries
    ]
    columns = ("kind", "type", "description", "coordinates q", "parameters")
    title = f"user elements, in {kernel_store.folder()}"
    return Section(title, columns, rows, [e.to_json() for e in entries])


def _installed_section() -> Section:
    """Section of elements in installed packages, from entry points, without importing them."""
    from importlib.metadata import entry_points

    from mstmm.ir.element_spec import ENTRY_POINTS

    found = sorted(entry_points(group=ENTRY_POINTS), key=lambda e: e.name)
    rows = [(e.name, e.dist.name if e.dist is not None else "", e.value) for e in found]
    title = "elements of installed packages; to use them: mstmm generate --installed"
    columns = ("name", "package", "where")
    return _plain_section(title, columns, columns, rows)


def _join_names(names: tuple[str, ...]) -> str:
    return ", ".join(names) or "none"


SECTIONS: dict[str, Callable[[], Section]] = {
    "hinges": _hinge_section,
    "bodies": lambda: _element_section("body", "bodies"),
    "flexible": _flexible_section,
    "forces": lambda: _element_section("force", "force elements, in [[spring]]"),
    "laws": _law_section,
    "matrices": _matrix_section,
    "sweep": _sweep_section,
    "methods": _method_section,
    "user": _user_section,
    "installed": _installed_section,
}


def list_elements(
    parts: Annotated[
        list[str] | None,
        typer.Argument(help=f"What to list ({', '.join(SECTIONS)}); default: everything."),
    ] = None,
    json: Json = False,
) -> None:
    """List hinges, bodies, forces, laws, transfer matrices, methods and user elements."""
    for part in parts or ():
        if part not in SECTIONS:
            raise typer.BadParameter(f"{quote(part)}: expected {', '.join(SECTIONS)}")
    sections = {part: SECTIONS[part]() for part in dict.fromkeys(parts or SECTIONS)}
    if json:
        print_json({part: section.data for part, section in sections.items()})
        return
    console = table_console()
    for section in sections.values():
        if section.rows:
            console.print(build_table(section.title, section.columns, section.rows))
        else:
            console.print(f"{escape_control_characters(section.title)}: none")
        console.print()
    if not parts:
        console.print(
            "To show the equations of an element: mstmm show NAME, such as mstmm show pin"
        )
