"""`mstmm list`: elements and methods available in scenes and in `mstmm show`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from mstmm.printable import printable

from .options import Json, quoted

if TYPE_CHECKING:
    from pydantic import BaseModel

    from .stored import Entry


class Section(NamedTuple):
    """Section of the list: title, column headings, rows, and the same as plain data."""

    title: str
    columns: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    data: Any


def _hinges() -> Section:
    from mstmm.ir.facts import builtin_hinges

    from .stored import Entry, with_unit

    entries = [
        Entry(
            "hinge", kind.name, kind.allows,
            tuple(with_unit(c.name, c.unit) for c in kind.coordinates),
            tuple(with_unit(c.name, c.unit) for c in kind.speeds), kind.keys,
        )
        for kind in builtin_hinges().values()
    ]  # fmt: skip
    rows = [(e.name, e.title, _joined(e.coordinates), ", ".join(e.parameters)) for e in entries]
    columns = ("hinge", "allowed motions", "coordinates q", "additional keys")
    return Section("hinges", columns, rows, [_plain_hinge(e) for e in entries])


def _plain_hinge(entry: Entry) -> dict[str, Any]:
    data = entry.to_json()
    data["keys"] = data.pop("parameters")
    return data


#: Parameters of the built-in body in a scene; its kernels use moments derived from these.
_RIGID = ("mass [kg]", "center_of_mass [m]", "inertia [kg*m2]")


def _elements(kind: str, title: str) -> Section:
    from .stored import builtin

    entries = [
        replace(e, parameters=_RIGID) if (kind, e.name) == ("body", "rigid") else e
        for e in builtin(kind)
    ]
    rows = [(e.name, e.title, _joined(e.parameters)) for e in entries]
    return Section(title, (kind, "description", "parameters"), rows, [e.to_json() for e in entries])


def _flexible() -> Section:
    from mstmm.scene.tables.beam import Beam
    from mstmm.scene.tables.elastic import Elastic

    return _keys("flexible bodies", (("beam", Beam), ("elastic", Elastic)))


def _laws() -> Section:
    from mstmm.scene.tables.law import Friction, Law, Limits, SpringLaw

    owners = (
        ("law", Law),
        ("friction", Friction),
        ("limits", Limits),
        ("law of a spring", SpringLaw),
    )
    return _keys("laws on coordinates", owners)


def _keys(title: str, owners: Sequence[tuple[str, type[BaseModel]]]) -> Section:
    """Section of keys of tables of a scene, with their expected values."""
    rows = [
        (owner, key, str(entry.get("description") or "a table, see the scene format"))
        for owner, model in owners
        for key, entry in model.model_json_schema()["properties"].items()
    ]
    data = [dict(zip(("table", "key", "expected"), row, strict=True)) for row in rows]
    return Section(title, ("table", "key", "expected"), rows, data)


def _matrices() -> Section:
    from .stored import builtin

    found = [
        (f"classical_{entry.name}", entry.title, "; ".join(entry.sources))
        for entry in builtin("classical")
    ]
    data = [dict(zip(("name", "title", "sources"), row, strict=True)) for row in found]
    return Section("classical transfer matrices", ("matrix", "description", "source"), found, data)


def _sweep() -> Section:
    from .stored import builtin

    rows = [(f"sweep_{e.name}", e.title) for e in builtin("sweep")]
    data = [{"name": name, "title": title} for name, title in rows]
    return Section("steps of the sweep", ("name", "description"), rows, data)


def _methods() -> Section:
    from mstmm.runtime.integrate.steppers import AUTO, AUTO_EXPLICIT, get, names
    from mstmm.runtime.run import classical
    from mstmm.runtime.run.second_opinion import sundials

    rows, data = [], []
    for name in names():
        method = get(name)
        steps = "adaptive or fixed" if method.adaptive else "fixed"
        rows.append((name, str(method.order), steps, method.source))
        data.append({"name": name, "order": method.order, "steps": steps, "source": method.source})
    choice = f"{AUTO_EXPLICIT}, and rodas4p2 or rodas5p where stability limits its steps"
    rows.append((AUTO, "", "adaptive", choice))
    data.append({"name": AUTO, "order": None, "steps": "adaptive", "source": choice})
    scipy = "scipy-NAME"
    said = "solve_ivp of SciPy on the same kernels: RK23, RK45, DOP853, Radau, BDF or LSODA"
    rows.append((scipy, "", "adaptive", said))
    data.append({"name": scipy, "order": None, "steps": "adaptive", "source": "scipy.integrate"})
    for name in sundials.METHODS:
        said = "CVODE of SUNDIALS on the same kernels (extra stiff)"
        rows.append((name, "", "adaptive", said))
        data.append({"name": name, "order": None, "steps": "adaptive", "source": said})
    for name, product in classical.METHODS.items():
        how = "product of the matrices" if product else "Riccati on the matrices"
        said = f"Rui, Wang, Zhang, ch. 7 and 8: absolute coordinates, {how}"
        rows.append((name, "2", "fixed", said))
        data.append({"name": name, "order": 2, "steps": "fixed", "source": said})
    columns = ("method", "order>", "steps", "source")
    return Section("integration methods", columns, rows, data)


def _user() -> Section:
    from mstmm.runtime.kernels import store

    from .stored import of_spec

    entries = [of_spec(spec) for spec in store.specs().values()]
    rows = [
        (e.kind, e.name, e.title, _joined(e.coordinates), _joined(e.parameters)) for e in entries
    ]
    columns = ("kind", "type", "description", "coordinates q", "parameters")
    title = f"user elements, in {store.folder()}"
    return Section(title, columns, rows, [e.to_json() for e in entries])


def _installed() -> Section:
    """Section of elements in installed packages, from entry points, without importing them."""
    from importlib.metadata import entry_points

    from mstmm.ir.spec import ENTRY_POINTS

    found = sorted(entry_points(group=ENTRY_POINTS), key=lambda e: e.name)
    rows = [(e.name, e.dist.name if e.dist is not None else "", e.value) for e in found]
    data = [dict(zip(("name", "package", "where"), row, strict=True)) for row in rows]
    title = "elements of installed packages; to use them: mstmm generate --installed"
    return Section(title, ("name", "package", "where"), rows, data)


def _joined(names: tuple[str, ...]) -> str:
    return ", ".join(names) or "none"


SECTIONS: dict[str, Callable[[], Section]] = {
    "hinges": _hinges,
    "bodies": lambda: _elements("body", "bodies"),
    "flexible": _flexible,
    "forces": lambda: _elements("force", "force elements, in [[spring]]"),
    "laws": _laws,
    "matrices": _matrices,
    "sweep": _sweep,
    "methods": _methods,
    "user": _user,
    "installed": _installed,
}


def _chosen(parts: Sequence[str]) -> list[str]:
    for part in parts:
        if part not in SECTIONS:
            raise typer.BadParameter(f"{quoted(part)}: expected {', '.join(SECTIONS)}")
    return list(dict.fromkeys(parts)) or list(SECTIONS)


def list_elements(
    parts: Annotated[
        list[str] | None,
        typer.Argument(help=f"What to list ({', '.join(SECTIONS)}); default: everything."),
    ] = None,
    json: Json = False,
) -> None:
    """List hinges, bodies, forces, laws, transfer matrices, methods and user elements."""
    from . import output

    sections = {part: SECTIONS[part]() for part in _chosen(parts or [])}
    if json:
        output.emit_json({part: section.data for part, section in sections.items()})
        return
    console = output.console()
    for section in sections.values():
        if section.rows:
            console.print(output.table(section.title, section.columns, section.rows))
        else:
            console.print(f"{printable(section.title)}: none")
        console.print()
    if not parts:
        console.print(
            "To show the equations of an element: mstmm show NAME, such as mstmm show pin"
        )
