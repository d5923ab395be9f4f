"""`mstmm import`: a robot's file as a scene."""

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

#: So many elements of one note are named.
_NAMED = 4


def import_robot(
    robot: Annotated[
        str, typer.Argument(metavar="ROBOT", help="A robot: .urdf, or MJCF (.xml, .mjcf).")
    ],
    output: Annotated[
        str | None,
        typer.Option("--output", "-o", metavar="FILE", help="The scene, .toml; by default with "
                     "the robot's name, here."),
    ] = None,
    base: Annotated[
        str,
        typer.Option("--base", metavar="fixed|free", help="Whether the base stands on the ground "
                     "or flies."),
    ] = "fixed",
    keep_fixed: Annotated[
        bool,
        typer.Option("--keep-fixed", help="Keep links on fixed joints as bodies of their own."),
    ] = False,
    stops: Annotated[
        float | None,
        typer.Option("--stops", metavar="STIFFNESS", parser=positive, help="Make the limits of "
                     "joints stops of this stiffness (N m/rad or N/m)."),
    ] = None,
    hold_mimics: Annotated[
        bool,
        typer.Option("--hold-mimics", help="Hold joints that go with others where they start, "
                     "instead of coupling them."),
    ] = False,
    length: Annotated[
        str,
        typer.Option("--length", metavar="UNIT", help="The file's lengths: m, cm, mm or in."),
    ] = "m",
    mass: Annotated[
        str, typer.Option("--mass", metavar="UNIT", help="The file's masses: kg, g, t or lb.")
    ] = "kg",
    json: Json = False,
) -> None:  # fmt: skip
    """Write the scene of a robot, and tell what of the file a scene has not."""
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
    """The scene with meshes that lie in its folder or below, where those from elsewhere are copied:
    a scene file names no others."""
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
    """A line for each text, with what it is about, and where in `file` that is."""
    about = defaultdict[str, list[str]](list)
    for note in notes:
        place = note.where.removeprefix(file).removeprefix(": ")
        about[note.text].append(f"{note.element} ({place})" if place else note.element)
    return [f"{abbreviate(elements, _NAMED)}: {text}" for text, elements in about.items()]
