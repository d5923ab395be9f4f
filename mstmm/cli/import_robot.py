"""`mstmm import`: conversion of a robot file to a scene."""

from __future__ import annotations

import shutil
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mstmm.printable import abbreviate

from .options import Json, new_file, positive

if TYPE_CHECKING:
    from mstmm.scene.robots.convert import Imported
    from mstmm.scene.robots.robot import Note

#: Largest number of elements named in one note.
_NAMED = 4


def import_robot(
    robot: Annotated[
        str, typer.Argument(metavar="ROBOT", help="Robot file: .urdf, or MJCF (.xml, .mjcf).")
    ],
    output: Annotated[
        str | None,
        typer.Option("--output", "-o", metavar="FILE", help="Scene file, .toml; default: robot "
                     "name, current folder."),
    ] = None,
    base: Annotated[
        str,
        typer.Option("--base", metavar="fixed|free", help="Attach the base to the ground (fixed) "
                     "or leave it free."),
    ] = "fixed",
    keep_fixed: Annotated[
        bool,
        typer.Option("--keep-fixed", help="Keep links on fixed joints as separate bodies."),
    ] = False,
    stops: Annotated[
        float | None,
        typer.Option("--stops", metavar="STIFFNESS", parser=positive, help="Convert joint limits "
                     "to stops of this stiffness (N m/rad or N/m)."),
    ] = None,
    hold_mimics: Annotated[
        bool,
        typer.Option("--hold-mimics", help="Lock mimic joints at their initial values instead of "
                     "coupling them."),
    ] = False,
    length: Annotated[
        str,
        typer.Option("--length", metavar="UNIT", help="Length unit of the file: m, cm, mm or in."),
    ] = "m",
    mass: Annotated[
        str, typer.Option("--mass", metavar="UNIT", help="Mass unit of the file: kg, g, t or lb.")
    ] = "kg",
    json: Json = False,
) -> None:  # fmt: skip
    """Convert a robot (URDF, MJCF) to a scene, and list what could not be converted."""
    import mstmm
    from mstmm.runtime.host.files import write_text

    from .output import emit_json, say

    target = new_file(output, robot, ".toml")
    found = mstmm.import_robot(
        robot, base=base, merge=not keep_fixed, stops=stops,
        mimics="held" if hold_mimics else "coupled",
        units={"length": length, "mass": mass},
    )  # fmt: skip
    found = _with_meshes_beside(found, target)
    write_text(target, found.to_toml())
    if json:
        notes = [{"where": n.where, "element": n.element, "text": n.text} for n in found.notes]
        emit_json({"scene": str(target), "names": dict(found.names), "notes": notes})
        return
    for line in together(found.notes, robot):
        say(line)
    say(f"{target}: {found.scene.summary}")


def _with_meshes_beside(found: Imported, target: Path) -> Imported:
    """Copy meshes from elsewhere to a folder next to the scene file, and refer to the copies.

    A scene file may refer only to files in its folder or below.
    """
    from mstmm.runtime.host.files import replacing

    home, shapes = target.parent.resolve(), []
    folder = home / f"{target.stem}_meshes"
    copied = dict[Path, Path]()
    for shape in found.tables.get("shape", ()):
        if "file" in shape:
            mesh = Path(shape["file"]).resolve()
            if not mesh.is_relative_to(home):
                folder.mkdir(exist_ok=True)
                name = f"{len(copied)}_{mesh.name}"
                if mesh not in copied:
                    copied[mesh] = folder / name
                    with replacing(folder / name) as temporary:
                        shutil.copyfile(mesh, temporary)
                mesh = copied[mesh]
            shape = shape | {"file": str(mesh.relative_to(home))}
        shapes.append(shape)
    return replace(found, tables={**found.tables, "shape": shapes})


def together(notes: Iterable[Note], file: str) -> list[str]:
    """One line for each text of notes, with its elements and their positions in `file`."""
    about = defaultdict[str, list[str]](list)
    for note in notes:
        place = note.where.removeprefix(file).removeprefix(": ")
        about[note.text].append(f"{note.element} ({place})" if place else note.element)
    return [f"{abbreviate(elements, _NAMED)}: {text}" for text, elements in about.items()]
